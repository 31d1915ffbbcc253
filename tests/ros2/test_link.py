"""mapspeak is a node of real ROS 2, and drives a robot there with no rosbridge."""

import math
import threading
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import cast

import anyio
import numpy as np
import pytest

from causes import quote_of
from drawing import grid_from_text
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.links.arrival import Arrival
from mapspeak.links.rclpy import open_ros2_connection, open_ros2_robot
from mapspeak.robot import GoalState, GoalStatus, Robot
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.poses import FramedPose, write_pose_stamped
from mapspeak.ros.port import NodeLinks, RosConnection, RosGraph
from mapspeak.ros.robot import RosRobot
from ros2.conftest import START, TWO_ROOMS
from ros2.robot_process import RobotProcess, open_robot_process

pytestmark = [pytest.mark.ros2, pytest.mark.anyio]

PATIENCE_S = 40.0
"""A node that was killed is missed after 20 s."""
NEXT_ROOM = Pose(8.0, 2.25)
INSIDE_THE_WALL = Pose(5.25, 3.0)
NAVIGATION, NAVIGATION_TYPE = "/navigate_to_pose", "nav2_msgs/action/NavigateToPose"
MAP_TYPE = "nav_msgs/msg/OccupancyGrid"


@asynccontextmanager
async def linked() -> AsyncGenerator[RosRobot]:
    with anyio.fail_after(PATIENCE_S):
        async with open_ros2_robot() as robot:
            yield robot


@asynccontextmanager
async def connected() -> AsyncGenerator[RosConnection]:
    with anyio.fail_after(PATIENCE_S):
        async with open_ros2_connection() as connection:
            yield connection


async def until_over(robot: Robot, goal_id: str) -> GoalStatus:
    while not (status := await robot.fetch_goal_status(goal_id)).state.is_final:
        await robot.sleep(0.05)
    return status


async def until(is_so: Callable[[], object]) -> None:
    while not is_so():  # noqa: ASYNC110 - what happens, happens in other programs
        await anyio.sleep(0.05)


async def eventually(look: Callable[[], Awaitable[object]]) -> None:
    while not await look():  # noqa: ASYNC110 - likewise
        await anyio.sleep(0.05)


def pose_in(frame_id: str) -> dict[str, object]:
    framed = FramedPose(pose=NEXT_ROOM, frame_id=frame_id, stamp_s=0.0)
    return {"pose": write_pose_stamped(framed, dialect=Dialect.ROS2)}


# --- the map, and where the robot is


async def test_the_latched_map_and_the_pose_are_the_robots(robot: RobotProcess) -> None:
    assert robot.process.poll() is None
    async with linked() as link:
        assert np.array_equal((await link.fetch_map()).cells, grid_from_text(TWO_ROOMS).cells)
        pose = (await link.fetch_pose()).pose
    assert (pose.x, pose.y) == pytest.approx((START.x, START.y))


async def test_a_new_map_and_a_part_of_one_are_taken_in(robot: RobotProcess) -> None:
    async with linked() as link:
        before = await link.fetch_map()

        async def is_changed() -> bool:
            # Updates are not latched: one that is sent before we are known to listen is lost.
            robot.update_map("##\n##", row=2, col=3)
            return bool(((await link.fetch_map()).cells[2:4, 3:5] == 100).all())

        await eventually(is_changed)
        changed = await link.fetch_map()
        assert (changed.cells != before.cells).sum() == 4
        robot.change_map("###\n#.#\n###")

        async def is_new() -> bool:
            return (await link.fetch_map()).n_cols == 3

        await eventually(is_new)


async def test_a_renewed_subscription_hears_what_is_latched_again(robot: RobotProcess) -> None:
    assert robot.process.poll() is None
    async with connected() as connection:
        maps = connection.subscribe("/map")
        await maps.wait_for_more_than(0, timeout_s=PATIENCE_S)
        connection.renew(maps)
        again = await maps.wait_for_more_than(1, timeout_s=PATIENCE_S)
    assert again["info"]["width"] == 23


