"""A robot whose offers are found bit by bit, as those of ROS 2 are."""

from collections.abc import Callable
from functools import partial

import pytest

from drawing import grid_from_text
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.links.ros import DrivingPatience
from mapspeak.links.rosbridge.client import Timing
from rosbridge_robot import CANCEL_SERVICE, ScriptedRobot, connect_scripted
from rosbridge_script import PATIENCE_S, Operation

pytestmark = pytest.mark.anyio

QUICK = Timing(first_pause_s=0.001, longest_pause_s=0.01, linger_s=0.0, goodbye_s=1.0)
PATIENT = DrivingPatience(acceptance_s=PATIENCE_S, end_s=0.05, settling_s=PATIENCE_S)
IMPATIENT = DrivingPatience(settling_s=0.0)
N_LOOKS = 3
MAP = """
###
#.#
###
"""


connected = partial(connect_scripted, timing=QUICK, patience=PATIENT)


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
    found = scripted.services["/rosapi/action_servers"](Operation({}))
    scripted.services["/rosapi/action_servers"] = only_after(
        1, found, nothing={"action_servers": []}
    )
    async with connected(scripted) as robot:
        assert robot.profile.navigation_name is None
        await robot.stop()
    called = [each["service"] for each in scripted.server.asked("call_service")]
    assert CANCEL_SERVICE in called


async def test_a_map_that_is_found_late_is_waited_for() -> None:
    scripted = ScriptedRobot()
    scripted.latched["/map"] = scripted.map_message(grid_from_text(MAP))
    found = scripted.services["/rosapi/topics"](Operation({}))
    nothing: object = {"topics": ["/cmd_vel"], "types": ["geometry_msgs/msg/Twist"]}
    scripted.services["/rosapi/topics"] = only_after(N_LOOKS, found, nothing=nothing)
    async with connected(scripted) as robot:
        assert robot.profile.map_topic is None
        assert (await robot.fetch_map()).n_cols == 3


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
