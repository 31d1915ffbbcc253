"""A server over a fake robot, with a client connected to it in memory."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import anyio
from mcp.client import Client
from mcp.client.session import ElicitationFnT
from mcp_types import CallToolResult, ImageContent, TextContent

from mapspeak.memory import MemoryStore, SemanticMapStore
from mapspeak.robot import Robot
from mapspeak.safety import Guard
from mapspeak.server.app import DEFAULT_TOOLSETS, build_server
from mapspeak.server.reports.representations import Representation
from mapspeak.server.wire.calllog import CallLog
from mapspeak.session import Session

MODES = ("auto", "legacy")


@asynccontextmanager
async def connect(
    robot: Robot,
    folder: Path,
    *,
    mode: str = "auto",
    toolsets: tuple[str, ...] = DEFAULT_TOOLSETS,
    tools: tuple[str, ...] = (),
    is_read_only: bool = False,
    guard: Guard | None = None,
    on_question: ElicitationFnT | None = None,
    representation: Representation = Representation.PICTURE_TABLE,
    call_log: CallLog | None = None,
    memory: MemoryStore | None = None,
) -> AsyncGenerator[Client]:
    """Gives a client of a server over that robot, with its memory in that folder."""
    map_name = robot.description.map_name
    memory = memory or SemanticMapStore(folder / "semantic_map.yaml", map_id=map_name)
    session = Session(robot, memory, lease_s=60.0, guard=guard, find_model=lambda: None)
    server = build_server(
        session,
        toolsets=toolsets,
        tools=tools,
        is_read_only=is_read_only,
        representation=representation,
        call_log=call_log,
    )
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(server.keep_skills)
        async with Client(server, mode=mode, elicitation_callback=on_question) as client:
            yield client
        tasks.cancel_scope.cancel()


def text_of(result: CallToolResult) -> str:
    """Gives all text of an answer."""
    return "\n".join(part.text for part in result.content if isinstance(part, TextContent))


def pictures_of(result: CallToolResult) -> list[ImageContent]:
    """Gives all pictures of an answer."""
    return [part for part in result.content if isinstance(part, ImageContent)]


def report_of(result: CallToolResult) -> dict[str, Any]:
    """Gives the structured part of an answer that is no error."""
    assert not result.is_error, text_of(result)
    assert result.structured_content is not None
    return dict(result.structured_content)
