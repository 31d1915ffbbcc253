"""The workplace of a trial that inspects a ROS: it is played on a port, and served read-only."""

import math
import sys
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from mcp.client import Client
from mcp.client.stdio import StdioServerParameters

from mapspeak.evaluation.inspected import InspectedSystem, play
from mapspeak.evaluation.trials import ServerAccess
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.memory import SemanticMapStore
from mapspeak.server.app import build_server
from mapspeak.session import Session

ANSWER_WITHIN_S = 120.0
MEMORY = "semantic_map.yaml"


@dataclass(frozen=True, slots=True, kw_only=True)
class Inspection:
    """A server that is connected to a played ROS.

    Attributes:
        client: To it; None where the agent starts the server itself.
        instructions: What it tells any model first.
        command: Its command line.
    """

    client: Client | None
    instructions: str
    command: tuple[str, ...]


@asynccontextmanager
async def open_inspection(
    system: InspectedSystem, connection: ServerAccess, *, toolsets: tuple[str, ...], folder: Path
) -> AsyncGenerator[Inspection]:
    """Play a system and connect to it as an agent wants it, read-only.

    Args:
        system: What is played, for as long as the context lasts.
        connection: How the agent reaches the server.
        toolsets: Groups of tools to offer.
        folder: Where the server keeps what it writes.
    """
    async with play(system) as url:
        command = serve_command(url, toolsets=toolsets, folder=folder)
        if connection is ServerAccess.MEMORY:
            async with _open_in_memory(url, toolsets, folder) as client:
                yield _describe(client, command)
        elif connection is ServerAccess.STDIO:
            parameters = StdioServerParameters(command=command[0], args=list(command[1:]))
            async with Client(parameters, read_timeout_seconds=ANSWER_WITHIN_S) as client:
                yield _describe(client, command)
        else:
            yield _describe(None, command)


def _describe(client: Client | None, command: tuple[str, ...]) -> Inspection:
    instructions = "" if client is None else client.instructions or ""
    return Inspection(client=client, instructions=instructions, command=command)


def serve_command(url: str, *, toolsets: tuple[str, ...], folder: Path) -> tuple[str, ...]:
    """Return the command line of a read-only server for the ROS behind a rosbridge."""
    return (
        *(sys.executable, "-m", "mapspeak", "serve", "--robot", url, "--read-only"),
        *("--toolsets", ",".join(toolsets)),
        *("--memory", str(folder / MEMORY)),
        *("--audit", str(folder / "audit.jsonl")),
        *("--control", str(folder / "control")),
    )


@asynccontextmanager
async def _open_in_memory(
    url: str, toolsets: tuple[str, ...], folder: Path
) -> AsyncGenerator[Client]:
    async with open_rosbridge_robot(url) as robot:
        session = Session(
            robot, SemanticMapStore(folder / MEMORY), lease_s=math.inf, ros=robot.connection
        )
        server = build_server(session, toolsets=toolsets, is_read_only=True)
        async with Client(server, read_timeout_seconds=ANSWER_WITHIN_S) as client:
            yield client
