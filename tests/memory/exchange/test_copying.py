"""A whole memory copied into an empty one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMapStore, Waypoint
from mapspeak.memory.events import Event
from mapspeak.memory.exchange.copying import copy_memory
from mapspeak.memory.frames import MapFrame
from mapspeak.spatial import OccupancyGrid

WALLS = OccupancyGrid(cells=np.array([[0, 100], [0, -1]], dtype=np.int8), resolution_m=0.05)


@pytest.fixture
def source(tmp_path: Path) -> SemanticMapStore:
    store = SemanticMapStore(tmp_path / "source.yaml", map_id="house")
    hose = Landmark(label="hose", bearing_rad=0.5, range_m=2.0)
    dock = Waypoint(name="dock", pose=Pose(1.0, 2.0, 0.5), functional_landmarks=(hose,))
    store.write(dock)
    store.write_frames(lambda frames: frames.added(MapFrame(id="F2", map_id="yard")))
    store.write(replace(dock, name="gate", frame="F2"))
    store.walls.keep(WALLS, "map.yaml")
    store.write_event(Event(text="wet", at=Point(1.0, 0.0)))
    return store


def test_a_copy_says_what_the_memory_says(source: SemanticMapStore, tmp_path: Path) -> None:
    target = SemanticMapStore(tmp_path / "target.yaml")

    copied = copy_memory(source, target)

    assert (copied.n_places, copied.n_events, copied.n_frames) == (2, 1, 1)
    assert target.read() == source.read()
    assert target.read_events() == source.read_events()
    walls = target.walls.load("map.yaml")
    assert walls is not None
    assert (walls.cells == WALLS.cells).all()


def test_a_memory_of_events_alone_is_of_the_same_map_when_it_is_copied(tmp_path: Path) -> None:
    source = SemanticMapStore(tmp_path / "source.yaml", map_id="house")
    source.write_event(Event(text="wet"))
    target = SemanticMapStore(tmp_path / "target.yaml")

    copy_memory(source, target)

    assert target.read().map_id == "house"


def test_nothing_is_copied_into_a_memory_that_says_something(
    source: SemanticMapStore, tmp_path: Path
) -> None:
    target = SemanticMapStore(tmp_path / "target.yaml")
    target.write(Waypoint(name="hall", pose=Pose(0.0, 0.0, 0.0)))
    before = target.read()

    with pytest.raises(SemanticMapError, match="has places already"):
        copy_memory(source, target)

    assert target.read() == before
