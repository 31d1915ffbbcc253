"""What the detector reported in pictures, and nobody wrote down, has a place."""

import math
import re
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from mcp.client import Client

from fakes import FakeRobot, two_rooms
from guarding import WallClock, make_guard
from mapspeak.geometry import Point, Pose
from mapspeak.memory.episodes.store import memory_folder
from mapspeak.robot import Detection
from remembering import EXTINGUISHER, LADDER
from served import connect, report_of, text_of

pytestmark = pytest.mark.anyio

TOOLSETS = ("look", "places", "drive", "paper", "memory", "explore")
SOUTH = Point(1.0, 0.1)
"""In the south wall of the west room, R2."""


@dataclass
class Visit:
    """A robot that reports things in their true directions, and a client that asks about them."""

    client: Client
    robot: FakeRobot
    clock: WallClock

    async def look(self, x: float, y: float, *things: tuple[str, Point]) -> None:
        """Looks at the first of some things from a place; all are reported."""
        here = Point(x, y)
        self.robot.pose = Pose(x, y, here.bearing_to(things[0][1]) if things else 0.0)
        self.robot.detections = tuple(
            Detection(
                label=label,
                bearing_rad=math.remainder(here.bearing_to(at) - self.robot.pose.yaw_rad, math.tau),
                range_m=here.distance_to(at),
                confidence_ratio=0.9,
            )
            for label, at in things
        )
        # Pictures of one second that are alike share a file.
        self.clock.now += timedelta(seconds=1)
        await self.client.call_tool("look_through_camera", {})

    async def look_at_all(self) -> None:
        """Looks at an extinguisher in the east room, at another one and a box in the west room."""
        person = ("person", Point(5.0, 2.0))
        for x, y in ((4.5, 0.6), (5.5, 2.2), (6.5, 1.0)):
            await self.look(x, y, ("fire extinguisher", EXTINGUISHER), person)
        for x, y in ((1.5, 1.4), (2.5, 0.6)):
            await self.look(x, y, ("first-aid box", LADDER))
        for x, y in ((2.0, 1.5), (2.8, 1.0)):
            await self.look(x, y, ("fire extinguisher", SOUTH))

    async def ask(self, tool: str, **arguments: object) -> str:
        return text_of(await self.client.call_tool(tool, arguments))

    async def report(self, tool: str, **arguments: object) -> dict[str, Any]:
        return report_of(await self.client.call_tool(tool, arguments))

    async def find(self, query: str, **more: object) -> str:
        """Says what is found that is not written down."""
        advice: str = (await self.report("find_place", query=query, **more))["advice"]
        return advice.partition("Look for it with search_for. ")[2]


@asynccontextmanager
async def visiting(folder: Path) -> AsyncGenerator[Visit]:
    robot, clock = FakeRobot(two_rooms()), WallClock()
    guard = make_guard(folder, clock=clock)
    async with connect(robot, folder, toolsets=TOOLSETS, guard=guard) as client:
        yield Visit(client, robot, clock)


async def test_what_was_reported_is_told_with_each_place_and_what_to_call(tmp_path: Path) -> None:
    async with visiting(tmp_path) as visit:
        await visit.look_at_all()
        found = await visit.find("fire extinguishers")
    assert found.startswith(
        'Not written down, but seen: the robot\'s detector reported "fire extinguisher" at '
        "2 places (5 pictures, last "
    )
    near, far = found.partition("): ")[2].split("; ")
    assert " in R2, " in near
    assert near.endswith(" m by path, best in P7")
    assert " in R1, " in far
    for said, true in ((near, SOUTH), (far, EXTINGUISHER)):
        x, y, within_m = map(float, re.findall(r"\d+\.\d+", said)[:3])
        assert Point(x, y).distance_to(true) < within_m < 0.6
    assert far.endswith(
        " by path, best in P2. Nobody has checked that. navigate_to takes "
        "'nearest fire extinguisher', look_at too."
    )


@pytest.mark.parametrize(
    ("words", "label"),
    [
        ("first aid kit", "first-aid box"),
        ("extinguishers", "fire extinguisher"),
        ("tool to put out a fire", "fire extinguisher"),
        ("fire extinguisher in R1", "fire extinguisher"),
    ],
)
async def test_what_was_reported_is_found_by_the_words_for_remembered_things(
    tmp_path: Path, words: str, label: str
) -> None:
    async with visiting(tmp_path) as visit:
        await visit.look_at_all()
        assert f'reported "{label}" at ' in await visit.find(words)


