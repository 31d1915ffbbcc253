"""A stop over DDS, where being connected does not mean that anybody hears it."""

from functools import partial

import pytest

pytest.importorskip("cyclonedds", reason="has no wheel for this Python")

from dds_node import DdsNode, open_both, until
from mapspeak.errors import LinkError
from mapspeak.ros.link import Patience
from mapspeak.ros.robot import build_ros_robot

pytestmark = pytest.mark.anyio

AT_ONCE = Patience(settling_s=0.0, frames_s=0.0)


async def test_a_stop_with_no_robot_there_says_that_nobody_was_told() -> None:
    async with open_both(patience=AT_ONCE) as (_, connection):
        robot = await build_ros_robot(connection)
        with pytest.raises(LinkError, match="Nobody could be told"):
            await robot.stop()


async def test_a_stop_of_a_robot_that_hears_velocities_is_enough() -> None:
    listening = partial(DdsNode.listen, topic="/cmd_vel", type_name="geometry_msgs/msg/Twist")
    async with open_both(listening, patience=AT_ONCE) as (node, connection):
        robot = await build_ros_robot(connection)
        await robot.stop()
        await until(lambda: node.heard["/cmd_vel"])
    assert node.heard["/cmd_vel"][0]["linear"] == {"x": 0.0, "y": 0.0, "z": 0.0}


async def test_a_topic_on_which_nothing_can_be_sent_keeps_a_stop_from_no_other() -> None:
    listening = partial(DdsNode.listen, topic="/cmd_vel", type_name="geometry_msgs/msg/Twist")
    async with open_both(listening, patience=AT_ONCE) as (node, connection):
        robot = await build_ros_robot(connection)
        connection.started.note_velocity("/never_advertised", zero={})
        ended: list[str] = []
        connection.started.actions["/dance"] = Dance(ended)
        with pytest.raises(LinkError, match="/never_advertised was not advertised"):
            await robot.stop()
        await until(lambda: node.heard["/cmd_vel"])
    assert ended == ["dance"]


class Dance:
    """An action with a goal under way."""

    is_busy = True
    owners: frozenset[str] = frozenset()

    def __init__(self, ended: list[str]) -> None:
        self._ended = ended

    async def end(self) -> bool:
        self._ended.append("dance")
        return True
