"""A server that runs for weeks, and is read by one client after the other."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from fakes import FakeRobot, two_rooms
from mapspeak.memory import SemanticMapStore
from mapspeak.server.tools.look import MOST_READERS, LookTools
from mapspeak.session import Session

pytestmark = pytest.mark.anyio


async def test_only_the_latest_readers_of_the_map_are_told_what_is_new_alone(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    tools = LookTools(Session(robot, SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0))

    async def look(client: str) -> str:
        context = cast("Any", SimpleNamespace(headers={"mcp-session-id": client}))
        text, *_ = await tools.look_at_map(context)
        return str(text)

    first = await look("first")
    again = await look("first")
    assert len(again) < len(first)
    for number in range(MOST_READERS - 1):
        await look(f"client {number}")
    assert await look("first") == again
    for number in range(MOST_READERS):
        await look(f"client {number}")
    assert await look("first") == first