async def test_things_of_several_names_that_may_be_meant_are_told_apart(tmp_path: Path) -> None:
    async with visiting(tmp_path) as visit:
        for x, y in ((4.5, 0.6), (5.5, 2.2)):
            await visit.look(x, y, ("sofa", EXTINGUISHER), ("office chair", Point(7.0, 2.4)))
        found = await visit.find("where can I sit")
    assert re.search(r'reported "[a-z ]+" at 1 place \(2 pictures', found)
    assert re.search(r'\. Also "[a-z ]+" at 1 place \(2 pictures', found)


async def test_where_no_label_fits_those_that_are_there_are_told(tmp_path: Path) -> None:
    async with visiting(tmp_path) as visit:
        assert await visit.find("zebra") == ""
        await visit.look_at_all()
        zebra, person = await visit.find("zebra"), await visit.find("person")
        recalled = await visit.ask("recall_episodes", label="zebra")
    said = 'No label of what was seen fits "zebra"; there are '
    assert zebra == f'{said}"fire extinguisher", "first-aid box".'
    assert recalled.endswith(zebra)
    assert '"person" is' not in person
    assert ', "person"' not in person


async def test_a_later_run_tells_from_where_pictures_of_an_earlier_one_were_taken(
    tmp_path: Path,
) -> None:
    async with visiting(tmp_path) as visit:
        await visit.look_at_all()
    async with visiting(tmp_path) as visit:
        found = await visit.find("first aid kit")
    assert found.startswith(
        'Not written down, but seen: the robot\'s detector reported "first-aid box" in 2 '
        "pictures; where it is was not kept. They are from 2 places, last "
    )


async def test_the_nearest_thing_that_was_only_reported_is_driven_to(tmp_path: Path) -> None:
    async with visiting(tmp_path) as visit:
        await visit.look_at_all()
        drive = await visit.report("navigate_to", place="nearest extinguisher")
        kit = await visit.report("navigate_to", place="first aid kit")
        several = await visit.ask("navigate_to", place="fire extinguisher")
        use = await visit.ask("navigate_to", place="tool to put out a fire")
        forgotten = await visit.ask("forget", what="first-aid box")
    assert "not written down, the robot's detector reported it in P7 P6" in drive["place"]
    assert drive["reason"].endswith(") is 1.0 m from the robot.")
    assert drive["state"] == "arrived"
    assert kit["state"] == "arrived"
    assert several.startswith("2 things that pictures show are called 'fire extinguisher'.")
    assert "or say 'nearest fire extinguisher'" in several
    assert "If that is meant, use 'nearest fire extinguisher'." in use
    assert forgotten.startswith("Nothing is remembered as 'first-aid box'.")


async def test_what_is_written_down_comes_before_what_was_only_reported(tmp_path: Path) -> None:
    async with visiting(tmp_path) as visit:
        await visit.look_at_all()
        await visit.report(
            "write_semantic_data",
            name="corner",
            description="",
            functional_landmarks=[{"label": "fire extinguisher", "bearing_deg": 0, "range_m": 1.0}],
            x=6.0,
            y=1.5,
            yaw_deg=90,
        )
        goal = await visit.report("check_goal", place="nearest fire extinguisher")
    assert "T1 at (" in goal["reason"]


async def test_of_what_is_written_down_no_pictures_of_an_earlier_run_are_told(
    tmp_path: Path,
) -> None:
    async with visiting(tmp_path) as visit:
        await visit.look_at_all()
        for x, y, at in ((6.5, 1.0, EXTINGUISHER), (2.0, 1.5, SOUTH)):
            here = Point(x, y)
            thing = {
                "label": "fire extinguisher",
                "bearing_deg": 0,
                "range_m": here.distance_to(at),
            }
            await visit.report(
                "write_semantic_data",
                name=f"at {x}",
                description="",
                functional_landmarks=[thing],
                x=x,
                y=y,
                yaw_deg=math.degrees(here.bearing_to(at)),
            )
        advice = (await visit.report("find_place", query="tool for a fire"))["advice"]
    assert "The likeliest is T" in advice
    assert "Not written down" not in advice


