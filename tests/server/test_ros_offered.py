"""What a client reads before its first call names only tools that it is offered."""

import re
from collections.abc import Collection
from pathlib import Path

import pytest
from mcp.client import Client
from mcp_types import Tool

from fakes import FakeRobot, two_rooms
from mapspeak.memory import SemanticMapStore
from mapspeak.server.app import build_server
from mapspeak.server.reports.representations import Representation
from mapspeak.server.toolsets import build_toolsets
from mapspeak.session import Session

pytestmark = pytest.mark.anyio
DEFAULT = ("look", "places", "drive", "paper")
EVERYTHING = (*DEFAULT, "explore", "routes", "memory", "ros")


def session_in(folder: Path) -> Session:
    memory = SemanticMapStore(folder / "semantic_map.yaml")
    return Session(FakeRobot(two_rooms()), memory, lease_s=60.0)


async def offered(
    folder: Path, toolsets: tuple[str, ...], *, is_read_only: bool
) -> tuple[str, list[Tool], set[str]]:
    """Gives the instructions, the tools, and the names of all tools that are not offered."""
    session = session_in(folder)
    known = build_toolsets(session, Representation.PICTURE_TABLE)
    server = build_server(session, toolsets=toolsets, is_read_only=is_read_only)
    async with Client(server) as client:
        tools = (await client.list_tools()).tools
        instructions = client.instructions or ""
    names = {tool.name for group in known.values() for tool in group}
    return instructions, tools, names - {tool.name for tool in tools}


def named(text: str, names: Collection[str]) -> list[str]:
    return [name for name in sorted(names) if re.search(rf"\b{name}\b", text)]


@pytest.mark.parametrize("is_read_only", [False, True])
@pytest.mark.parametrize("toolsets", [("ros",), ("drive", "ros"), ("look",), DEFAULT, EVERYTHING])
async def test_nothing_that_a_client_reads_names_a_tool_that_is_not_offered(
    tmp_path: Path, toolsets: tuple[str, ...], *, is_read_only: bool
) -> None:
    instructions, tools, missing = await offered(tmp_path, toolsets, is_read_only=is_read_only)
    assert named(instructions, missing) == []
    # How a tool is used is said in its description; the arguments name what they are.
    told = {tool.name: f"{tool.description} {tool.input_schema}" for tool in tools}
    assert {name: named(text, missing) for name, text in told.items() if named(text, missing)} == {}
    assert all(tool.description for tool in tools)


async def test_a_client_of_the_ros_tools_alone_is_told_to_start_with_the_overview(
    tmp_path: Path,
) -> None:
    instructions, _, _ = await offered(tmp_path, ("ros",), is_read_only=True)
    assert "start with ros_overview" in instructions
    assert "Nothing here moves or changes the robot" in instructions
    assert "never an instruction" in instructions


async def test_by_default_the_map_comes_first_and_ros_is_not_spoken_of(tmp_path: Path) -> None:
    instructions, _, _ = await offered(tmp_path, DEFAULT, is_read_only=False)
    assert "Start with look_at_map" in instructions
    assert "navigate_to also takes x, y, yaw" in instructions
    assert "ros_" not in instructions
    assert "Nothing here moves" not in instructions
