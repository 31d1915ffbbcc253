"""An id whose floor is something else by now says so before anything else."""

from collections.abc import AsyncGenerator
from pathlib import Path
from typing import Any

import pytest
from mcp.client import Client

from drawing import grid_from_text
from fakes import FakeRobot
from guarding import make_guard
from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from served import connect, report_of, text_of

pytestmark = pytest.mark.anyio

TOOLSETS = ("look", "places", "drive", "routes", "memory", "paper")
SAID = "C1 is called R1 now: it was taken for a corridor and is a room."


def _strip_then_hall() -> tuple[OccupancyGrid, OccupancyGrid]:
    """Return a map on which only a strip of a hall is known, and one with all of it."""
    wall, strip = "#" * 46, "#" + "." * 44 + "#"
    gap, room = "#" * 20 + "..." + "#" * 23, " " * 10 + "#" + "." * 22 + "#" + " " * 12
    end = " " * 10 + "#" * 24 + " " * 12
    first = [wall, *[strip] * 6, gap, *[room] * 10, end]
    return _draw(first), _draw([wall, *[strip] * 17, wall])


def _draw(lines: list[str]) -> OccupancyGrid:
    return grid_from_text("\n".join(lines), resolution_m=0.25)


@pytest.fixture(name="client")
async def _client(tmp_path: Path) -> AsyncGenerator[Client]:
    strip, hall = _strip_then_hall()
    robot = FakeRobot(strip, pose=Pose(2.0, 4.0))
    guard = make_guard(tmp_path)
    async with connect(robot, tmp_path, toolsets=TOOLSETS, guard=guard) as client:
        seen = text_of(await client.call_tool("describe_place", {"place": "C1"}))
        assert seen.startswith("C1 is a corridor")
        robot.grid = hall
        await client.call_tool("look_at_map", {})
        yield client


@pytest.mark.parametrize(
    ("tool", "arguments"),
    [
        ("describe_place", {"place": "C1"}),
        ("measure", {"places": ["2, 3"], "start": "c1"}),
        ("measure", {"places": ["the middle of C1"]}),
        ("look_at_map", {"around": "C1"}),
        ("check_goal", {"place": "C1"}),
        ("navigate_to", {"place": "C1"}),
        ("follow_route", {"stops": ["C1"]}),
        ("find_place", {"query": "sink", "room": "C1"}),
    ],
)
async def test_an_id_that_is_called_otherwise_now_is_told_first(
    client: Client, tool: str, arguments: dict[str, Any]
) -> None:
    answer = await client.call_tool(tool, arguments)
    assert not answer.is_error
    assert text_of(answer).startswith(SAID)


async def test_a_refusal_says_it_too(client: Client) -> None:
    answer = await client.call_tool("check_goal", {"place": "9 m west of C1"})
    assert answer.is_error
    assert text_of(answer).startswith(SAID)


async def test_what_would_change_something_is_asked_back(client: Client) -> None:
    closing = {"text": "wet floor", "effect": "avoid", "place": "C1"}
    answer = await client.call_tool("note_event", closing)
    assert answer.is_error
    assert text_of(answer) == f"{SAID} Nothing was changed; say R1 where that is meant."
    assert not (await client.call_tool("note_event", {**closing, "place": "R1"})).is_error


async def test_an_id_that_holds_is_not_talked_about(client: Client) -> None:
    answer = await client.call_tool("check_goal", {"place": "R1"})
    assert report_of(answer)["place"] == "R1"
    assert "is called" not in text_of(answer)