async def test_a_robot_that_is_started_later_is_found(domain: dict[str, str]) -> None:
    arrival = Arrival(open_ros2_robot)
    link = arrival.robot
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(arrival.keep_looking)
        with pytest.raises(LinkError, match="No other node of ROS 2"):
            await link.fetch_map()
        with open_robot_process(TWO_ROOMS, pose=START, speed_mps=2.0, environment=domain):

            async def has_come() -> bool:
                try:
                    return (await link.fetch_map()).n_cols == 23
                except LinkError:
                    return False

            await eventually(has_come)

            async def is_localised() -> bool:
                try:
                    return (await link.fetch_pose()).pose.x == pytest.approx(START.x)
                except LinkError:
                    return False

            await eventually(is_localised)
            goal_id = await link.send_goal(NEXT_ROOM)
            assert (await until_over(link, goal_id)).state is GoalState.ARRIVED
        tasks.cancel_scope.cancel()


# --- goals


async def test_goals_arrive_and_walls_stop_them(robot: RobotProcess) -> None:
    async with linked() as link:
        arrived = await until_over(link, await link.send_goal(NEXT_ROOM))
        assert arrived.state is GoalState.ARRIVED
        assert robot.pose.x == pytest.approx(NEXT_ROOM.x)
        blocked = await until_over(link, await link.send_goal(INSIDE_THE_WALL))
    assert blocked.state is GoalState.BLOCKED
    assert quote_of(blocked) == "The way is blocked."


async def test_a_goal_tells_its_id_its_acceptance_and_its_feedback(robot: RobotProcess) -> None:
    robot.set_recoveries(2)
    async with connected() as connection:
        goal = await connection.send_goal(NAVIGATION, pose_in("map"), type_name=NAVIGATION_TYPE)
        statuses = connection.subscribe(f"{NAVIGATION}/_action/status")
        await until(lambda: goal.end)
        listed = await statuses.wait_for_more_than(0, timeout_s=PATIENCE_S)
    ids = [each["goal_info"]["goal_id"]["uuid"].hex() for each in listed["status_list"]]
    assert goal.ros_id in ids
    assert goal.is_accepted
    assert goal.end is not None
    assert goal.feedback is not None
    assert goal.feedback["number_of_recoveries"] == 2
    assert goal.end.is_result
    assert goal.end.status == 4
    assert goal.end.values["error_code"] == 0


async def test_a_goal_in_an_unknown_frame_is_rejected(robot: RobotProcess) -> None:
    async with connected() as connection:
        goal = await connection.send_goal(NAVIGATION, pose_in("moon"), type_name=NAVIGATION_TYPE)
        await until(lambda: goal.end)
    assert goal.end is not None
    assert not goal.end.is_result
    assert not goal.is_accepted
    assert not robot.is_driving


async def test_a_cancelled_goal_leaves_the_robot_where_it_is(robot: RobotProcess) -> None:
    async with linked() as link:
        goal_id = await link.send_goal(NEXT_ROOM)
        await link.cancel_goal(goal_id)
        status = await link.fetch_goal_status(goal_id)
    assert status.state is GoalState.CANCELLED
    assert not robot.is_driving


async def test_a_goal_that_another_client_replaces_is_preempted(robot: RobotProcess) -> None:
    async with linked() as ours, linked() as other:
        first = await ours.send_goal(NEXT_ROOM)
        second = await other.send_goal(START)
        replaced = await until_over(ours, first)
        assert (await until_over(other, second)).state is GoalState.ARRIVED
    assert replaced.state is GoalState.PREEMPTED
    assert not robot.is_driving


async def test_a_robot_killed_in_the_middle_of_a_drive_is_lost(robot: RobotProcess) -> None:
    async with linked() as link:
        await link.connection.call_service("/switch_motors", {"data": False})
        goal_id = await link.send_goal(NEXT_ROOM)
        robot.process.kill()
        status = await until_over(link, goal_id)
        assert status.state is GoalState.LOST

        async def is_missed() -> bool:
            with pytest.raises(LinkError) as raised:
                await link.connection.call_service("/switch_motors", {"data": True}, timeout_s=0.5)
            return "Nobody serves" in raised.value.message

        await eventually(is_missed)


