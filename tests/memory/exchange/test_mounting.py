"""Memories of one building or of two, each on the map of its own robot, as one."""

import math
import shutil
from datetime import UTC, datetime
from pathlib import Path

import pytest

from alignment_maps import HOUSE, OTHER_HOUSE, fine, moved
from mapspeak.geometry import Point, Pose
from mapspeak.memory import SemanticMapStore, Waypoint
from mapspeak.memory.alignment.framed import FramedMemory
from mapspeak.memory.episodes.observation import EpisodeQuery, Observation, ObservationKind
from mapspeak.memory.episodes.store import EpisodeStore, memory_folder
from mapspeak.memory.events import Effect, Event
from mapspeak.memory.exchange.uniting import merge_files
from mapspeak.spatial import OccupancyGrid

MAP, OTHER = fine(HOUSE), fine(OTHER_HOUSE)
MOTION = Pose(3.0, -1.0, math.radians(90))
MOVED = moved(MAP, MOTION)
DOCK, SINK = Pose(2.0, 3.0, 0.5), Pose(20.0, 8.0, -1.0)


def opened(path: Path, grid: OccupancyGrid) -> FramedMemory:
    memory = FramedMemory(SemanticMapStore(path, map_id="house"))
    memory.meet(grid)
    return memory


def made(path: Path, grid: OccupancyGrid, places: dict[str, Pose]) -> Path:
    """A memory that a robot with this map has written, with an event and a note."""
    memory = opened(path, grid)
    for name, pose in places.items():
        memory.write(Waypoint(name=name, pose=pose))
    first = next(iter(places.values()))
    memory.write_event(
        Event(text=f"wet at {path.stem}", effect=Effect.SLOW, place="C1", at=first.point)
    )
    EpisodeStore(memory_folder(path)).write(
        Observation(
            recorded_at=datetime(2026, 11, 22, 9, 0, tzinfo=UTC),
            pose=first,
            kind=ObservationKind.NOTE,
            text=f"a ladder at {path.stem}",
            map_id=memory.name_map(),
        )
    )
    return path


@pytest.fixture
def first(tmp_path: Path) -> Path:
    return made(tmp_path / "a.yaml", MAP, {"dock": DOCK})


def test_memories_of_one_building_are_aligned_by_their_walls(first: Path, tmp_path: Path) -> None:
    second = made(
        tmp_path / "b.yaml", MOVED, {"sink": MOTION @ SINK, "dock": MOTION @ Pose(2.1, 3.0, 0.5)}
    )
    out = tmp_path / "c.yaml"

    union, _ = merge_files(first, second, out=out)

    assert "turned by -90.0 degrees" in union.findings[0]
    for grid, motion in ((MAP, Pose(0.0, 0.0)), (MOVED, MOTION)):
        memory = opened(out, grid)
        places = {each.name: each.pose for each in memory.read().waypoints}
        assert set(places) >= {"dock", "sink"}
        assert memory.read().elsewhere == ()
        assert places["sink"].point.distance_to((motion @ SINK).point) < 0.05
        events = {each.text: each.at or Point(0.0, 0.0) for each in memory.read_events()}
        assert events["wet at a"].distance_to((motion @ DOCK).point) < 0.05
        assert events["wet at b"].distance_to((motion @ SINK).point) < 0.05
        query = EpisodeQuery(near=(motion @ SINK).point, radius_m=0.1, placings=memory.place_maps())
        (match,) = EpisodeStore(memory_folder(out)).find(query).matches
        assert match.observation.text == "a ladder at b"


def test_memories_of_two_buildings_stay_two_frames(first: Path, tmp_path: Path) -> None:
    second = made(tmp_path / "b.yaml", OTHER, {"dock": DOCK, "oven": SINK})
    out = tmp_path / "c.yaml"

    union, came = merge_files(first, second, out=out)

    assert "stays apart, as the frame F2" in union.findings[0]
    assert came.n_observations == 2
    here, there = opened(out, MAP).read(), opened(out, OTHER).read()
    assert [each.name for each in here.waypoints] == ["dock"]
    assert sorted(each.name for each in there.waypoints) == ["dock (2)", "oven"]
    assert [each.text for each in opened(out, OTHER).read_events()] == ["wet at b"]


