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
from mapspeak.memory.alignment.fitting import Certainty
from mapspeak.memory.alignment.keeping import FIRST_NAME, MapKeeper, MapRelation
from mapspeak.memory.episodes.observation import Observation, ObservationKind
from mapspeak.memory.episodes.store import EpisodeStore, memory_folder
from mapspeak.memory.events import Effect, Event
from mapspeak.server.text.findings import say_receipt
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_map

MOTION = Pose(3.0, -1.0, math.radians(40))
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
SEEN = Observation(
    recorded_at=datetime(2026, 11, 22, 9, 0, tzinfo=UTC),
    pose=Pose(5.0, 2.0, 3.0),
    kind=ObservationKind.NOTE,
    text="a ladder",
    room_id="R1",
)


@pytest.fixture
def store(tmp_path: Path) -> SemanticMapStore:
    store = SemanticMapStore(tmp_path / "places.yaml")
    store.write(DOCK)
    store.write(SINK)
    return store


@pytest.fixture
def episodes(store: SemanticMapStore) -> EpisodeStore:
    return EpisodeStore(memory_folder(store.path))


@pytest.fixture
def keeper(store: SemanticMapStore) -> MapKeeper:
    keeper = MapKeeper(store)
    keeper.keep(fine(HOUSE))
    return keeper


def snapshot(store: SemanticMapStore, name: str = "map.yaml") -> OccupancyGrid:
    return load_map(store.path.with_name("places.memory") / name).grid


def test_the_map_is_kept_beside_the_records(keeper: MapKeeper, store: SemanticMapStore) -> None:
    assert (snapshot(store).cells == fine(HOUSE).cells).all()
    assert keeper.compare(fine(HOUSE)) is not None


def test_free_cells_that_are_probabilities_are_kept_as_free(store: SemanticMapStore) -> None:
    house = fine(HOUSE)
    cells = np.where(house.free, 45, np.where(house.occupied, 60, -1)).astype(np.int8)

    MapKeeper(store).keep(OccupancyGrid(cells=cells, resolution_m=0.1))

    assert (snapshot(store).free == house.free).all()
    assert (snapshot(store).occupied == house.occupied).all()


def test_a_crash_between_map_and_picture_leaves_the_pair_of_before(
    keeper: MapKeeper, store: SemanticMapStore
) -> None:
    folder = store.path.with_name("places.memory")
    (folder / "map-01234567.pgm").write_bytes(b"half of a pict")

    comparison = MapKeeper(store).compare(fine(HOUSE))

    assert comparison is not None
    assert comparison.relation is MapRelation.SAME
    assert keeper.compare(fine(HOUSE)) == comparison


def test_a_map_that_has_grown_is_kept_in_place_of_the_old_one(store: SemanticMapStore) -> None:
    house = fine(HOUSE)
    keeper = MapKeeper(store)
    keeper.keep(house.crop(slice(0, house.n_rows), slice(0, 120)))

    comparison = keeper.keep(house)

    assert comparison is not None
    assert comparison.relation is MapRelation.SAME
    assert (snapshot(store).cells == house.cells).all()
    assert len(list(store.path.with_name("places.memory").glob("*.pgm"))) == 1


def test_a_map_that_has_hardly_grown_is_not_written_again(
    keeper: MapKeeper, store: SemanticMapStore
) -> None:
    before = snapshot(store)
    cells = fine(HOUSE).cells.copy()
    cells[40:44, 60:64] = 100

    keeper.keep(OccupancyGrid(cells=cells, resolution_m=0.1))

    assert (snapshot(store).cells == before.cells).all()


def test_a_map_with_hardly_a_wall_is_not_kept(store: SemanticMapStore) -> None:
    keeper = MapKeeper(store)
    blank = OccupancyGrid(cells=fine(HOUSE).cells[5:20, 5:20], resolution_m=0.1)

    assert keeper.keep(blank) is None
    assert keeper.compare(blank) is None


def test_another_buildings_map_is_not_kept_and_said(
    keeper: MapKeeper, store: SemanticMapStore
) -> None:
    comparison = keeper.keep(fine(OTHER_HOUSE))

    assert comparison is not None
    assert comparison.relation is MapRelation.OTHER
    assert (snapshot(store).cells == fine(HOUSE).cells).all()


def test_records_move_with_their_map(keeper: MapKeeper, store: SemanticMapStore) -> None:
    store.write_event(WET)
    landmarks = store.read().waypoints[0].landmarks

    receipt = keeper.realign(moved(fine(HOUSE), MOTION))

    assert receipt.certainty is Certainty.SURE
    assert (receipt.n_waypoints, receipt.n_events) == (2, 1)
    said = say_receipt(receipt)
    assert "2 waypoints, 1 events and 0 observations were moved: turned by 40.0" in said
    assert said.endswith("Certainty: sure.")
    dock, sink = store.read().waypoints
    for waypoint, before in ((dock, DOCK), (sink, SINK)):
        truth = MOTION @ before.pose
        assert waypoint.pose.point.distance_to(truth.point) < 0.1
        assert math.isclose(waypoint.pose.yaw_rad, truth.yaw_rad, abs_tol=0.01)
    assert dock.landmarks == landmarks
    (wet,) = store.read_events()
    assert wet.at is not None
    assert wet.at.distance_to(MOTION.transform(Point(1.0, 1.0))) < 0.1
    assert wet.outlines[0][1].distance_to(MOTION.transform(Point(2.0, 0.0))) < 0.1


