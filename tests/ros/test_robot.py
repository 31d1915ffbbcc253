"""A robot whose offers are found bit by bit, as those of ROS 2 are."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import pytest

from drawing import grid_from_text
from mapspeak.cli.checkup import Health, describe_profile
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.discovery.profile import NavigationKind, PoseSource
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import Dialect, write_header
from mapspeak.ros.robot import RosRobot
from rosbridge_robot import CANCEL_SERVICE, ScriptedRobot, connect_scripted, eventually
from rosbridge_script import PATIENCE_S, Operation

pytestmark = pytest.mark.anyio

QUICK = Patience(first_pause_s=0.001, longest_pause_s=0.01, linger_s=0.0, goodbye_s=1.0)
PATIENT = replace(QUICK, acceptance_s=PATIENCE_S, end_s=0.05, settling_s=PATIENCE_S)
IMPATIENT = replace(QUICK, settling_s=0.0)
N_LOOKS = 3
MAP = """
###
#.#
###
"""


connected = partial(connect_scripted, patience=PATIENT)


def only_after(n_looks: int, found: object, *, nothing: object) -> Callable[[Operation], object]:
    """An answer of rosapi that is another one until it has been asked for so often."""
    answers = [nothing] * n_looks
    return lambda _: answers.pop() if answers else found


async def test_navigation_that_is_found_late_takes_the_first_goal() -> None:
    scripted = ScriptedRobot()
    found = scripted.services["/rosapi/action_servers"](Operation({}))
    scripted.services["/rosapi/action_servers"] = only_after(
        N_LOOKS, found, nothing={"action_servers": []}
    )
    async with connected(scripted) as robot:
        assert robot.profile.navigation_name is None
        await robot.send_goal(Pose(4.0, 2.0))
    assert len(scripted.goals) == 1


async def test_stop_ends_the_goals_of_a_navigation_that_is_found_only_then() -> None:
    scripted = ScriptedRobot()
    found: list[str] = []
    scripted.services["/rosapi/action_servers"] = lambda _: {"action_servers": list(found)}
    async with connected(scripted) as robot:
        assert robot.profile.navigation_name is None
        found.append("/navigate_to_pose")
        await robot.stop()
    called = [each["service"] for each in scripted.server.asked("call_service")]
    assert CANCEL_SERVICE in called


async def test_a_map_that_is_found_late_is_waited_for() -> None:
    scripted = ScriptedRobot()
    scripted.latched["/map"] = scripted.map_message(grid_from_text(MAP))
    found = scripted.services["/rosapi/topics"](Operation({}))
    nothing: object = {"topics": ["/cmd_vel"], "types": ["geometry_msgs/msg/Twist"]}
    scripted.services["/rosapi/topics"] = only_after(N_LOOKS, found, nothing=nothing)
    async with connected(scripted, overrides=RobotOverrides(radius_m=0.2)) as robot:
        assert robot.profile.map_topic is None
        assert (await robot.fetch_map()).n_cols == 3


async def test_nav2_takes_the_place_of_a_topic_for_goals_once_it_is_there() -> None:
    scripted, found = with_late_navigation()
    async with connected(scripted, patience=IMPATIENT) as robot:
        assert robot.profile.navigation is NavigationKind.GOAL_TOPIC
        found.append("/navigate_to_pose")
        await robot.send_goal(Pose(4.0, 2.0))
    assert len(scripted.goals) == 1
    assert not scripted.server.asked("publish")


async def test_a_drive_goes_on_over_the_navigation_it_began_with() -> None:
    scripted, found = with_late_navigation()
    async with connected(scripted, patience=IMPATIENT) as robot:
        goal_id = await robot.send_goal(Pose(4.0, 2.0))
        found.append("/navigate_to_pose")
        # Whoever asks for what is missing looks at the robot again.
        with pytest.raises(LinkError, match="no camera pictures"):
            await robot.fetch_picture()
        assert kind_of(robot) is NavigationKind.GOAL_TOPIC
        await robot.cancel_goal(goal_id)
        with pytest.raises(LinkError, match="no camera pictures"):
            await robot.fetch_picture()
        assert kind_of(robot) is NavigationKind.NAV2


def kind_of(robot: RosRobot) -> NavigationKind:
    return robot.profile.navigation


def with_late_navigation() -> tuple[ScriptedRobot, list[str]]:
    """A robot whose topic for goals is there, and a list that its actions are added to."""
    scripted = ScriptedRobot()
    found: list[str] = []
    scripted.topics["/goal_pose"] = "geometry_msgs/msg/PoseStamped"
    scripted.services["/rosapi/action_servers"] = lambda _: {"action_servers": list(found)}
    return scripted, found


async def test_the_radius_is_asked_for_until_the_costmap_tells_it() -> None:
    scripted = ScriptedRobot()
    scripted.latched["/map"] = scripted.map_message(grid_from_text(MAP))
    values = [{"type": 0}] * (2 * N_LOOKS)
    service = "/global_costmap/global_costmap/get_parameters"
    told = {"type": 3, "double_value": 0.35}
    scripted.services[service] = lambda call: {
        "values": [
            values.pop()
            if values
            else told
            if call["args"]["names"] == ["robot_radius"]
            else {"type": 0}
        ]
    }
    async with connected(scripted) as robot:
        assert robot.description.radius_m == 0.2
        await robot.fetch_map()
        assert robot.description.radius_m == 0.35


async def test_frames_are_looked_for_in_the_namespace_of_the_only_robot() -> None:
    scripted = ScriptedRobot()
    scripted.topics = {f"/robot1{name}": kind for name, kind in scripted.topics.items()}
    scripted.latched = {"/robot1/tf": scripted.latched["/tf"]}
    async with connected(scripted) as robot:
        assert robot.profile.pose_source is PoseSource.TF
        assert (await robot.fetch_pose()).pose == Pose(1.0, 2.0, pytest.approx(0.5))  # type: ignore[arg-type]
        assert robot.profile.map_topic == "/robot1/map"


def publishers(**nodes: list[str]) -> Callable[[Operation], object]:
    """What rosapi says of who publishes: by topic without its slashes, else somebody."""

    def answer(call: Operation) -> object:
        topic = call["args"]["topic"].strip("/").replace("/", "_")
        return {"publishers": nodes.get(topic, ["/somebody"])}

    return answer


@pytest.mark.parametrize("nodes", [[], ["/rosbridge_websocket"]])
async def test_a_move_base_that_exists_by_name_only_does_not_run(nodes: list[str]) -> None:
    scripted = ScriptedRobot(ros=1)
    scripted.services["/rosapi/publishers"] = publishers(move_base_status=[])
    scripted.services["/rosapi/subscribers"] = lambda _: {"subscribers": nodes}
    scripted.services["/rosapi/services"] = lambda _: {"services": ["/rosapi/topics"]}
    async with connected(scripted, patience=IMPATIENT) as robot:
        found = {each.what: each for each in describe_profile(robot.profile, robot.connection.link)}
    assert found["navigation"].health is Health.MISSING
    assert "nobody serves it" in found["navigation"].said
    assert "none found" in found["planner"].said


async def test_a_camera_that_nobody_publishes_any_more_is_not_looked_through() -> None:
    scripted = ScriptedRobot()
    scripted.topics["/camera/image_raw"] = "sensor_msgs/msg/Image"
    scripted.services["/rosapi/publishers"] = publishers(camera_image_raw=[])
    async with connected(scripted, patience=IMPATIENT) as robot:
        assert not robot.description.has_camera
        scripted.services["/rosapi/publishers"] = publishers()
        scripted.latched["/camera/image_raw"] = {
            "header": write_header("camera", 3.0, dialect=Dialect.ROS2),
            "height": 1,
            "width": 1,
            "encoding": "rgb8",
            "step": 3,
            "data": [255, 0, 0],
        }
        assert (await robot.fetch_picture()).width_px == 1
        assert robot.description.has_camera


async def test_a_map_that_nobody_publishes_is_said_soon() -> None:
    scripted = ScriptedRobot()
    scripted.services["/rosapi/publishers"] = publishers(map=[])
    async with connected(scripted, patience=IMPATIENT) as robot:
        with pytest.raises(LinkError, match="nobody publishes it"):
            await robot.fetch_map()


async def test_rosapi_that_is_found_late_is_waited_for() -> None:
    scripted = ScriptedRobot()
    found = scripted.services["/rosapi/topics"](Operation({}))
    broken: object = {"topics": ["/map"], "types": []}
    scripted.services["/rosapi/topics"] = only_after(N_LOOKS, found, nothing=broken)
    async with connected(scripted) as robot:
        assert robot.profile.map_topic == "/map"


async def test_a_robot_without_navigation_is_looked_at_once_when_it_has_been_there_long() -> None:
    scripted = ScriptedRobot(actions=())
    n_looks: list[Operation] = []

    def count(operation: Operation) -> object:
        n_looks.append(operation)
        return {"action_servers": []}

    scripted.services["/rosapi/action_servers"] = count
    async with connected(scripted, patience=IMPATIENT) as robot:
        n_looks.clear()
        with pytest.raises(LinkError, match="offers no navigation"):
            await robot.send_goal(Pose(4.0, 2.0))
    assert len(n_looks) == 1


async def test_the_clock_follows_that_of_a_robot_that_is_set_later() -> None:
    scripted, now_s = ScriptedRobot(), [100]
    scripted.services["/rosapi/get_time"] = lambda _: {"time": {"sec": now_s[0], "nanosec": 0}}
    async with connected(scripted, patience=replace(PATIENT, clock_s=0.01)) as robot:
        assert 100.0 <= robot.now_s < 150.0
        now_s[0] = 1_795_362_623

        async def is_set() -> bool:
            return robot.now_s >= now_s[0]

        await eventually(is_set)