async def test_a_lone_far_picture_that_the_map_contradicts_gives_no_place(tmp_path: Path) -> None:
    async with visiting(tmp_path) as visit:
        await visit.look(1.5, 0.5, ("ladder", Point(7.4, 0.5)))
        assert 'reported "ladder" in 1 picture; where it is was not kept' in await visit.find(
            "ladder"
        )


async def test_a_search_that_found_the_thing_says_where_it_is(tmp_path: Path) -> None:
    async with visiting(tmp_path) as visit:
        await visit.look_at_all()
        await visit.look(5.0, 1.0, ("fire extinguisher", EXTINGUISHER))
        await visit.report("search_for", thing="extinguisher")
        found = await visit.report("search_for", thing="extinguisher", seen=True)
    assert found["state"] == "found"
    assert "It is at 7.5" in found["reason"]
    assert found["reason"].endswith("m straight, ahead of it.")
    assert found["next_step"].startswith("look_at takes 7.5")
    assert not found.get("next")


async def test_a_thing_that_only_the_model_saw_is_told_by_its_picture(tmp_path: Path) -> None:
    async with visiting(tmp_path) as visit:
        await visit.look(5.0, 1.0)
        await visit.report("search_for", thing="red button")
        found = await visit.report("search_for", thing="red button", seen=True)
    assert ", taken at x " in found["reason"]
    assert found["reason"].endswith("; its place is not known.")
    assert "write_semantic_data with its column in P" in found["next_step"]


async def test_observations_are_recalled_by_another_name_of_what_they_show(tmp_path: Path) -> None:
    async with visiting(tmp_path) as visit:
        await visit.look_at_all()
        kits = await visit.ask("recall_episodes", label="first aid kits")
        shown = await visit.ask("recall_episodes", picture_of="P4")
    assert kits.startswith("2 observations;")
    assert shown.startswith("P4: picture at ")
    assert 'saw "first-aid box"' in shown


async def test_where_a_thing_was_seen_is_its_own_room_and_near_is_near_to_it(
    tmp_path: Path,
) -> None:
    cone = Point(6.9, 2.3)
    async with visiting(tmp_path) as visit:
        for x, y in ((2.6, 1.3), (2.9, 1.4)):
            await visit.look(x, y, ("fire extinguisher", EXTINGUISHER), ("cone", cone))
        for _ in range(5):
            await visit.look(2.0, 1.0, ("poster", Point(20.0, 20.0)))
        told = await visit.ask("recall_episodes")
        near = await visit.ask("recall_episodes", near_seen="extinguisher", radius_m=2)
    async with visiting(tmp_path) as visit:
        later = await visit.ask("recall_episodes", near_seen="extinguisher")
    assert "Near to where this was made, not to what it shows: o" in later
    last = next(line for line in told.splitlines() if line.startswith("By label: "))
    assert room_said(last, "fire extinguisher") == room_said(last, "cone") == "in R1"
    assert room_said(last, "poster") == "from R2"
    assert "Things nearest to it: " in near
    assert '"cone" in R1, in P' in near


def room_said(line: str, label: str) -> str:
    """Return the room with which the summary names a label."""
    return " ".join(line.partition(f'"{label}" ')[2].partition(";")[0].strip(".").split()[-2:])


async def test_a_room_tells_what_pictures_show_in_it(tmp_path: Path) -> None:
    async with visiting(tmp_path) as visit:
        await visit.look_at_all()
        west = await visit.ask("describe_place", place="R2")
        east = await visit.ask("describe_place", place="R1")
    said = "In pictures the robot's detector reported in it, by place: "
    assert f'{said}"fire extinguisher" 1, "first-aid box" 1.' in west
    assert f'{said}"fire extinguisher" 1.' in east


async def test_nothing_of_it_is_stored(tmp_path: Path) -> None:
    async with visiting(tmp_path) as visit:
        await visit.look_at_all()
        await visit.find("fire extinguisher")
        await visit.ask("navigate_to", place="nearest fire extinguisher")
    memory = tmp_path / "semantic_map.yaml"
    assert not memory.exists() or "extinguisher" not in memory.read_text()
    assert memory_folder(memory).is_dir()
