"""`ros_type` for names and definitions that are not quite right."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import pytest

from bridging import SteppedRobot
from fakes import FakeRobot, two_rooms
from mapspeak.links.rosbridge import RobotAddress, RosbridgeClient, open_client
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.port import RosConnection
from mapspeak.rosbridge_server import open_rosbridge_server
from rosserved import QUICK, on_our_server, served

pytestmark = pytest.mark.anyio
both = pytest.mark.parametrize("dialect", Dialect)


@both
async def test_a_bare_name_is_answered_with_the_types_that_end_so(
    dialect: Dialect, tmp_path: Path
) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        twist = await caller.refuse("ros_type", type="Twist")
        trigger = await caller.refuse("ros_type", type="trigger")
        nothing = await caller.refuse("ros_type", type="what is this")
    assert "'Twist' is no full name of a type" in twist
    assert f"It may be {dialect.type_name('geometry_msgs/Twist')}" in twist
    assert ("std_srvs/srv/Trigger" if dialect is Dialect.ROS2 else "std_srvs/Trigger") in trigger
    assert "It looks like geometry_msgs/msg/Twist" in nothing


@both
async def test_an_unknown_type_is_answered_with_the_nearest(
    dialect: Dialect, tmp_path: Path
) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        misspelt = await caller.refuse("ros_type", type="geometry_msgs/Twits")
        elsewhere = await caller.refuse("ros_type", type="nav_msgs/Twist")
    assert "Unknown type geometry_msgs/Twits" in misspelt
    assert f"{dialect.type_name('geometry_msgs/Twist')}" in misspelt
    assert f"{dialect.type_name('geometry_msgs/Twist')}" in elsewhere


@pytest.mark.parametrize(
    ("definition", "said"),
    [
        ("I am no definition.", "has a line that defines nothing: 'I am no definition.'"),
        ("float64 x\n<xml>", "has a line that defines nothing: '<xml>'"),
        ("hello world", "holds the type arm_msgs/hello, which nobody knows"),
        ("float64 x\n---\nNot_known y", "holds the type arm_msgs/Not_known, which nobody knows"),
    ],
)
async def test_a_definition_that_is_none_is_refused(
    tmp_path: Path, definition: str, said: str
) -> None:
    async with on_our_server(Dialect.ROS2, tmp_path) as (_, caller):
        text = await caller.refuse("ros_type", type="arm_msgs/Arm", definition=definition)
        good = await caller.ask(
            "ros_type",
            type="arm_msgs/Arm",
            definition="# an arm\nfloat64 x 1.5 # metres\nuint8 LEFT=1\ngeometry_msgs/Point at\n",
        )
    assert said in text
    assert "x: float64 = 1.5" in good


class WithoutPackages:
    """Offers a connection as rclpy does: with the types alone that its machine has installed."""

    def __init__(self, connection: RosbridgeClient) -> None:
        self._connection = connection

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever the connection has
        return getattr(self._connection, name)

    async def fetch_definitions(self, type_name: str) -> Mapping[str, str]:  # noqa: ARG002
        return {}


async def test_a_type_that_the_ros_of_this_machine_lacks_is_to_be_installed(
    tmp_path: Path,
) -> None:
    async with (
        open_rosbridge_server(SteppedRobot(two_rooms()), dialect=Dialect.ROS2) as server,
        open_client(RobotAddress(url=server.url), patience=QUICK) as client,
        served(FakeRobot(), cast("RosConnection", WithoutPackages(client)), tmp_path) as caller,
    ):
        said = await caller.refuse("ros_type", type="nav2_msgs/action/Spin")
    assert "the ROS on this machine does not have it" in said
    assert "sudo apt install ros-$ROS_DISTRO-nav2-msgs" in said
    assert "nearest" not in said
