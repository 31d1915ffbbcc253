import math
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from alignment_maps import HOUSE, OTHER_HOUSE, fine, moved
from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMapStore, Waypoint
from mapspeak.memory.alignment.comparing import MapRelation
from mapspeak.memory.alignment.fitting import Certainty
from mapspeak.memory.alignment.framed import FramedMemory
from mapspeak.memory.events import Effect, Event
from mapspeak.memory.walls import KeptWalls
from mapspeak.server.text.findings import say_receipt
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_map

MOTION = Pose(3.0, -1.0, math.radians(40))
TWICE = Pose(-2.0, 5.0, math.radians(-115))
MAP, MOVED, OTHER = fine(HOUSE), moved(fine(HOUSE), MOTION), fine(OTHER_HOUSE)
MAP_AND_YARD = OccupancyGrid(
    cells=np.pad(MAP.cells, ((0, 0), (0, 60))), resolution_m=MAP.resolution_m, origin=MAP.origin
)
BLANK = MAP.crop(slice(5, 20), slice(5, 20))
MOVED_TWICE = moved(fine(HOUSE), TWICE)
DOCK = Waypoint(
    name="dock",
    pose=Pose(2.0, 3.0, 0.5),
    functional_landmarks=(Landmark(label="charger", bearing_rad=0.1, range_m=2.0),),
)
SINK = Waypoint(name="sink", pose=Pose(20.0, 8.0, -1.0))
WET = Event(
    text="wet floor",
    place="C1",
    effect=Effect.CLOSED,
    at=Point(1.0, 1.0),
    outlines=((Point(0.0, 0.0), Point(2.0, 0.0), Point(2.0, 2.0)),),
    until=datetime(2026, 11, 22, 14, 0, tzinfo=UTC),
)


@pytest.fixture
def store(tmp_path: Path) -> SemanticMapStore:
    return SemanticMapStore(tmp_path / "places.yaml", map_id="house")


@pytest.fixture
def memory(store: SemanticMapStore) -> FramedMemory:
    """A memory of the house with two places."""
    memory = opened(store, MAP)
    memory.write(DOCK)
    memory.write(SINK)
    return memory


def opened(store: SemanticMapStore, grid: OccupancyGrid, *, map_id: str = "house") -> FramedMemory:
    """The memory as a robot sees it that has just begun a map."""
    memory = FramedMemory(SemanticMapStore(store.path, map_id=map_id), name_robot=lambda: "r1")
    memory.meet(grid)
    return memory


def snapshot(store: SemanticMapStore, name: str = "map.yaml") -> OccupancyGrid:
    return load_map(store.path.with_name("places.memory") / name).grid


def here(memory: FramedMemory) -> list[str]:
    return [each.name for each in memory.read().waypoints]


def elsewhere(memory: FramedMemory) -> list[str]:
    return [each.name for each in memory.read().elsewhere]


@pytest.mark.usefixtures("memory")
def test_the_map_is_kept_beside_the_records(store: SemanticMapStore) -> None:
    assert (snapshot(store).cells == MAP.cells).all()
    assert here(opened(store, MAP)) == ["dock", "sink"]


def test_of_two_robots_that_begin_at_once_on_different_maps_each_has_its_own_frame(
    store: SemanticMapStore,
) -> None:
    first, second = opened(store, MAP), opened(store, MOVED)

    first.write(DOCK)
    second.write(SINK)

    assert (here(first), elsewhere(first)) == (["dock"], ["sink"])
    assert (here(second), elsewhere(second)) == (["sink"], ["dock"])
    assert (snapshot(store).cells == MAP.cells).all()


def test_of_two_robots_that_begin_at_once_on_one_map_each_reads_the_other_s_places(
    store: SemanticMapStore,
) -> None:
    first, second = opened(store, MAP), opened(store, MAP)

    first.write(DOCK)
    second.write(SINK)

    assert here(first) == here(second) == ["dock", "sink"]


def test_a_robot_that_wrote_nothing_yet_is_told_nothing_of_another_map_as_here(
    store: SemanticMapStore,
) -> None:
    first, second = opened(store, MAP), opened(store, MOVED)

    first.write(DOCK)
    first.write_event(WET)

    assert second.read_events() == ()
    assert (here(second), elsewhere(second)) == ([], ["dock"])


