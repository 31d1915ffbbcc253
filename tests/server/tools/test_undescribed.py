"""Pictures that nothing was written of: offered at once, and described in one call."""

import math
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from mcp.client import Client

from drawing import grid_from_text
from fakes import FakeRobot, two_rooms
from guarding import MONDAY_NOON, WallClock, make_guard
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import Detection
from mapspeak.safety import Guard
from served import connect, pictures_of, report_of, text_of

pytestmark = pytest.mark.anyio

TOOLSETS = ("look", "places", "drive", "paper", "memory")
SINK = Detection(label="sink", bearing_rad=0.2, range_m=1.5, confidence_ratio=0.9)
CORRIDOR = grid_from_text(
    """
    ##########################################
    #........................................#
    #........................................#
    #........................................#
    #........................................#
    #........................................#
    ##########################################
    """,
    resolution_m=0.25,
)
VIEWS = (Pose(1.0, 1.4, 0.0), Pose(1.0, 1.4, 1.5), Pose(2.5, 1.4, 0.0))


def guard(folder: Path, *, later: timedelta = timedelta(0)) -> Guard:
    return make_guard(folder, clock=WallClock(MONDAY_NOON + later))


async def look(client: Client, robot: FakeRobot, *views: Pose) -> None:
    """Take a picture from each pose; the fake's pictures are alike, but for their sizes."""
    for n, view in enumerate(views):
        robot.pose, robot.picture_size = view, (64 + n, 48)
        await client.call_tool("look_through_camera", {})


async def write(client: Client, **place: object) -> dict[str, Any]:
    return report_of(await client.call_tool("write_semantic_data", {"description": "", **place}))


async def offered(client: Client) -> str:
    warnings = report_of(await client.call_tool("get_semantic_data", {}))["warnings"]
    return next((each for each in warnings if "without words" in each), "")


def seeing_robot() -> FakeRobot:
    robot = FakeRobot(two_rooms())
    robot.detections = (SINK,)
    return robot


async def test_pictures_without_words_are_offered_with_what_the_detector_saw(
    tmp_path: Path,
) -> None:
    robot = seeing_robot()
    async with connect(robot, tmp_path, guard=guard(tmp_path), toolsets=TOOLSETS) as client:
        await look(client, robot, *VIEWS)
        said = await offered(client)
        shown = await client.call_tool("recall_episodes", {"picture_of": "undescribed"})
    assert said.startswith('3 pictures without words: P3 in R2, the detector saw "sink"; P2 in R2')
    assert "write_semantic_data takes many at once" in said
    assert len(pictures_of(shown)) == 3
    assert "P1 in R2" in text_of(shown)


async def test_one_call_describes_many_pictures_each_from_its_own_pose(tmp_path: Path) -> None:
    robot = seeing_robot()
    async with connect(robot, tmp_path, guard=guard(tmp_path), toolsets=TOOLSETS) as client:
        await look(client, robot, *VIEWS)
        robot.pose = Pose(4.5, 0.6, 3.0)
        sink = {"label": "sink", "image_column_px": 64}
        more = [
            {"picture": "P2", "name": "wash", "description": "", "functional_landmarks": [sink]},
            {"picture": "P3", "name": "bench", "description": "A long bench."},
        ]
        answer = await write(client, name="door", picture="P1", more=more)
        left = await offered(client)
    places = SemanticMapStore(tmp_path / "semantic_map.yaml").read()
    assert [each.name for each in places.waypoints] == ["door", "wash", "bench"]
    assert [each.pose.point for each in places.waypoints] == [each.point for each in VIEWS]
    assert len({each.picture for each in places.waypoints}) == 3
    assert places.waypoints[1].functional_landmarks[0].bearing_from == "picture"
    assert [each["id"] for each in answer["others"]] == ["W2", "W3"]
    assert [each["seen_from"].rpartition(" ")[2] for each in answer["others"]] == ["R2", "R2"]
    assert answer["n_places"] == 3
    assert left == ""


async def test_what_is_wrong_with_one_place_costs_no_other(tmp_path: Path) -> None:
    robot = seeing_robot()
    async with connect(robot, tmp_path, guard=guard(tmp_path)) as client:
        await look(client, robot, *VIEWS)
        more = [
            {"picture": "P9", "name": "nowhere", "description": ""},
            {"picture": "P3", "name": "bench", "description": ""},
        ]
        answer = await write(client, name="door", picture="P1", more=more)
    places = SemanticMapStore(tmp_path / "semantic_map.yaml").read()
    assert [each.name for each in places.waypoints] == ["door", "bench"]
    nowhere, bench = answer["others"]
    assert nowhere["refused"][0].startswith('"nowhere" was not written: There is no picture')
    assert (nowhere["id"], bench["id"]) == ("", "W2")


