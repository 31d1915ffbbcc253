"""mapspeak drives a robot on real ROS 2 over DDS, with no ROS on its own side."""

import io
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any

import anyio
import numpy as np
import pytest
from PIL import Image

from causes import quote_of
from drawing import grid_from_text
from mapspeak.cli.shared.robots import read_network
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.robot import GoalState, GoalStatus, Robot
from mapspeak.ros.activity import ActionGoal
from ros2.conftest import START, TWO_ROOMS
from ros2.robot_process import RobotProcess

if TYPE_CHECKING:
    from mapspeak.links.dds import DdsConnection
    from mapspeak.ros.robot import RosRobot

pytest.importorskip("cyclonedds", reason="has no wheel for this Python")

pytestmark = [pytest.mark.ros2, pytest.mark.anyio]

PATIENCE_S = 30.0
NEXT_ROOM = Pose(8.0, 2.25)
INSIDE_THE_WALL = Pose(5.25, 3.0)
NAVIGATE, NAVIGATE_TYPE = "/navigate_to_pose", "nav2_msgs/action/NavigateToPose"
SPIN, SPIN_TYPE = "/spin", "nav2_msgs/action/Spin"
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6


@asynccontextmanager
async def connected(robot: RobotProcess) -> AsyncGenerator["DdsConnection"]:
    from mapspeak.links.dds import open_dds_connection  # noqa: PLC0415 - optional

    async with open_dds_connection(read_network("", robot.environment)) as connection:
        yield connection


@asynccontextmanager
async def linked(robot: RobotProcess) -> AsyncGenerator["RosRobot"]:
    from mapspeak.links.dds import open_dds_robot  # noqa: PLC0415 - optional

    async with open_dds_robot(read_network("", robot.environment)) as opened:
        yield opened


async def until_over(robot: Robot, goal_id: str) -> GoalStatus:
    with anyio.fail_after(PATIENCE_S):
        while True:
            status = await robot.fetch_goal_status(goal_id)
            if status.state.is_final:
                return status
            await robot.sleep(0.1)


async def until(goal: ActionGoal, is_so: Callable[[ActionGoal], object]) -> None:
    news = anyio.Event()

    def consider() -> None:
        if is_so(goal):
            news.set()

    goal.listen(consider)
    consider()
    with anyio.fail_after(PATIENCE_S):
        await news.wait()


def goal_at(pose: Pose, frame: str = "map") -> dict[str, Any]:
    position = {"x": pose.x, "y": pose.y}
    return {"pose": {"header": {"frame_id": frame}, "pose": {"position": position}}}


async def test_map_pose_and_picture_are_the_robots(robot: RobotProcess) -> None:
    async with linked(robot) as opened:
        assert np.array_equal((await opened.fetch_map()).cells, grid_from_text(TWO_ROOMS).cells)
        pose = (await opened.fetch_pose()).pose
        assert (pose.x, pose.y) == pytest.approx((START.x, START.y))
        picture = await opened.fetch_picture()
    decoded = Image.open(io.BytesIO(picture.data)).convert("RGB")
    assert picture.horizontal_fov_rad == pytest.approx(np.pi / 2.0)
    red, _, blue = decoded.getpixel((0, 0))  # type: ignore[misc]  # RGB has three
    assert red > blue


async def test_a_change_of_the_map_arrives(robot: RobotProcess) -> None:
    async with connected(robot) as connection:
        maps = connection.subscribe("/map")
        await maps.wait_for_more_than(0, timeout_s=PATIENCE_S)
        robot.change_map("###\n#.#\n###")
        message = await maps.wait_for_more_than(1, timeout_s=PATIENCE_S)
    assert message["data"].tolist() == [100, 100, 100, 100, 0, 100, 100, 100, 100]


async def test_goals_arrive_and_walls_stop_them(robot: RobotProcess) -> None:
    async with linked(robot) as opened:
        arrived = await until_over(opened, await opened.send_goal(NEXT_ROOM))
        assert arrived.state is GoalState.ARRIVED
        assert robot.pose.x == pytest.approx(NEXT_ROOM.x)
        blocked = await until_over(opened, await opened.send_goal(INSIDE_THE_WALL))
    assert blocked.state is GoalState.BLOCKED
    assert quote_of(blocked) == "The way is blocked."


async def test_stop_ends_a_drive_and_commands_a_stand(robot: RobotProcess) -> None:
    async with linked(robot) as opened:
        goal_id = await opened.send_goal(NEXT_ROOM)
        await opened.stop()
        assert (await until_over(opened, goal_id)).state is GoalState.CANCELLED
        assert not robot.is_driving
    assert (0.0, 0.0) in robot.velocities


async def test_a_goal_tells_of_itself_under_its_own_id(robot: RobotProcess) -> None:
    robot.set_recoveries(2)
    async with connected(robot) as connection:
        statuses = connection.subscribe(f"{NAVIGATE}/_action/status")
        goal = await connection.send_goal(NAVIGATE, goal_at(NEXT_ROOM), type_name=NAVIGATE_TYPE)
        await until(goal, lambda goal: goal.feedback)
        assert goal.is_accepted
        await until(goal, lambda goal: goal.end)
        known = statuses.latest
    assert goal.feedback is not None
    assert goal.feedback["number_of_recoveries"] == 2
    assert goal.end is not None
    assert (goal.end.status, goal.end.is_result) == (SUCCEEDED, True)
    assert goal.end.values == {"error_code": 0, "error_msg": ""}
    assert known is not None
    ids = [each["goal_info"]["goal_id"]["uuid"].hex() for each in known["status_list"]]
    assert goal.ros_id in ids