async def test_a_goal_is_lost_that_a_robot_started_again_knows_nothing_of(
    robot: RobotProcess, domain: dict[str, str]
) -> None:
    async with linked() as link:
        await link.connection.call_service("/switch_motors", {"data": False})
        goal_id = await link.send_goal(NEXT_ROOM)
        robot.process.kill()
        with open_robot_process(TWO_ROOMS, pose=START, speed_mps=2.0, environment=domain):
            assert (await until_over(link, goal_id)).state is GoalState.LOST
            again = await until_over(link, await link.send_goal(NEXT_ROOM))
    assert again.state is GoalState.ARRIVED


async def test_stop_ends_the_goals_of_all_and_commands_a_stand(robot: RobotProcess) -> None:
    async with linked() as ours, linked() as other:
        goal_id = await other.send_goal(NEXT_ROOM)
        await ours.stop()
        assert (await until_over(other, goal_id)).state is GoalState.CANCELLED
        await until(lambda: robot.velocities)
    assert set(robot.velocities) == {(0.0, 0.0)}
    assert not robot.is_driving


# --- what is sent must fit


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ({"linear": {"x": math.nan}}, "linear.x wants a finite number"),
        ({"angular": {"z": math.inf}}, "angular.z wants a finite number"),
        ({"linear": {"x": "fast"}}, "linear.x wants a number"),
        ({"linear": {"x": True}}, "linear.x wants a number"),
        ({"linear": {"w": 1.0}}, "no field 'linear.w'"),
        ({"linear": 1.0}, "linear wants an object"),
        ({"liner": {}}, "Did you mean linear"),
    ],
)
async def test_a_velocity_that_does_not_fit_is_refused_with_its_field(
    robot: RobotProcess, message: dict[str, object], said: str
) -> None:
    async with connected() as connection:
        connection.advertise("/cmd_vel", type_name="geometry_msgs/msg/Twist")
        with pytest.raises(LinkError, match=said):
            await connection.publish("/cmd_vel", message)
        with pytest.raises(LinkError, match=said):
            connection.publish_everywhere("/cmd_vel", message)
        await connection.publish("/cmd_vel", {"angular": {"z": 0.5}})
        await until(lambda: robot.velocities)
    assert robot.velocities == [(0.0, 0.5)]


async def test_names_and_types_that_are_none_are_refused(robot: RobotProcess) -> None:
    assert robot.process.poll() is None
    async with connected() as connection:
        with pytest.raises(LinkError, match="is a nav_msgs/OccupancyGrid, not a"):
            connection.subscribe("/map", type_name="std_msgs/msg/String")
        with pytest.raises(LinkError, match="knows no message of the type antigravity/Fly"):
            connection.subscribe("/map", type_name="antigravity/msg/Fly")
        with pytest.raises(LinkError, match="is not the name of a ROS topic"):
            connection.subscribe("/a b")
        with pytest.raises(LinkError, match="was not advertised"):
            await connection.publish("/cmd_vel", {})
        with pytest.raises(LinkError, match="Nobody serves /fly"):
            await connection.call_service("/fly", {}, timeout_s=0.1)
        with pytest.raises(LinkError, match="data wants true or false"):
            await connection.call_service("/switch_motors", {"data": 1})
        with pytest.raises(LinkError, match="is a std_srvs/SetBool"):
            await connection.call_service("/switch_motors", {}, type_name="std_srvs/srv/Empty")
        with pytest.raises(LinkError, match="Nobody serves /dance"):
            await connection.send_goal("/dance", pose_in("map"), type_name=NAVIGATION_TYPE)
        with pytest.raises(LinkError, match=r"pose\.pose\.position\.x wants a finite number"):
            await connection.send_goal(
                NAVIGATION,
                {"pose": {"pose": {"position": {"x": math.nan}}}},
                type_name=NAVIGATION_TYPE,
            )