def test_a_memory_joined_with_a_copy_of_itself_on_the_same_map_stays_the_same(
    first: Path, tmp_path: Path
) -> None:
    second = made(tmp_path / "b.yaml", MAP, {"dock": DOCK, "sink": SINK})
    out = tmp_path / "c.yaml"

    merge_files(first, second, out=out)

    assert SemanticMapStore(out).read().frames.items == ()
    assert sorted(each.name for each in opened(out, MAP).read().waypoints) == ["dock", "sink"]


def test_frames_of_a_second_memory_are_those_of_the_first_with_their_walls(
    first: Path, tmp_path: Path
) -> None:
    opened(first, OTHER).write(Waypoint(name="oven", pose=SINK))
    second = made(tmp_path / "b.yaml", OTHER, {"hob": SINK})
    opened(second, MAP).write(Waypoint(name="tap", pose=SINK))
    out = tmp_path / "c.yaml"

    merge_files(first, second, out=out)

    frames = {each.name: each.frame for each in SemanticMapStore(out).read().waypoints}
    assert frames == {"dock": None, "oven": "F2", "hob": "F2", "tap": None}
    assert sorted(each.name for each in opened(out, OTHER).read().waypoints) == ["hob", "oven"]
    assert sorted(each.name for each in opened(out, MAP).read().waypoints) == ["dock", "tap"]


def test_a_memory_with_frames_joined_with_a_copy_of_itself_stays_the_same(
    first: Path, tmp_path: Path
) -> None:
    opened(first, OTHER).write(Waypoint(name="oven", pose=SINK))
    copy = tmp_path / "copy.yaml"
    shutil.copy(first, copy)
    shutil.copytree(tmp_path / "a.memory", tmp_path / "copy.memory")

    merge_files(first, copy, out=tmp_path / "c.yaml")

    united = SemanticMapStore(tmp_path / "c.yaml").read()
    assert [(each.name, each.frame) for each in united.waypoints] == [
        ("dock", None),
        ("oven", "F2"),
    ]


def test_walls_tell_more_of_a_second_memory_than_the_name_of_its_map(tmp_path: Path) -> None:
    first = tmp_path / "a.yaml"
    SemanticMapStore(first, map_id="house").write(Waypoint(name="dock", pose=DOCK))
    annex = FramedMemory(SemanticMapStore(first, map_id="annex"))
    annex.meet(MAP)
    annex.write(Waypoint(name="oven", pose=DOCK))
    second = made(tmp_path / "b.yaml", MOVED, {"sink": MOTION @ SINK})

    merge_files(first, second, out=tmp_path / "c.yaml")

    sink = opened(tmp_path / "c.yaml", MAP).read().find_waypoint("sink")
    assert sink is not None
    assert sink.pose.point.distance_to(SINK.point) < 0.05


def test_a_frame_without_an_entry_is_none_of_the_other_memory_s(tmp_path: Path) -> None:
    entry = "frames:\n- {id: F2, pose: {x: 5, y: 0, yaw_deg: 0}}\n"
    for name, frames in (("a", entry), ("b", "")):
        place = f"- {{name: {name}, pose: {{x: 1, y: 1, yaw_deg: 0}}, frame: F2}}\n"
        (tmp_path / f"{name}.yaml").write_text(f"map: house\nwaypoints:\n{place}{frames}")

    merge_files(tmp_path / "a.yaml", tmp_path / "b.yaml", out=tmp_path / "c.yaml")

    united = SemanticMapStore(tmp_path / "c.yaml").read()
    of_second = united.waypoints[1].frame
    assert united.frames.find_transform(of="F2", into=None) is not None
    assert united.frames.find_transform(of=of_second, into=None) is None


def test_merging_the_same_memory_again_adds_nothing(first: Path, tmp_path: Path) -> None:
    second = made(tmp_path / "b.yaml", MOVED, {"sink": MOTION @ SINK})
    once, twice = tmp_path / "c.yaml", tmp_path / "d.yaml"

    merge_files(first, second, out=once)
    merge_files(once, second, out=twice)

    assert SemanticMapStore(twice).read() == SemanticMapStore(once).read()


def test_files_of_unknown_maps_stay_apart(tmp_path: Path) -> None:
    first, second, out = (tmp_path / f"{name}.yaml" for name in "abc")
    SemanticMapStore(first).write(Waypoint(name="dock", pose=DOCK))
    SemanticMapStore(second).write(Waypoint(name="dock", pose=SINK))

    union, _ = merge_files(first, second, out=out)

    assert "stays apart" in union.findings[0]
    assert [(each.name, each.frame) for each in SemanticMapStore(out).read().waypoints] == [
        ("dock", None),
        ("dock (2)", "F2"),
    ]
