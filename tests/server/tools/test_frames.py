"""Memories that belong to other maps than the robot's, through the server's tools."""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from mcp.client import Client

from alignment_maps import HOUSE, OTHER_HOUSE, fine, moved
from fakes import FakeRobot
from guarding import MONDAY_NOON, WallClock, make_guard
from mapspeak.geometry import Point, Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.spatial import OccupancyGrid
from served import connect, report_of, text_of

pytestmark = pytest.mark.anyio

TOOLSETS = ("look", "places", "drive", "explore", "routes", "paper", "memory")
MAP = fine(HOUSE)
IN_HOUSE = Pose(3.0, 4.5, 0.0)
IN_OTHER = Pose(3.0, 7.0, 0.0)
SINK, TAP = Point(12.0, 4.5), Point(17.0, 4.5)
MOTION = Pose(3.0, -1.0, math.radians(70))
FILE = "semantic_map.yaml"
STILL = Pose(0.0, 0.0)


def record(name: str, pose: Pose, label: str, thing: Point) -> dict[str, Any]:
    """A record that names one thing in its true direction and distance."""
    bearing_deg = math.degrees(pose.point.bearing_to(thing) - pose.yaw_rad)
    range_m = pose.point.distance_to(thing)
    return {
        "name": name,
        "description": "",
        "functional_landmarks": [{"label": label, "bearing_deg": bearing_deg, "range_m": range_m}],
        "x": pose.x,
        "y": pose.y,
        "yaw_deg": math.degrees(pose.yaw_rad),
    }


def looks_at(label: str, thing: Point, *, motion: Pose = STILL) -> list[dict[str, Any]]:
    """Two records of a thing in the house, whose map lies elsewhere by a motion."""
    spots = (Pose(thing.x - 2.0, thing.y - 0.5), Pose(thing.x + 1.5, thing.y + 0.5))
    there = motion.transform(thing)
    return [
        record(f"{label} {number}", motion @ spot, label, there)
        for number, spot in enumerate(spots, start=1)
    ]