def test_of_two_robots_with_hardly_a_wall_each_has_its_own_frame(store: SemanticMapStore) -> None:
    first, second = (opened(store, BLANK, map_id=map_id) for map_id in ("house", "annex"))

    first.write(DOCK)
    second.write(SINK)

    assert (here(first), elsewhere(first)) == (["dock"], ["sink"])
    assert (here(second), elsewhere(second)) == (["sink"], ["dock"])


def test_walls_of_which_another_robot_has_kept_more_stay(store: SemanticMapStore) -> None:
    part, more = (MAP.crop(slice(0, MAP.n_rows), slice(0, n_cols)) for n_cols in (120, 150))
    first = opened(store, part)
    first.write(DOCK)
    opened(store, MAP).write(SINK)

    first.meet(more)
    first.write(DOCK)

    assert (snapshot(store).cells == MAP.cells).all()


class Overtaken:
    """`KeptWalls` where another robot keeps its own under a free name as soon as it is told."""

    def __init__(self, walls: KeptWalls, others: OccupancyGrid) -> None:
        self._walls = walls
        self._others = others

    def load(self, name: str) -> OccupancyGrid | None:
        return self._walls.load(name)

    def keep(self, grid: OccupancyGrid, name: str, *, is_first: bool = False) -> bool:
        return self._walls.keep(grid, name, is_first=is_first)

    def free_name(self) -> str:
        name = self._walls.free_name()
        if name == "map-2.yaml":
            self._walls.keep(self._others, name)
        return name


@pytest.mark.usefixtures("memory")
def test_walls_of_a_new_frame_take_the_place_of_no_other_robot_s(store: SemanticMapStore) -> None:
    overtaken = SemanticMapStore(store.path, map_id="annex")
    overtaken.walls = Overtaken(store.walls, MOVED)
    memory = FramedMemory(overtaken)
    memory.meet(OTHER)

    memory.write(replace(DOCK, name="oven"))

    assert (snapshot(store, "map-2.yaml").cells == MOVED.cells).all()
    assert here(opened(store, OTHER)) == ["oven"]


def test_free_cells_that_are_probabilities_are_kept_as_free(store: SemanticMapStore) -> None:
    cells = np.where(MAP.free, 45, np.where(MAP.occupied, 60, -1)).astype(np.int8)

    opened(store, OccupancyGrid(cells=cells, resolution_m=0.1)).write(DOCK)

    assert (snapshot(store).free == MAP.free).all()
    assert (snapshot(store).occupied == MAP.occupied).all()


@pytest.mark.usefixtures("memory")
def test_a_crash_between_map_and_picture_leaves_the_pair_of_before(
    store: SemanticMapStore,
) -> None:
    folder = store.path.with_name("places.memory")
    (folder / "map-01234567.pgm").write_bytes(b"half of a pict")

    assert here(opened(store, MAP)) == ["dock", "sink"]


def test_a_map_that_has_grown_is_kept_in_place_of_the_old_one(store: SemanticMapStore) -> None:
    memory = opened(store, MAP.crop(slice(0, MAP.n_rows), slice(0, 120)))
    memory.write(DOCK)
    memory.meet(MAP)
    memory.write(SINK)

    assert here(memory) == ["dock", "sink"]
    assert (snapshot(store).cells == MAP.cells).all()
    memory.meet(MAP_AND_YARD)
    memory.write(SINK)
    # The picture before stays for those who read it now.
    assert len(list(store.path.with_name("places.memory").glob("*.pgm"))) == 2


def test_a_map_that_has_hardly_grown_is_not_written_again(
    memory: FramedMemory, store: SemanticMapStore
) -> None:
    before = snapshot(store)
    cells = MAP.cells.copy()
    cells[40:44, 60:64] = 100

    memory.meet(OccupancyGrid(cells=cells, resolution_m=0.1))
    memory.write(SINK)

    assert (snapshot(store).cells == before.cells).all()


def test_a_map_with_hardly_a_wall_is_not_kept(store: SemanticMapStore) -> None:
    memory = opened(store, BLANK)
    memory.write(DOCK)

    assert not store.path.with_name("places.memory").exists()
    assert here(memory) == ["dock"]
    assert memory.keeper.compare() is None