async def test_further_places_are_told_as_fully_as_the_first(tmp_path: Path) -> None:
    robot = FakeRobot(CORRIDOR)
    charger = {"label": "charger", "image_column_px": 30}
    ends = Pose(1.0, 0.8, 0.0), Pose(9.0, 0.8, 0.0)
    async with connect(robot, tmp_path, guard=guard(tmp_path)) as client:
        await look(client, robot, *ends)
        west = {"name": "west end", "picture": "P1", "functional_landmarks": [charger]}
        await write(client, **west)
        west = {**west, "picture": "P2", "description": "Seen again."}
        alone = await write(client, name="middle", picture="P2", more=[west])
        (moved,) = alone["others"]
        back = await write(client, name="west end", x=1.0, y=0.8)
    west_end = next(
        each
        for each in SemanticMapStore(tmp_path / "semantic_map.yaml").read().waypoints
        if each.name == "west end"
    )
    assert "pose x 1.00, y 0.80, yaw 0 deg, 8.0 m away" in moved["replaced"]
    assert [each.partition(" ")[0] for each in moved["things"]] == ["T1"]
    (warning,) = moved["warnings"]
    assert "moved 8.0 m: noted from C1 now, from C1 before" in warning
    assert "write it again with x 1.00, y 0.80" in warning
    assert west_end.pose.point == ends[0].point
    assert "8.0 m away" in back["replaced"]


@pytest.mark.parametrize(("to_x", "n_warnings"), [(3.5, 0), (4.5, 1)])
async def test_a_place_that_moves_far_within_one_room_is_warned_of(
    tmp_path: Path, to_x: float, n_warnings: int
) -> None:
    robot = FakeRobot(CORRIDOR)
    async with connect(robot, tmp_path, guard=guard(tmp_path)) as client:
        await write(client, name="west end", description="A charger.", x=1.0, y=0.8)
        answer = await write(client, name="west end", description="A charger.", x=to_x, y=0.8)
    assert len(answer["warnings"]) == n_warnings


async def test_a_picture_of_an_earlier_run_is_described_by_its_observation(tmp_path: Path) -> None:
    robot = seeing_robot()
    async with connect(robot, tmp_path, guard=guard(tmp_path), toolsets=TOOLSETS) as client:
        await look(client, robot, VIEWS[0])
    robot, later = seeing_robot(), guard(tmp_path, later=timedelta(hours=2))
    robot.pose = Pose(4.5, 0.6, 3.0)
    async with connect(robot, tmp_path, guard=later, toolsets=TOOLSETS) as client:
        said = await offered(client)
        observation_id = said.partition(": ")[2].partition(" ")[0]
        await write(client, name="door", picture=observation_id)
        left = await offered(client)
    (place,) = SemanticMapStore(tmp_path / "semantic_map.yaml").read().waypoints
    assert place.pose.point == VIEWS[0].point
    assert place.recorded_at == MONDAY_NOON
    assert left == ""


async def test_a_view_that_a_place_tells_of_is_not_offered_and_one_beside_it_is(
    tmp_path: Path,
) -> None:
    robot = seeing_robot()
    async with connect(robot, tmp_path, guard=guard(tmp_path), toolsets=TOOLSETS) as client:
        await write(client, name="wash", x=1.0, y=1.4, yaw_deg=0.0)
        await look(client, robot, *VIEWS[:2], VIEWS[1])
        said = await offered(client)
    assert said.startswith("1 picture without words: P3 in R2")
    assert 'beside "wash"' in said


async def test_directions_are_told_from_the_heading_of_the_described_picture(
    tmp_path: Path,
) -> None:
    robot = seeing_robot()
    async with connect(robot, tmp_path, guard=guard(tmp_path)) as client:
        await look(client, robot, VIEWS[1])
        robot.pose = Pose(4.5, 0.6, 3.0)
        bench = {"label": "bench", "bearing_deg": 10.0}
        await write(client, name="wash", picture="P1", functional_landmarks=[bench])
    (place,) = SemanticMapStore(tmp_path / "semantic_map.yaml").read().waypoints
    (landmark,) = place.functional_landmarks
    assert place.pose.is_near(VIEWS[1], off_m=0.01, turn_rad=0.01)
    assert landmark.pose is None
    assert landmark.bearing_rad == pytest.approx(math.radians(10.0))
