"""The ROS tools over a ROS that a test has in its hands, with a client connected in memory."""

from collections.abc import AsyncGenerator, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import anyio
import anyio.lowlevel
from mcp.client import Client

from bridging import SteppedRobot
from fakes import FakeRobot, two_rooms
from mapspeak.links.rosbridge import RobotAddress, RosbridgeClient, open_client
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.port import RosConnection
from mapspeak.rosbridge_server import open_rosbridge_server
from mapspeak.safety import Guard
from mapspeak.server.app import build_server
from mapspeak.session import Session
from rosbridge_robot import ScriptedRobot
from rosbridge_script import PATIENCE_S, running
from served import text_of

QUICK = Patience(first_pause_s=0.001, longest_pause_s=0.01, linger_s=0.0, goodbye_s=1.0)
TOOLSETS = ("drive", "ros")


class Caller:
    """Calls tools and gives what they answer."""

    def __init__(self, client: Client) -> None:
        self.client = client

    async def ask(self, tool: str, /, **arguments: Any) -> str:  # noqa: ANN401
        """Gives the text of an answer that is no error."""
        result = await self.client.call_tool(tool, arguments)
        assert not result.is_error, text_of(result)
        return text_of(result)

    async def refuse(self, tool: str, /, **arguments: Any) -> str:  # noqa: ANN401
        """Gives the text of an answer that is an error."""
        result = await self.client.call_tool(tool, arguments)
        assert result.is_error, text_of(result)
        return text_of(result)


@asynccontextmanager
async def served(
    robot: FakeRobot,
    connection: RosConnection | None,
    folder: Path,
    *,
    is_read_only: bool = False,
    guard: Guard | None = None,
    within_s: float = PATIENCE_S,
) -> AsyncGenerator[Caller]:
    """Gives what calls the tools of a robot with that connection; all of it has a time limit."""
    memory = SemanticMapStore(folder / "semantic_map.yaml")
    session = Session(
        robot, memory, lease_s=60.0, guard=guard, ros=connection, find_model=lambda: None
    )
    server = build_server(session, toolsets=TOOLSETS, is_read_only=is_read_only)
    with anyio.fail_after(within_s):
        async with Client(server) as client:
            yield Caller(client)


@asynccontextmanager
async def on_our_server(
    dialect: Dialect, folder: Path, robot: SteppedRobot | None = None
) -> AsyncGenerator[tuple[SteppedRobot, Caller]]:
    """Gives a robot behind our own rosbridge server, and what calls the tools."""
    stepped = robot or SteppedRobot(two_rooms())
    async with (
        open_rosbridge_server(stepped, dialect=dialect) as server,
        open_client(RobotAddress(url=server.url), patience=QUICK) as client,
        served(stepped, client, folder) as caller,
    ):
        yield stepped, caller


@asynccontextmanager
async def on_script(
    scripted: ScriptedRobot, folder: Path, *, patience: Patience = QUICK, guard: Guard | None = None
) -> AsyncGenerator[Caller]:
    """Gives what calls the tools of a robot that does as the test says."""
    async with (
        running(scripted.server) as server,
        open_client(RobotAddress(url=server.url), patience=patience) as client,
        served(FakeRobot(two_rooms()), client, folder, guard=guard) as caller,
    ):
        yield caller


@asynccontextmanager
async def at_time(
    scripted: ScriptedRobot, folder: Path, now_s: float
) -> AsyncGenerator[tuple[RosbridgeClient, Caller]]:
    """Serves a scripted robot whose time stands still."""
    robot = FakeRobot(two_rooms())
    await robot.sleep(now_s)
    async with (
        running(scripted.server) as server,
        open_client(RobotAddress(url=server.url), patience=QUICK) as client,
        served(robot, client, folder) as caller,
    ):
        yield client, caller


@asynccontextmanager
async def publishing(
    scripted: ScriptedRobot, topic: str, *each: Mapping[str, Any]
) -> AsyncGenerator[None]:
    """Publishes messages again and again while the context lasts."""

    async def go_on() -> None:
        await scripted.until(
            lambda: any(ask["topic"] == topic for ask in scripted.server.asked("subscribe"))
        )
        while True:
            for message in each:
                await scripted.publish(topic, message)
            await anyio.lowlevel.checkpoint()

    async with anyio.create_task_group() as tasks:
        tasks.start_soon(go_on)
        yield
        tasks.cancel_scope.cancel()


@asynccontextmanager
async def time_passing(robot: SteppedRobot) -> AsyncGenerator[None]:
    """Lets the robot's time pass while the context lasts."""

    async def go_on() -> None:
        while True:
            await robot.let_pass(0.05)

    async with anyio.create_task_group() as tasks:
        tasks.start_soon(go_on)
        yield
        tasks.cancel_scope.cancel()