@pytest.mark.parametrize(
    ("grid", "relation"), [(OTHER, MapRelation.OTHER), (MOVED, MapRelation.MOVED)]
)
@pytest.mark.usefixtures("memory")
def test_records_of_another_map_are_not_here(
    store: SemanticMapStore, grid: OccupancyGrid, relation: MapRelation
) -> None:
    memory = opened(store, grid)
    comparison = memory.keeper.compare()

    assert comparison is not None
    assert comparison.relation is relation
    assert (here(memory), elsewhere(memory)) == ([], ["dock", "sink"])


@pytest.mark.parametrize("name", ["../places.yaml", "maps/old.yaml"])
def test_walls_are_kept_in_their_folder_wherever_a_file_says_that_they_are(
    store: SemanticMapStore, name: str
) -> None:
    store.path.write_text(f"map: house\nsnapshot: {name}\n")

    opened(store, MAP).write(DOCK)

    assert here(opened(store, MAP)) == ["dock"]
    assert elsewhere(opened(store, MOVED)) == ["dock"]


def test_a_map_that_jumps_takes_no_record_along(memory: FramedMemory) -> None:
    memory.meet(MOVED)

    assert (here(memory), elsewhere(memory)) == ([], ["dock", "sink"])

    memory.meet(MAP)

    assert (here(memory), elsewhere(memory)) == (["dock", "sink"], [])


@pytest.mark.usefixtures("memory")
def test_a_write_on_another_map_goes_into_a_frame_of_its_own(store: SemanticMapStore) -> None:
    memory = opened(store, OTHER, map_id="annex")
    memory.write(replace(DOCK, name="oven"))
    memory.write_event(WET)

    assert (here(memory), elsewhere(memory)) == (["oven"], ["dock", "sink"])
    (frame,) = store.read().frames.items
    assert (frame.id, frame.map_id, frame.robot, frame.pose) == ("F2", "annex", "r1", None)
    assert (snapshot(store, frame.walls or "").cells == OTHER.cells).all()
    assert (snapshot(store).cells == MAP.cells).all()
    again = opened(store, OTHER)
    assert here(again) == ["oven"]
    assert [each.text for each in again.read_events()] == ["wet floor"]
    assert opened(store, MAP).read_events() == ()


def test_the_walls_of_a_frame_are_kept_once_there_are_any(store: SemanticMapStore) -> None:
    opened(store, OTHER).write(DOCK)
    memory = opened(store, OccupancyGrid(cells=MAP.cells[5:20, 5:20], resolution_m=0.1))
    memory.write(SINK)

    memory.meet(OccupancyGrid(cells=MAP.cells[5:60, 5:60], resolution_m=0.1))
    memory.write(SINK)

    (frame,) = store.read().frames.items
    assert frame.walls == "map-2.yaml"


def test_a_frame_gets_one_transform_and_no_record_changes(
    memory: FramedMemory, store: SemanticMapStore
) -> None:
    memory.write_event(WET)
    before = store.read()
    there = opened(store, MOVED)
    there.write(replace(SINK, name="tap", pose=MOTION @ SINK.pose))

    receipt = there.keeper.realign()

    assert receipt.certainty is Certainty.SURE
    assert (receipt.n_waypoints, receipt.n_events) == (2, 1)
    assert store.read().waypoints[:2] == before.waypoints
    poses = {each.name: each.pose for each in there.read().waypoints}
    for name, pose in (("dock", DOCK.pose), ("sink", SINK.pose), ("tap", SINK.pose)):
        truth = MOTION @ pose
        assert poses[name].point.distance_to(truth.point) < 0.05
        assert math.isclose(poses[name].yaw_rad, truth.yaw_rad, abs_tol=0.01)
    (wet,) = there.read_events()
    assert wet.at is not None
    assert wet.at.distance_to(MOTION.transform(Point(1.0, 1.0))) < 0.05
    assert "2 waypoints and 1 events more can be used here" in say_receipt(receipt)


@pytest.mark.usefixtures("memory")
def test_rooms_of_the_old_map_are_left_away(store: SemanticMapStore) -> None:
    memory = opened(store, MAP)
    memory.write(replace(DOCK, room_id="R3"))
    there = opened(store, MOVED)
    there.keeper.realign()

    assert [each.room_id for each in there.read().waypoints] == [None, None]
    assert store.read().waypoints[0].room_id == "R3"