def test_rooms_of_the_old_map_are_left_away(store: SemanticMapStore) -> None:
    store.write(replace(DOCK, room_id="R3"))
    keeper = MapKeeper(store)
    keeper.keep(fine(HOUSE))

    keeper.realign(moved(fine(HOUSE), MOTION))

    assert [each.room_id for each in store.read().waypoints] == [None, None]


def test_observations_move_with_their_map(store: SemanticMapStore, episodes: EpisodeStore) -> None:
    keeper = MapKeeper(store, episodes)
    keeper.keep(fine(HOUSE))
    seen = episodes.write(SEEN)

    receipt = keeper.realign(moved(fine(HOUSE), MOTION))

    assert receipt.n_observations == 1
    _assert_moved(episodes.get(seen.id))


def test_observations_follow_their_records_also_after_a_crash_between(
    store: SemanticMapStore, episodes: EpisodeStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    keeper = MapKeeper(store, episodes)
    keeper.keep(fine(HOUSE))
    seen = episodes.write(SEEN)
    with monkeypatch.context() as crashing:
        crashing.setattr(episodes, "finish_move", _crash)
        with pytest.raises(KeyboardInterrupt):
            keeper.realign(moved(fine(HOUSE), MOTION))

    again = MapKeeper(SemanticMapStore(store.path), EpisodeStore(episodes.folder))
    assert again.finish_move() == 1
    assert again.finish_move() == 0

    _assert_moved(episodes.get(seen.id))


def test_a_move_that_did_not_come_about_moves_no_observation(
    store: SemanticMapStore, episodes: EpisodeStore
) -> None:
    keeper = MapKeeper(store, episodes)
    keeper.keep(fine(HOUSE))
    seen = episodes.write(SEEN)
    episodes.plan_move(MOTION, to="map-2.yaml")

    assert keeper.finish_move() == 0
    assert episodes.get(seen.id) == seen
    episodes.plan_move(MOTION, to="map-3.yaml")
    assert keeper.realign(fine(HOUSE)).motion is None
    assert episodes.get(seen.id) == seen


def _crash(*, at: str) -> int:
    """Dies once the records have moved."""
    if at == FIRST_NAME:
        return 0
    raise KeyboardInterrupt


def _assert_moved(seen: Observation | None) -> None:
    assert seen is not None
    truth = MOTION @ SEEN.pose
    assert seen.pose.point.distance_to(truth.point) < 0.1
    assert math.isclose(seen.pose.yaw_rad, truth.yaw_rad, abs_tol=0.01)
    assert seen.room_id is None


def test_the_file_as_it_was_is_kept(keeper: MapKeeper, store: SemanticMapStore) -> None:
    before = store.path.read_bytes()

    receipt = keeper.realign(moved(fine(HOUSE), MOTION))

    assert receipt.undo_path is not None
    assert receipt.undo_path.read_bytes() == before


def test_moved_records_belong_to_the_new_map_for_good(
    keeper: MapKeeper, store: SemanticMapStore
) -> None:
    new = moved(fine(HOUSE), MOTION)
    keeper.realign(new)

    again = MapKeeper(SemanticMapStore(store.path)).realign(new)

    assert again.motion is None
    assert "Nothing had to be moved." in say_receipt(again)


def test_there_and_back_again_leaves_the_records_where_they_were(
    keeper: MapKeeper, store: SemanticMapStore
) -> None:
    keeper.realign(moved(fine(HOUSE), MOTION))
    keeper.realign(fine(HOUSE))

    for waypoint, before in zip(store.read().waypoints, (DOCK, SINK), strict=True):
        assert waypoint.pose.point.distance_to(before.pose.point) < 0.1


def test_records_do_not_move_to_another_building(
    keeper: MapKeeper, store: SemanticMapStore
) -> None:
    before = store.path.read_bytes()

    receipt = keeper.realign(fine(OTHER_HOUSE))

    with pytest.raises(SemanticMapError, match="The records stay where they are"):
        say_receipt(receipt)

    assert store.path.read_bytes() == before


def test_records_without_a_map_cannot_be_moved(store: SemanticMapStore) -> None:
    with pytest.raises(SemanticMapError, match="No map was kept"):
        MapKeeper(store).realign(fine(HOUSE))


def test_a_map_under_another_name_takes_the_records_over(tmp_path: Path) -> None:
    old = SemanticMapStore(tmp_path / "places.yaml", map_id="monday")
    old.write(DOCK)
    MapKeeper(old).keep(fine(HOUSE))
    new = SemanticMapStore(tmp_path / "places.yaml", map_id="tuesday")

    MapKeeper(new).realign(moved(fine(HOUSE), MOTION))

    assert new.read().warnings == ()
    assert new.write(SINK).n_waypoints == 2


def test_comments_and_spelling_stay_when_records_move(
    keeper: MapKeeper, store: SemanticMapStore
) -> None:
    text = store.path.read_text().replace("waypoints:", "# ours\nwaypoints:")
    store.path.write_text(text.replace("- name: sink", "- name: sink  # the big one"))

    keeper.realign(moved(fine(HOUSE), MOTION))

    after = store.path.read_text()
    assert "# ours\n" in after
    assert "# the big one" in after
    assert "snapshot: map-2.yaml" in after


def test_a_damaged_kept_map_is_said(keeper: MapKeeper, store: SemanticMapStore) -> None:
    store.path.with_name("places.memory").joinpath("map.yaml").write_text("nothing\n")

    with pytest.raises(SemanticMapError, match="cannot be read"):
        MapKeeper(store).compare(fine(HOUSE))
    assert keeper.compare(fine(HOUSE)) is not None
