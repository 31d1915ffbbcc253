"""A robot whose services, topics and actions a test puts up, exposed as tools of a client."""

from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import asynccontextmanager
from pathlib import Path

import anyio
from mcp.client import Client
from mcp.client.session import MessageHandlerFnT
from mcp_types import Tool

from fakes import FakeRobot, two_rooms
from mapspeak.links.rosbridge import RobotAddress, open_client
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import Robot
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.port import RosConnection
from mapspeak.rosbridge_server.hub import Hub, Topic
from mapspeak.rosbridge_server.interfaces import Interfaces, RosSystem
from mapspeak.rosbridge_server.rosapi import Parameters, add_rosapi
from mapspeak.rosbridge_server.serving import serve_system
from mapspeak.safety import Guard
from mapspeak.server.app import MapspeakServer, build_server
from mapspeak.session import Session
from mapspeak.skills.skillsfile import OwnersEntry
from rosbridge_script import PATIENCE_S
from rosserved import QUICK, Caller

NODE = "/tool_driver"


class Watched(Caller):
    """Calls tools, and hears when their list changes."""

    def __init__(self, client: Client, server: MapspeakServer) -> None:
        super().__init__(client)
        self.server = server

    async def tools(self) -> dict[str, Tool]:
        return {tool.name: tool for tool in (await self.client.list_tools()).tools}

    async def until(self, is_so: Callable[[dict[str, Tool]], object]) -> dict[str, Tool]:
        """Has the robot looked at again and again until its tools are as wanted."""
        exposure = self.server.exposure
        while not is_so(tools := await self.tools()):
            if exposure is not None:
                exposure.forget()
                await exposure.look()
        return tools


def tool_system(dialect: Dialect, *topics: Topic, more: dict[str, str] | None = None) -> RosSystem:
    """Gives a ROS with these topics and with rosapi; services are offered by the test."""
    interfaces = Interfaces(dialect, more=more or {})
    system = RosSystem(Hub(list(topics)), interfaces, dialect=dialect)
    add_rosapi(system, Parameters(dialect, {}), lambda: 100.0)
    return system


@asynccontextmanager
async def watched(
    robot: Robot,
    connection: RosConnection | None,
    folder: Path,
    *,
    expose: tuple[str, ...] = ("/tool/*",),
    guard: Guard | None = None,
    is_read_only: bool = False,
    mode: str = "auto",
    on_message: MessageHandlerFnT | None = None,
    skills: Sequence[OwnersEntry] = (),
    toolsets: tuple[str, ...] = ("drive", "missions"),
) -> AsyncGenerator[Watched]:
    """Gives a client of a server whose skills are kept."""
    memory = SemanticMapStore(folder / "semantic_map.yaml")
    session = Session(
        robot, memory, lease_s=60.0, guard=guard, ros=connection, find_model=lambda: None
    )
    server = build_server(
        session,
        toolsets=toolsets,
        expose=expose,
        is_read_only=is_read_only,
        skills=skills,
    )
    with anyio.fail_after(PATIENCE_S):
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(server.keep_skills)
            async with Client(server, mode=mode, message_handler=on_message) as client:
                yield Watched(client, server)
            tasks.cancel_scope.cancel()


@asynccontextmanager
async def exposed(
    system: RosSystem,
    folder: Path,
    *,
    expose: tuple[str, ...] = ("/tool/*",),
    guard: Guard | None = None,
    is_read_only: bool = False,
    mode: str = "auto",
    on_message: MessageHandlerFnT | None = None,
    skills: Sequence[OwnersEntry] = (),
) -> AsyncGenerator[Watched]:
    """Gives what calls the tools that a system's names are."""
    async with (
        serve_system(system) as server,
        open_client(RobotAddress(url=server.url), patience=QUICK) as client,
        watched(
            FakeRobot(two_rooms()),
            client,
            folder,
            expose=expose,
            guard=guard,
            is_read_only=is_read_only,
            mode=mode,
            on_message=on_message,
            skills=skills,
        ) as caller,
    ):
        yield caller