@pytest.mark.usefixtures("memory")
def test_what_is_aligned_stays_so_for_every_robot_and_every_map(store: SemanticMapStore) -> None:
    opened(store, MOVED).keeper.realign()
    opened(store, MOVED_TWICE).keeper.realign()

    for grid, motion in ((MAP, Pose(0.0, 0.0)), (MOVED, MOTION), (MOVED_TWICE, TWICE)):
        memory = opened(store, grid)
        sink = memory.read().find_waypoint("sink")
        assert sink is not None
        assert sink.pose.point.distance_to((motion @ SINK.pose).point) < 0.05
        again = memory.keeper.realign()
        assert again.motion is None
        assert "Nothing had to be aligned." in say_receipt(again)


def test_a_map_that_was_too_small_to_be_recognised_is_aligned_once_it_shows_enough(
    memory: FramedMemory, store: SemanticMapStore
) -> None:
    late = opened(store, BLANK)
    late.write(replace(DOCK, name="early"))
    assert (here(late), elsewhere(late)) == (["early"], ["dock", "sink"])
    late.meet(MAP)

    receipt = late.keeper.realign()

    assert "2 waypoints and 0 events more can be used here" in say_receipt(receipt)
    assert sorted(here(late)) == sorted(here(memory)) == ["dock", "early", "sink"]


def test_realigning_counts_the_places_of_all_frames(store: SemanticMapStore) -> None:
    opened(store, MAP).write(DOCK)
    opened(store, MOVED).write(SINK)
    memory = opened(store, MOVED_TWICE)

    receipt = memory.keeper.realign()

    assert receipt.n_waypoints == len(here(memory)) == 2


def test_a_known_place_is_written_in_its_own_frame(
    memory: FramedMemory, store: SemanticMapStore
) -> None:
    there = opened(store, MOVED)
    there.keeper.realign()

    receipt, _ = there.remember(replace(SINK, pose=MOTION @ Pose(19.0, 8.0, -1.0), room_id="R7"))

    assert receipt.waypoint.room_id == "R7"
    assert receipt.waypoint.pose.x == pytest.approx((MOTION @ Pose(19.0, 8.0)).x, abs=0.05)
    kept = memory.read().find_waypoint("sink")
    assert kept is not None
    assert kept.pose.x == pytest.approx(19.0, abs=0.05)
    assert memory.read().elsewhere == ()


@pytest.mark.usefixtures("memory")
def test_records_are_not_aligned_with_another_building(store: SemanticMapStore) -> None:
    before = store.path.read_bytes()

    receipt = opened(store, OTHER).keeper.realign()

    with pytest.raises(SemanticMapError, match="The records stay where they are"):
        say_receipt(receipt)
    assert store.path.read_bytes() == before


def test_records_without_walls_belong_to_no_map_until_somebody_says_so(
    store: SemanticMapStore,
) -> None:
    SemanticMapStore(store.path).write(DOCK)
    memory = opened(store, MAP)

    assert elsewhere(memory) == ["dock"]
    with pytest.raises(SemanticMapError, match="No map was kept"):
        memory.keeper.realign()
    memory.write(SINK)
    assert (here(memory), elsewhere(memory)) == (["sink"], ["dock"])
    assert "map: house" not in store.path.read_text().partition("frames:")[0]


def test_records_without_walls_are_of_the_map_that_their_file_names(
    store: SemanticMapStore,
) -> None:
    store.write(DOCK)

    assert here(opened(store, MAP)) == ["dock"]
    assert elsewhere(opened(store, MAP, map_id="annex")) == ["dock"]


def test_a_damaged_kept_map_is_told_and_blocks_no_write(
    memory: FramedMemory, store: SemanticMapStore
) -> None:
    kept = store.path.with_name("places.memory") / "map.yaml"
    whole = kept.read_bytes()
    kept.write_text("nothing\n")

    later = opened(store, MAP)
    with pytest.raises(SemanticMapError, match="cannot be read") as told:
        later.keeper.compare()
    with pytest.raises(SemanticMapError, match="cannot be read"):
        later.keeper.realign()
    later.write(replace(DOCK, name="bench"))

    assert str(kept) in told.value.hint
    assert (here(later), elsewhere(later)) == (["bench"], ["dock", "sink"])
    assert here(opened(store, MAP)) == ["bench"], "the next start knows its map again"
    assert here(memory) == ["dock", "sink"]
    assert kept.read_text() == "nothing\n"
    kept.write_bytes(whole)
    mended = opened(store, MAP)
    mended.keeper.realign()
    assert here(mended) == ["dock", "sink", "bench"]
    assert elsewhere(mended) == []
