"""Closures that are noted, overlap and end: what is told of the drive and of one another."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from drawing import grid_from_text
from fakes import FakeRobot, two_rooms
from guarding import WallClock, make_guard
from mapspeak.geometry import Pose
from served import connect, report_of, text_of

pytestmark = pytest.mark.anyio

TOOLSETS = ("places", "drive", "memory")
HALL = grid_from_text(
    """
    ############################################
    #..........................................#
    #..........................................#
    #..........................................#
    #..........................................#
    #..........................................#
    #..........................................#
    #..........................................#
    #..........................................#
    #..........................................#
    #..........................................#
    #..........................................#
    ############################################
    """,
    resolution_m=0.25,
)
WEST = Pose(1.5, 1.6)
DRIVE = {"x": 9.5, "y": 1.6, "wait_s": 1}


async def test_a_closure_on_the_way_of_a_drive_names_it_and_the_drive_arrives(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(HALL, pose=WEST)
    async with connect(robot, tmp_path, toolsets=TOOLSETS, guard=make_guard(tmp_path)) as client:
        await client.call_tool("navigate_to", DRIVE)
        spill = {"text": "spill", "place": "5.5, 1.6", "effect": "closed"}
        noted = text_of(await client.call_tool("note_event", spill))
        ended = report_of(await client.call_tool("wait_for_goal", {"wait_s": 25}))
    assert "G1 to" in noted
    assert "is led round it" in noted
    assert ended["state"] == "arrived"


@pytest.mark.parametrize(
    ("place", "said"), [("9.5, 1.6", "its goal lies there"), ("5.5, 2.7", ""), ("10.5, 1.6", "")]
)
async def test_a_closure_elsewhere_names_a_drive_only_where_its_goal_lies_in_it(
    tmp_path: Path, place: str, said: str
) -> None:
    robot = FakeRobot(HALL, pose=WEST)
    async with connect(robot, tmp_path, toolsets=TOOLSETS, guard=make_guard(tmp_path)) as client:
        await client.call_tool("navigate_to", DRIVE)
        spill = {"text": "spill", "place": place, "effect": "closed"}
        noted = text_of(await client.call_tool("note_event", spill))
    assert ("G1" in noted) == bool(said)
    assert said in noted


async def test_a_second_closure_of_a_place_is_told_when_noted_and_when_the_first_ends(
    tmp_path: Path,
) -> None:
    guard = make_guard(tmp_path)
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=TOOLSETS, guard=guard) as client:
        shut = {"text": "locked", "place": "D1", "effect": "closed"}
        first = text_of(await client.call_tool("note_event", shut))
        second = text_of(await client.call_tool("note_event", shut))
        ended = text_of(await client.call_tool("end_event", {"event": "E1"}))
        rest = text_of(await client.call_tool("end_event", {"event": "E2"}))
    assert "too" not in first
    assert "Closed there, too: the area 'D1', closed by event E1." in second
    assert "closed by event E2" in ended
    assert "closed by" not in rest


@pytest.mark.parametrize("later_s", [0.0, 0.4, 2.0])
async def test_an_event_that_begins_now_can_be_ended_at_once(
    tmp_path: Path, later_s: float
) -> None:
    clock = WallClock(datetime(2026, 11, 23, 12, 0, 5, 300_000, tzinfo=UTC))
    guard = make_guard(tmp_path, clock=clock)
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=TOOLSETS, guard=guard) as client:
        shut = {"text": "closed", "place": "D1", "effect": "closed", "begins": "now"}
        await client.call_tool("note_event", {**shut, "ends": "1 hour"})
        clock.now += timedelta(seconds=later_s)
        ended = await client.call_tool("end_event", {"event": "E1"})
        check = report_of(await client.call_tool("check_goal", {"place": "R1"}))
    assert not ended.is_error, text_of(ended)
    assert "closed" not in check["reason"]


async def test_today_ends_at_the_end_of_today(tmp_path: Path) -> None:
    guard = make_guard(tmp_path)
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=TOOLSETS, guard=guard) as client:
        shut = {"text": "closed", "place": "D1", "effect": "closed", "ends": "today"}
        noted = text_of(await client.call_tool("note_event", shut))
    assert "until 2026-11-24 00:00" in noted