async def remember(client: Client, records: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    return [report_of(await client.call_tool("write_semantic_data", each)) for each in records]


async def put_on(client: Client, robot: FakeRobot, grid: OccupancyGrid, pose: Pose) -> None:
    """Let the robot begin a new map, and its server see it."""
    robot.grid, robot.pose = grid, pose
    await client.call_tool("look_at_map", {})


async def ask(client: Client, words: str) -> dict[str, Any]:
    return report_of(await client.call_tool("find_place", {"query": words}))


@pytest.mark.parametrize(
    ("grid", "pose"),
    [(fine(OTHER_HOUSE), IN_OTHER), (moved(MAP, MOTION), MOTION @ IN_HOUSE)],
    ids=["another building", "moved map"],
)
async def test_what_is_remembered_on_another_map_is_never_found_nor_driven_to(
    tmp_path: Path, grid: OccupancyGrid, pose: Pose
) -> None:
    robot = FakeRobot(MAP, pose=IN_HOUSE)
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await remember(client, looks_at("sink", SINK))
        known = await ask(client, "sink")
    robot.grid, robot.pose = grid, pose
    guard = make_guard(tmp_path / "guard", clock=WallClock(MONDAY_NOON))
    async with connect(robot, tmp_path, toolsets=TOOLSETS, guard=guard) as client:
        answer = await ask(client, "sink")
        calls: list[tuple[str, dict[str, Any]]] = [
            ("navigate_to", {"place": "sink"}),
            ("navigate_to", {"place": "sink 1"}),
            ("navigate_to", {"place": "left of sink 1"}),
            ("check_goal", {"place": "sink 1"}),
            ("describe_place", {"place": "sink 1"}),
            ("measure", {"places": ["sink 1", "robot"]}),
            ("follow_route", {"stops": ["sink 1"]}),
            ("find_place", {"query": "tap", "near": "sink 1"}),
            ("get_semantic_data", {"name": "sink 1"}),
            ("look_at_map", {"around": "sink 1"}),
            ("recall_episodes", {"near": "sink 1"}),
            ("note_event", {"text": "wet floor", "place": "sink 1", "effect": "slow"}),
        ]
        refused = [(name, await client.call_tool(name, said)) for name, said in calls]
        by_id = await client.call_tool("navigate_to", {"place": known["candidates"][0]["id"]})
        looked = text_of(await client.call_tool("look_at_map", {}))
    assert known["verdict"] == "found"
    assert answer["verdict"] == "not_remembered"
    assert not answer["candidates"]
    assert "another map" in answer["advice"]
    assert by_id.is_error
    for name, result in refused:
        assert result.is_error, name
        assert "another map" in text_of(result), (name, text_of(result))
    assert "another map" in looked


async def test_what_was_written_before_and_after_a_realign_lies_where_it_is(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(MAP, pose=IN_HOUSE)
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await remember(client, looks_at("sink", SINK))
        await put_on(client, robot, moved(MAP, MOTION), MOTION @ IN_HOUSE)
        await remember(client, looks_at("tap", TAP, motion=MOTION))
        between = await ask(client, "sink")
        tap = await ask(client, "tap")
        before = (tmp_path / FILE).read_text()
        report = text_of(await client.call_tool("realign_memory", {}))
        after = (tmp_path / FILE).read_text()
        sink, tap_again = await ask(client, "sink"), await ask(client, "tap")
        await remember(client, looks_at("valve", Point(3.0, 2.0), motion=MOTION))
        valve = await ask(client, "valve")
        await client.call_tool("navigate_to", {"place": "sink 1", "wait_s": 0})
    assert between["verdict"] == "not_remembered"
    assert "realign" not in report or "sure" in report
    for answer, thing in ((sink, SINK), (tap, TAP), (tap_again, TAP), (valve, Point(3.0, 2.0))):
        assert answer["verdict"] in ("found", "likely")
        there = MOTION.transform(thing)
        position = answer["candidates"][0]["position"]
        assert math.dist(position, (there.x, there.y)) < 0.3
    assert before.partition("waypoints:")[2] == after.partition("waypoints:")[2]
    assert _off_m(tmp_path, "sink 1", Pose(SINK.x - 2.0, SINK.y - 0.5)) < 0.001


async def test_a_name_of_another_map_is_kept_apart(tmp_path: Path) -> None:
    robot = FakeRobot(MAP, pose=IN_HOUSE)
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await remember(client, [record("kitchen", Pose(10.0, 4.5), "sink", SINK)])
        await put_on(client, robot, fine(OTHER_HOUSE), IN_OTHER)
        note = record("kitchen", IN_OTHER, "oven", Point(5.0, 7.0))
        await remember(client, [note])
        await remember(client, [note])
        oven = await ask(client, "oven")
    memory = SemanticMapStore(tmp_path / FILE).read()
    labels = {each.name: [thing.label for thing in each.landmarks] for each in memory.waypoints}
    assert labels == {"kitchen": ["sink"], "kitchen (2)": ["oven"]}
    assert oven["candidates"][0]["kind"] == "thing"


async def test_the_first_write_binds_no_memory_of_unknown_origin(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text(
        "waypoints:\n  - {name: pantry, pose: {x: 3.0, y: 7.0, yaw_deg: 0}}\n"
    )
    robot = FakeRobot(MAP, pose=IN_HOUSE)
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await remember(client, looks_at("sink", SINK))
        refused = await client.call_tool("navigate_to", {"place": "pantry"})
        realigned = await client.call_tool("realign_memory", {})
        sink = await ask(client, "sink")
    assert refused.is_error
    assert "another map" in text_of(refused)
    assert realigned.is_error
    assert sink["verdict"] == "found"


async def test_a_person_says_which_map_a_memory_belongs_to(tmp_path: Path) -> None:
    robot = FakeRobot(MAP, pose=IN_HOUSE)
    (tmp_path / FILE).write_text(
        f"map: {robot.description.map_name}\n"
        "waypoints:\n  - {name: pantry, pose: {x: 3.0, y: 4.5, yaw_deg: 0}}\n"
    )
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await remember(client, looks_at("sink", SINK))
        drive = await client.call_tool("navigate_to", {"place": "pantry"})
    assert not drive.is_error


async def test_an_event_of_another_map_closes_nothing_until_its_map_is_aligned(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(MAP, pose=IN_HOUSE)
    guard = make_guard(tmp_path / "guard", clock=WallClock(MONDAY_NOON))
    there = MOTION @ Pose(15.0, 4.5)
    async with connect(robot, tmp_path, toolsets=TOOLSETS, guard=guard) as client:
        await client.call_tool("note_event", {"text": "wet", "place": "15, 4.5", "effect": "avoid"})
        await put_on(client, robot, moved(MAP, MOTION), MOTION @ IN_HOUSE)
        before = text_of(await client.call_tool("look_at_map", {}))
        await client.call_tool("realign_memory", {})
        after = text_of(await client.call_tool("look_at_map", {}))
        await client.call_tool("end_event", {"event": "E1"})
        ended = text_of(await client.call_tool("look_at_map", {}))
    assert "wet" not in before.replace("another map", "")
    assert "wet" in after
    assert "wet" not in ended
    assert there.x != 15.0


async def test_observations_are_told_where_they_were_made_on_whichever_map(tmp_path: Path) -> None:
    robot = FakeRobot(MAP, pose=IN_HOUSE)
    guard = make_guard(tmp_path / "guard", clock=WallClock(MONDAY_NOON))
    there = MOTION @ IN_HOUSE
    near = {"near": f"{there.x:.3f}, {there.y:.3f}", "radius_m": 1.0}
    async with connect(robot, tmp_path, toolsets=TOOLSETS, guard=guard) as client:
        await client.call_tool("look_through_camera", {})
        await put_on(client, robot, moved(MAP, MOTION), there)
        await client.call_tool("look_through_camera", {})
        before = text_of(await client.call_tool("recall_episodes", {}))
        near_before = text_of(await client.call_tool("recall_episodes", near))
        await client.call_tool("realign_memory", {})
        after = text_of(await client.call_tool("recall_episodes", {}))
        near_after = text_of(await client.call_tool("recall_episodes", near))
        await put_on(client, robot, MAP, IN_HOUSE)
        back = text_of(await client.call_tool("recall_episodes", {}))
    assert before.count("from another map") == 1
    assert near_before.count(": picture at") == 1
    assert after.count("from another map") == 0
    assert near_after.count(": picture at") == 2
    assert back.count("from x 3.0") == 2


def _off_m(folder: Path, name: str, pose: Pose) -> float:
    """Return how far a record of the file stands from a pose, in its own frame."""
    place = SemanticMapStore(folder / FILE).read().find_waypoint(name)
    assert place is not None
    return place.pose.point.distance_to(pose.point)
