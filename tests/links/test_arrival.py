"""A robot that comes later than its server: what is told meanwhile, and that it is found."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path

import anyio
import pytest
from mcp.client import Client

from bridging import SteppedRobot
from fakes import two_rooms
from guarding import make_guard
from mapspeak.errors import ConfigError
from mapspeak.links.arrival import Arrival
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server import open_rosbridge_server
from mapspeak.server.app import build_server
from mapspeak.session import Session
from rosbridge_robot import eventually
from rosbridge_script import PATIENCE_S
from rosserved import time_passing
from served import text_of

pytestmark = pytest.mark.anyio

NOBODY = "ws://127.0.0.1:1"
TOOLSETS = ("look", "places", "drive", "explore", "routes", "paper", "memory", "ros")


class Desk:
    """A server whose robot is wherever `url` says at the moment."""

    def __init__(self) -> None:
        self.url = NOBODY
        self.arrival = Arrival(
            lambda: open_rosbridge_robot(self.url, patience=Patience(settling_s=0.0))
        )

    @asynccontextmanager
    async def client(self, folder: Path) -> AsyncGenerator[Client]:
        guard = make_guard(folder)
        memory = SemanticMapStore(folder / "semantic_map.yaml")
        session = Session(
            self.arrival.robot,
            memory,
            lease_s=60.0,
            guard=guard,
            ros=self.arrival.connection,
            find_model=lambda: None,
        )
        server = build_server(session, toolsets=TOOLSETS)
        with anyio.fail_after(PATIENCE_S):
            async with anyio.create_task_group() as tasks:
                tasks.start_soon(self.arrival.keep_looking)
                async with Client(server) as client:
                    yield client
                tasks.cancel_scope.cancel()


async def test_a_server_whose_robot_is_not_there_lists_its_tools(tmp_path: Path) -> None:
    async with Desk().client(tmp_path) as client:
        names = {tool.name for tool in (await client.list_tools()).tools}
    assert {"look_at_map", "navigate_to", "stop_robot", "ros_topics"} <= names


@pytest.mark.parametrize(
    ("tool", "arguments"),
    [
        ("look_at_map", {}),
        ("look_through_camera", {}),
        ("get_robot_pose", {}),
        ("navigate_to", {"x": 1.0, "y": 1.0}),
        ("check_goal", {"place": "R1"}),
        ("explore", {}),
        ("turn", {"by_deg": 90.0}),
        ("draw_robot_pose", {}),
        ("write_semantic_data", {"name": "dock", "description": "a dock"}),
        ("ros_overview", {}),
        ("ros_read", {"topic": "/map"}),
        ("ros_publish", {"topic": "/cmd_vel", "fields": {}, "type": "geometry_msgs/msg/Twist"}),
        ("ros_send_goal", {"action": "/dance", "fields": {}, "type": "shows/action/Dance"}),
    ],
)
async def test_a_tool_that_needs_the_robot_says_why_it_is_not_there_and_what_to_do(
    tmp_path: Path, tool: str, arguments: dict[str, object]
) -> None:
    async with Desk().client(tmp_path) as client:
        answer = await client.call_tool(tool, arguments)
    said = text_of(answer)
    assert answer.is_error, said
    assert "The robot is not there yet" in said
    assert "rosbridge_websocket_launch.xml" in said
    assert "nothing has to be started again" in said


async def test_a_stop_without_a_robot_says_that_nothing_was_stopped(tmp_path: Path) -> None:
    async with Desk().client(tmp_path) as client:
        answer = await client.call_tool("stop_robot", {})
    assert answer.is_error
    assert "NOT STOPPED: The robot is not there yet" in text_of(answer)


async def test_what_is_remembered_can_be_read_without_a_robot(tmp_path: Path) -> None:
    async with Desk().client(tmp_path) as client:
        answer = await client.call_tool("get_semantic_data", {})
    assert not answer.is_error


async def test_a_robot_that_comes_is_used_without_a_restart(tmp_path: Path) -> None:
    desk = Desk()
    robot = SteppedRobot(two_rooms())
    async with desk.client(tmp_path) as client:
        assert (await client.call_tool("look_at_map", {})).is_error
        async with (
            open_rosbridge_server(robot, dialect=Dialect.ROS2) as server,
            time_passing(robot),
        ):
            desk.url = server.url

            async def shows_the_map() -> bool:
                return not (await client.call_tool("look_at_map", {})).is_error

            await eventually(shows_the_map)
            assert not (await client.call_tool("stop_robot", {})).is_error
            topics = await client.call_tool("ros_topics", {})
    assert "/map" in text_of(topics)


async def test_what_can_never_work_ends_the_server_as_before() -> None:
    arrival = Arrival(lambda: open_rosbridge_robot("no address"))
    with pytest.raises(ConfigError, match="no address"):
        await arrival.keep_looking()
