"""A server that runs for weeks, and is read by one client after the other."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from fakes import FakeRobot, two_rooms
from mapspeak.memory import SemanticMapStore
from mapspeak.server.tools.look import MOST_READERS, LookTools
from mapspeak.session import Session

pytestmark = pytest.mark.anyio


def look_tools(folder: Path) -> LookTools:
    store = SemanticMapStore(folder / "m.yaml")
    return LookTools(Session(FakeRobot(two_rooms()), store, lease_s=60.0))


def context_of(client: str) -> Any:  # noqa: ANN401 - the SDK's context, as far as it is read
    return SimpleNamespace(headers={"mcp-session-id": client})


async def test_only_the_latest_readers_of_the_map_are_told_what_is_new_alone(
    tmp_path: Path,
) -> None:
    tools = look_tools(tmp_path)

    async def look(client: str) -> str:
        text, *_ = await tools.look_at_map(context_of(client))
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


async def test_only_the_latest_readers_of_pictures_are_told_short_captions(tmp_path: Path) -> None:
    tools = look_tools(tmp_path)

    async def has_size(client: str) -> bool:
        text, _ = await tools.look_through_camera(context_of(client))
        return " px" in str(text)

    assert await has_size("first")
    assert not await has_size("first")
    for number in range(MOST_READERS):
        assert await has_size(f"client {number}")
    assert await has_size("first")
