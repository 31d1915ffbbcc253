"""What every memory of places promises, wherever it keeps them."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, MemoryStore, SemanticMapStore, Waypoint
from mapspeak.memory.events import Effect, Event
from mapspeak.memory.frames import Frames, MapFrame
from mapspeak.memory.postgres import PostgresStore
from mapspeak.memory.store.forgetting import forget_place, rename_place, restore
from mapspeak.spatial import OccupancyGrid
from postgres_server import PostgresServer, run_postgres

OpenStore = Callable[[str | None], MemoryStore]
"""Opens one memory once more, as another program would, for a robot on a map."""


@pytest.fixture(params=["file", pytest.param("postgres", marks=pytest.mark.postgres)])
def open_store(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[OpenStore]:
    if request.param == "file":
        yield lambda map_id: SemanticMapStore(tmp_path / "places.yaml", map_id=map_id)
        return
    address = request.getfixturevalue("postgres").new_database()
    with ExitStack() as opened:

        def open_database(map_id: str | None) -> PostgresStore:
            store = PostgresStore(address, path=tmp_path / "places.yaml", map_id=map_id)
            return opened.enter_context(closing(store))

        yield open_database


@pytest.fixture(scope="module")
def postgres() -> Iterator[PostgresServer]:
    with TemporaryDirectory() as folder, run_postgres(Path(folder)) as server:
        yield server


@pytest.fixture
def store(open_store: OpenStore) -> MemoryStore:
    return open_store("b1")


HOSE, TAP = Landmark(label="hose"), Landmark(label="tap")


def place(name: str, x: float = 1.0, *things: Landmark) -> Waypoint:
    return Waypoint(name=name, pose=Pose(x, 2.0, 0.0), functional_landmarks=things)


def names(store: MemoryStore) -> list[str]:
    return [place.name for place in store.read().waypoints]


# --- writing and reading ---------------------------------------------------------------------


def test_a_memory_that_was_never_written_to_is_empty(store: MemoryStore) -> None:
    assert store.read().waypoints == ()
    assert store.read_events() == ()
    assert store.read().frames.own_walls == "map.yaml"


def test_a_new_name_creates_a_waypoint(store: MemoryStore) -> None:
    receipt = store.write(place("dock"))

    assert receipt.previous is None
    assert receipt.waypoint.name == "dock"
    assert store.read().waypoints == (receipt.waypoint,)
    assert receipt.waypoint.map_id == "b1"


def test_a_known_name_updates_its_waypoint_whatever_its_case(store: MemoryStore) -> None:
    first = store.write(place("Dock", 1.0)).waypoint
    store.write(place("hall"))

    receipt = store.write(place(" dock", 5.0))

    assert receipt.previous == first
    assert names(store) == ["dock", "hall"]
    assert store.read().waypoints[0].pose.x == 5.0


def test_what_one_store_writes_another_reads(store: MemoryStore, open_store: OpenStore) -> None:
    other = open_store("b1")
    assert names(other) == []

    store.write(place("dock"))
    assert names(other) == ["dock"]

    other.write(place("hall"))
    assert names(store) == ["dock", "hall"]


def test_what_measured_a_direction_and_a_range_is_kept(
    store: MemoryStore, open_store: OpenStore
) -> None:
    seen = Landmark(
        label="sink", bearing_rad=0.5, range_m=2.0, bearing_from="picture", range_from="detector"
    )
    judged = Landmark(label="tap", bearing_rad=-0.5)

    store.write(replace(place("dock"), functional_landmarks=(seen, judged)))

    kept = open_store("b1").read().waypoints[0].functional_landmarks
    assert [(each.bearing_from, each.range_from) for each in kept] == [
        ("picture", "detector"),
        (None, None),
    ]


def test_what_is_remembered_of_a_place_joins_what_was(store: MemoryStore) -> None:
    store.remember(place("dock", 1.0, HOSE))

    receipt, merge = store.remember(place("Dock", 1.0, TAP))

    assert [views[0].label for views in merge.kept] == ["hose"]
    assert receipt.waypoint.landmarks == store.read().waypoints[0].landmarks
    assert {each.label for each in receipt.waypoint.landmarks} == {"hose", "tap"}
    assert receipt.previous is not None
    assert [each.label for each in receipt.previous.landmarks] == ["hose"]


def test_what_is_gone_is_remembered_no_more(store: MemoryStore) -> None:
    store.remember(place("dock", 1.0, HOSE, TAP))

    receipt, _ = store.remember(place("dock"), gone=["hose"])

    assert [each.label for each in receipt.waypoint.present().landmarks] == ["tap"]
    assert [each.label for each in receipt.waypoint.landmarks if each.is_gone] == ["hose"]
    again, merge = store.remember(place("dock", 1.0, HOSE))
    assert [each.label for each in merge.new] == ["hose"]
    assert not any(each.is_gone for each in again.waypoint.landmarks)


def test_a_renamed_place_keeps_its_order_and_leaves_nothing_under_its_old_name(
    store: MemoryStore, open_store: OpenStore
) -> None:
    for name in ("dock", "hall", "gate"):
        store.remember(place(name, 1.0, HOSE))
    other = open_store("b1")
    assert names(other) == ["dock", "hall", "gate"]

    rename_place(store, "Hall", to="great hall")

    assert names(store) == names(other) == ["dock", "great hall", "gate"]
    assert not restore(store, "hall").places
    assert names(other) == ["dock", "great hall", "gate"]
    rename_place(other, "great hall", to="Great Hall")
    assert names(store) == ["dock", "Great Hall", "gate"]


def test_a_place_takes_the_name_of_a_forgotten_one_but_of_no_other(
    store: MemoryStore, open_store: OpenStore
) -> None:
    for name in ("dock", "hall", "gate"):
        store.remember(place(name))
    forget_place(store, "gate")

    with pytest.raises(SemanticMapError):
        rename_place(store, "dock", to="hall")
    with pytest.raises(SemanticMapError):
        rename_place(store, "cellar", to="attic")
    rename_place(store, "dock", to="gate")

    assert names(open_store("b1")) == ["gate", "hall"]
    assert not any(each.is_gone for each in store.read().waypoints)


def test_a_new_look_at_a_forgotten_place_brings_back_nothing_that_was_forgotten_with_it(
    store: MemoryStore,
) -> None:
    store.write(replace(place("gate", 1.0, HOSE), geometric_features=("a corner",)))
    forget_place(store, "gate")

    receipt, merge = store.remember(place("gate", 1.0, TAP))

    assert (receipt.previous, merge.kept) == (None, ())
    gate = store.read().present().waypoints[0]
    assert (gate.landmarks, gate.geometric_features) == ((TAP,), ())
    restore(store, "hose")
    assert [each.label for each in store.read().present().waypoints[0].landmarks] == ["tap", "hose"]


def test_what_many_remember_of_one_place_at_once_is_all_there(open_store: OpenStore) -> None:
    stores = [open_store("b1") for _ in range(4)]

    def remember(number: int) -> None:
        stores[number % 4].remember(place("dock", 1.0, Landmark(label=f"thing {number}")))

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(remember, range(12)))

    (dock,) = stores[0].read().waypoints
    assert {each.label for each in dock.landmarks} == {f"thing {number}" for number in range(12)}


def test_the_later_of_two_looks_counts_whatever_the_clocks_of_the_robots_say(
    open_store: OpenStore,
) -> None:
    noon = datetime(2026, 11, 2, 12, tzinfo=UTC)
    ahead, behind = open_store("b1"), open_store("b1")
    ahead.remember(replace(place("dock", 1.0, HOSE), recorded_at=noon, description="Old."))

    an_hour_ago = noon - timedelta(hours=1)
    behind.remember(replace(place("dock", 1.0, TAP), recorded_at=an_hour_ago, description="New."))

    (dock,) = ahead.read().waypoints
    assert (dock.description, dock.recorded_at) == ("New.", an_hour_ago)
    seen = {each.label: dock.dated(each).recorded_at for each in dock.landmarks}
    assert seen == {"tap": an_hour_ago, "hose": noon}


def test_many_waypoints_are_written_together_or_not_at_all(store: MemoryStore) -> None:
    store.write(place("dock"))

    store.write_all(lambda before: [place("hall"), replace(before.waypoints[0], description="new")])
    assert names(store) == ["dock", "hall"]
    assert store.read().waypoints[0].description == "new"

    def fail(_: object) -> list[Waypoint]:
        raise SemanticMapError("No.", hint="None.")

    with pytest.raises(SemanticMapError, match="No"):
        store.write_all(fail)
    assert names(store) == ["dock", "hall"]


# --- events ----------------------------------------------------------------------------------


def test_an_event_gets_an_id_and_can_be_changed_by_it(store: MemoryStore) -> None:
    store.write(place("dock"))
    noted = store.write_event(Event(text="wet floor", place="C1", effect=Effect.AVOID))
    store.write_event(Event(text="open day"))

    ended = store.write_event(replace(noted, until=datetime(2026, 11, 2, tzinfo=UTC)))

    assert ended.id == noted.id
    assert [each.text for each in store.read_events()] == ["wet floor", "open day"]
    assert store.read_events()[0] == ended
    assert names(store) == ["dock"]


# --- maps ------------------------------------------------------------------------------------


def test_a_waypoint_of_another_map_is_not_written(store: MemoryStore) -> None:
    with pytest.raises(SemanticMapError, match='waypoint "dock" belongs to the map "b2"'):
        store.write(replace(place("dock"), map_id="b2"))


def test_a_store_without_a_map_takes_the_memory_for_what_it_says(
    store: MemoryStore, open_store: OpenStore
) -> None:
    store.write(place("dock"))
    anywhere = open_store(None)

    anywhere.write(place("hall"))

    assert anywhere.read().map_id == "b1"
    assert anywhere.read().warnings == ()


# --- frames ----------------------------------------------------------------------------------


def with_frame(frames: Frames) -> Frames:
    return frames.added(MapFrame(id="F2", map_id="house", robot="r1", walls="map-2.yaml"))


def test_frames_are_written_and_no_record_changes(
    store: MemoryStore, open_store: OpenStore
) -> None:
    before = store.write(place("dock", 1.0)).waypoint

    store.write_frames(with_frame)
    store.write_frames(lambda frames: frames.aligned("F2", None, motion=Pose(3.0, 0.0, 1.0)))

    frame = open_store(None).read().frames.by_id["F2"]
    assert (frame.map_id, frame.robot, frame.walls) == ("house", "r1", "map-2.yaml")
    assert frame.pose is not None
    assert frame.pose.yaw_rad == pytest.approx(1.0, abs=1e-5)
    assert store.read().waypoints == (before,)


def test_a_name_of_a_frame_that_lies_nowhere_is_another_place(store: MemoryStore) -> None:
    store.write(place("dock", 1.0))
    store.write_frames(with_frame)

    for _ in range(2):
        receipt, _ = store.remember(replace(place("dock", 5.0), frame="F2"))

    assert receipt.waypoint.name == "dock (2)"
    assert names(store) == ["dock", "dock (2)"]


def test_a_name_of_an_aligned_frame_is_the_same_place_and_keeps_its_frame(
    store: MemoryStore,
) -> None:
    store.write(place("dock", 1.0))
    store.write_frames(with_frame)
    store.write_frames(lambda frames: frames.aligned("F2", None, motion=Pose(3.0, 0.0)))

    receipt, _ = store.remember(replace(place("dock", 5.0), frame="F2"))

    assert receipt.waypoint.frame is None
    assert receipt.waypoint.pose.x == 8.0
    assert names(store) == ["dock"]


def test_the_id_of_a_room_means_nothing_in_the_frame_of_another_map(store: MemoryStore) -> None:
    store.write(replace(place("dock"), room_id="R1"))
    store.write_frames(lambda frames: frames.added(MapFrame(id="F2", pose=Pose(5.0, 0.0))))

    receipt = store.write(replace(place("dock", -4.0), frame="F2", room_id="R7"))

    assert (receipt.waypoint.frame, receipt.waypoint.room_id) == (None, None)


def test_an_event_stays_in_its_frame_when_it_is_changed(store: MemoryStore) -> None:
    event = store.write_event(Event(text="wet", at=Point(1.0, 0.0)))
    store.write_frames(with_frame)
    store.write_frames(lambda frames: frames.aligned("F2", None, motion=Pose(3.0, 0.0)))

    store.write_event(replace(event, at=Point(-2.0, 0.0), source="me", frame="F2"))

    changed = store.read_events()[0]
    assert (changed.frame, changed.at, changed.source) == (None, Point(1.0, 0.0), "me")


# --- walls -----------------------------------------------------------------------------------

SMALL = OccupancyGrid(
    cells=np.array([[0, 100, -1], [0, 0, 100]], dtype=np.int8),
    resolution_m=0.05,
    origin=Pose(-1.0, 2.0, 0.5),
    stamp_s=3.5,
)


def test_walls_that_are_kept_are_read_by_another(store: MemoryStore, open_store: OpenStore) -> None:
    assert store.walls.load("map.yaml") is None

    store.walls.keep(SMALL, "map.yaml")

    kept = open_store(None).walls.load("map.yaml")
    assert kept is not None
    assert (kept.cells == SMALL.cells).all()
    assert (kept.resolution_m, kept.origin) == (SMALL.resolution_m, SMALL.origin)


def test_walls_take_the_place_of_those_before_unless_they_are_to_be_the_first(
    store: MemoryStore, open_store: OpenStore
) -> None:
    other = replace(SMALL, cells=np.zeros((4, 4), dtype=np.int8))
    assert store.walls.keep(SMALL, "map.yaml", is_first=True)

    assert not open_store(None).walls.keep(other, "map.yaml", is_first=True)
    kept = store.walls.load("map.yaml")
    assert kept is not None
    assert kept.cells.shape == (2, 3)
    assert open_store(None).walls.keep(other, "map.yaml")
    replaced = store.walls.load("map.yaml")
    assert replaced is not None
    assert replaced.cells.shape == (4, 4)


def test_walls_that_two_robots_keep_at_once_can_be_read_throughout(open_store: OpenStore) -> None:
    grids = [
        OccupancyGrid(cells=np.full((2, 2), value, dtype=np.int8), resolution_m=0.1)
        for value in (0, 100)
    ]
    open_store("b1").walls.keep(grids[0], "map.yaml")

    def keep_and_load(grid: OccupancyGrid) -> bool:
        walls = open_store("b1").walls
        return all(
            walls.keep(grid, "map.yaml") and walls.load("map.yaml") is not None for _ in range(30)
        )

    with ThreadPoolExecutor(2) as pool:
        assert all(pool.map(keep_and_load, grids))


def test_a_free_name_is_that_of_no_kept_walls(store: MemoryStore) -> None:
    first = store.walls.free_name()
    store.walls.keep(SMALL, first)

    assert store.walls.free_name() != first