async def test_what_is_published_arrives_as_it_was(domain: dict[str, str]) -> None:
    assert domain
    cells = np.arange(-100, 100, dtype=np.int8)
    async with connected() as sender, connected() as receiver:
        sender.advertise("/grid", type_name=MAP_TYPE)
        heard = receiver.subscribe("/grid", type_name=MAP_TYPE)
        message = {"header": {"frame_id": "äöü"}, "info": {"width": 200}, "data": cells}
        while heard.latest is None:
            await sender.publish("/grid", message)
            await anyio.sleep(0.05)
    assert heard.latest["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "äöü"}
    assert heard.latest["data"].dtype == np.int8
    assert np.array_equal(heard.latest["data"], cells)


async def test_what_is_latched_reaches_who_subscribes_later(domain: dict[str, str]) -> None:
    assert domain
    async with connected() as one:
        one.advertise("/note", type_name="std_msgs/msg/String", is_latched=True)
        await one.publish("/note", {"data": "R1"})
        async with connected() as other:
            notes = other.subscribe("/note")
            message = await notes.wait_for_more_than(0, timeout_s=PATIENCE_S)
    assert message["data"] == "R1"


@pytest.mark.parametrize("cells", [[1.5], [True], [300], ["1"], np.array([0.5]), [None]])
async def test_cells_that_are_none_are_refused(domain: dict[str, str], cells: object) -> None:
    assert domain
    async with connected() as connection:
        connection.advertise("/grid", type_name=MAP_TYPE)
        with pytest.raises(LinkError, match=r"data.* wants a"):
            await connection.publish("/grid", {"data": cells})


async def test_a_topic_sent_with_best_effort_is_heard(domain: dict[str, str]) -> None:
    from rclpy.qos import QoSProfile, ReliabilityPolicy  # noqa: PLC0415 - needs rclpy
    from tf2_msgs.msg import TFMessage  # noqa: PLC0415

    from ros2.ros_client import open_ros_client  # noqa: PLC0415

    assert domain
    quality = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    async with connected() as connection:
        heard = connection.subscribe("/frames")
        with open_ros_client() as client:
            publisher = client.node.create_publisher(TFMessage, "/frames", quality)
            while heard.latest is None:
                publisher.publish(TFMessage())
                await anyio.sleep(0.05)
    assert heard.latest == {"transforms": []}


# --- the whole graph


async def test_a_node_of_which_only_the_name_is_known_is_not_all_there_is() -> None:
    from mapspeak.links.rclpy.connection import wait_until_quiet  # noqa: PLC0415 - needs rclpy

    class Unfolding:
        def __init__(self) -> None:
            self.n_looks = 0

        async def fetch_nodes(self) -> tuple[str, ...]:
            return ("/robot",)

        async def fetch_graph(self) -> RosGraph:
            return RosGraph(dialect=Dialect.ROS2, distro="", types={}, actions=())

        async def fetch_node(self, node: str) -> NodeLinks:
            assert node == "/robot"
            self.n_looks += 1
            publishes = ("/map",) if self.n_looks == 3 else ()
            return NodeLinks(publishes=publishes, subscribes=(), serves=())

    system = Unfolding()
    with anyio.fail_after(PATIENCE_S):
        await wait_until_quiet(cast("RosConnection", system))
    assert system.n_looks == 3


async def test_the_graph_is_the_robots_and_not_ours(robot: RobotProcess) -> None:
    assert robot.process.poll() is None
    async with connected() as connection:
        connection.advertise("/ours", type_name="std_msgs/msg/String")
        connection.subscribe("/ours_too", type_name="std_msgs/msg/String")
        graph = await connection.fetch_graph()
        assert graph.types["/map"] == "nav_msgs/OccupancyGrid"
        assert graph.actions == (NAVIGATION, "/spin")
        assert not [topic for topic in graph.types if topic.startswith("/ours")]
        assert await connection.fetch_nodes() == ("/bt_navigator", "/robot")
        assert "/map" in (await connection.fetch_node("/robot")).publishes
        assert await connection.fetch_publishers("/map") == ("/robot",)
        assert await connection.fetch_subscribers("/cmd_vel") == ("/robot",)
        assert await connection.fetch_service_type("/switch_motors") == "std_srvs/SetBool"
        assert await connection.fetch_action_type(NAVIGATION) == "nav2_msgs/NavigateToPose"
        assert "/switch_motors" in await connection.fetch_services()
        with pytest.raises(LinkError, match="knows no /ghost"):
            await connection.fetch_node("/ghost")


async def test_definitions_hold_all_that_is_within(domain: dict[str, str]) -> None:
    assert domain
    async with connected() as connection:
        grid = await connection.fetch_definitions(MAP_TYPE)
        action = await connection.fetch_definitions("nav2_msgs/NavigateToPose")
        service = await connection.fetch_definitions("std_srvs/srv/SetBool")
        nothing = await connection.fetch_definitions("no_msgs/Nothing")
    assert next(iter(grid)) == "nav_msgs/OccupancyGrid"
    assert "int8[] data" in grid["nav_msgs/OccupancyGrid"]
    assert "float64 x" in grid["geometry_msgs/Point"]
    assert {f"nav2_msgs/NavigateToPose_{part}" for part in ("Goal", "Result", "Feedback")} <= set(
        action
    )
    assert "bool data" in service["std_srvs/SetBool_Request"]
    assert nothing == {}


async def test_parameters_of_every_kind_are_read_and_set(robot: RobotProcess) -> None:
    assert robot.process.poll() is None
    async with connected() as connection:
        names = await connection.fetch_parameter_names("/robot")
        values = {name: await connection.fetch_parameter("/robot", name) for name in names}
        await connection.set_parameter("/robot", "robot_radius", 1)
        await connection.set_parameter("/robot", "layers", ["static"])
        assert await connection.fetch_parameter("/robot", "robot_radius") == 1.0
        assert await connection.fetch_parameter("/robot", "layers") == ["static"]
        with pytest.raises(LinkError, match="refuses max_recoveries"):
            await connection.set_parameter("/robot", "max_recoveries", "many")
    assert values["robot_name"] == "test robot"
    assert values["footprint_x"] == [0.2, 0.2, -0.2, -0.2]
    assert values["sensor_is_on"] == [True, False]
    assert values["sensor_ids"] == [3, 5]
    assert values["serial"] == [1, 255]


# --- coming and going


async def test_leaving_leaves_no_thread_and_no_node(domain: dict[str, str]) -> None:
    assert domain
    async with connected() as witness:
        async with connected() as connection:
            assert len(await witness.fetch_nodes()) == 1
            assert len(await connection.fetch_nodes()) == 1
        await eventually(lambda: _has_no_nodes(witness))
        assert len([each for each in threading.enumerate() if "mapspeak_" in each.name]) == 1
    assert not [each for each in threading.enumerate() if "mapspeak_" in each.name]


async def _has_no_nodes(connection: RosConnection) -> bool:
    return not await connection.fetch_nodes()


async def test_the_last_to_unsubscribe_ends_the_reading(robot: RobotProcess) -> None:
    assert robot.process.poll() is None
    async with connected() as witness, connected() as connection:
        twice = [connection.subscribe("/odom"), connection.subscribe("/odom")]
        await twice[0].wait_for_more_than(2, timeout_s=PATIENCE_S)

        async def reads() -> bool:
            return bool(await witness.fetch_subscribers("/odom"))

        async def reads_no_more() -> bool:
            return not await witness.fetch_subscribers("/odom")

        connection.unsubscribe(twice[0])
        await eventually(reads)
        connection.unsubscribe(twice[1])
        await eventually(reads_no_more)