async def test_a_goal_in_an_unknown_frame_is_rejected(robot: RobotProcess) -> None:
    async with connected(robot) as connection:
        request = goal_at(NEXT_ROOM, frame="moon")
        goal = await connection.send_goal(NAVIGATE, request, type_name=NAVIGATE_TYPE)
        await until(goal, lambda goal: goal.end)
    assert goal.end is not None
    assert not goal.end.is_result


async def test_two_clients_goals_do_not_get_mixed_up(robot: RobotProcess) -> None:
    async with connected(robot) as ours, connected(robot) as theirs:
        first = await ours.send_goal(NAVIGATE, goal_at(NEXT_ROOM), type_name=NAVIGATE_TYPE)
        await until(first, lambda goal: goal.feedback)
        second = await theirs.send_goal(NAVIGATE, goal_at(START), type_name=NAVIGATE_TYPE)
        await until(first, lambda goal: goal.end)
        await until(second, lambda goal: goal.feedback)
        assert second.end is None
        theirs.cancel_goal(second)
        await until(second, lambda goal: goal.end)
    assert first.end is not None
    assert second.end is not None
    assert (first.end.status, second.end.status) == (ABORTED, CANCELED)


async def test_the_graph_is_the_robots(robot: RobotProcess) -> None:
    async with connected(robot) as connection:
        graph = await connection.fetch_graph()
        assert graph.types["/map"] == "nav_msgs/OccupancyGrid"
        assert graph.actions == (NAVIGATE, SPIN)
        assert await connection.fetch_action_type(NAVIGATE) == "nav2_msgs/NavigateToPose"
        assert await connection.fetch_nodes() == ("/bt_navigator", "/robot")
        node = await connection.fetch_node("/robot")
        assert "/map" in node.publishes
        assert "/cmd_vel" in node.subscribes
        assert "/switch_motors" in node.serves
        assert await connection.fetch_publishers("/scan") == ("/robot",)
        assert await connection.fetch_service_type("/switch_motors") == "std_srvs/SetBool"


async def test_services_and_parameters_of_every_kind_answer(robot: RobotProcess) -> None:
    async with connected(robot) as connection:
        answer = await connection.call_service("/switch_motors", {"data": False})
        assert answer == {"success": True, "message": "The motors are off."}
        names = await connection.fetch_parameter_names("/robot")
        values = {name: await connection.fetch_parameter("/robot", name) for name in names}
        await connection.set_parameter("/robot", "robot_radius", 1)
        assert await connection.fetch_parameter("/robot", "robot_radius") == 1.0
        with pytest.raises(LinkError):
            await connection.set_parameter("/robot", "robot_radius", "large")
    assert values["robot_name"] == "test robot"
    assert values["footprint_x"] == [0.2, 0.2, -0.2, -0.2]
    assert values["sensor_ids"] == [3, 5]
    assert values["sensor_is_on"] == [True, False]
    assert values["layers"] == ["static", "obstacles"]
    assert values["serial"] == [1, 255]


async def test_a_velocity_is_heard_by_the_robot(robot: RobotProcess) -> None:
    async with connected(robot) as connection:
        connection.advertise("/cmd_vel", type_name="geometry_msgs/msg/Twist")
        await connection.publish("/cmd_vel", {"linear": {"x": 0.25}, "angular": {"z": 0.5}})
        with anyio.fail_after(PATIENCE_S):
            while not robot.velocities:  # noqa: ASYNC110 - it happens in another process
                await anyio.sleep(0.01)
    assert robot.velocities == [(0.25, 0.5)]


async def test_a_node_describes_the_type_of_its_topic(robot: RobotProcess) -> None:
    async with connected(robot) as connection:
        updates = connection.discovery.writers_of("rt/map_updates")[0]
        ours = connection.types.definitions(updates.type_name)
        await connection.ask_type(updates)
        theirs = connection.types.definitions(updates.type_name)
        heard = connection.subscribe("/map_updates")
        with anyio.fail_after(PATIENCE_S):
            # The robot may not know yet that somebody listens, and it says nothing twice.
            while heard.latest is None:
                robot.update_map("##", row=1, col=2)
                with anyio.move_on_after(0.2):
                    await heard.wait_for_more_than(0, timeout_s=PATIENCE_S)
        message = heard.latest
    assert theirs.keys() == ours.keys()
    assert (message["x"], message["y"], message["data"].tolist()) == (2, 1, [100, 100])


async def test_robot_time_is_told(robot: RobotProcess) -> None:
    async with connected(robot) as connection:
        odometry = connection.subscribe("/odom")
        stamp = (await odometry.wait_for_more_than(0, timeout_s=PATIENCE_S))["header"]["stamp"]
        now_s = await connection.fetch_time_s()
    assert now_s == pytest.approx(stamp["sec"], abs=60.0)


async def test_kilteds_spin_turns_the_robot(robot: RobotProcess) -> None:
    async with connected(robot) as connection:
        goal = await connection.send_goal(SPIN, {"target_yaw": 1.5}, type_name=SPIN_TYPE)
        await until(goal, lambda goal: goal.end)
        definition = await connection.fetch_definitions(SPIN_TYPE)
    assert goal.end is not None
    assert goal.end.status == SUCCEEDED
    assert robot.pose.yaw_rad == pytest.approx(1.5, abs=0.1)
    assert "disable_collision_checks" in definition["nav2_msgs/Spin_Goal"]
