from dataclasses import replace
from pathlib import Path

import pytest

from mapspeak.errors import ConfigError
from mapspeak.geometry import Pose
from mapspeak.simulator import WorldObject, load_world
from mapspeak.simulator.worlds.worldfiles import write_as_changed

CRATE = WorldObject(name="added crate", kind="crate", pose=Pose(3.0, 5.0, 0.5))


def test_a_world_with_one_more_thing_is_a_world_file_again(tmp_path: Path) -> None:
    before = load_world("warehouse")
    more = replace(before, objects=(*before.objects, CRATE))
    changed = load_world(write_as_changed("warehouse", more, tmp_path / "warehouse.yaml"))
    assert changed.name == before.name
    assert changed.objects[:-1] == before.objects
    assert changed.objects[-1].pose.point == CRATE.pose.point
    assert changed.walls == before.walls


def test_a_map_has_no_things_to_add_to(tmp_path: Path) -> None:
    path = tmp_path / "map.yaml"
    path.write_text("image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    with pytest.raises(ConfigError, match="is a map"):
        write_as_changed(path, load_world("flat_1"), tmp_path / "changed.yaml")


def test_doors_battery_and_faults_may_be_otherwise(tmp_path: Path) -> None:
    before = load_world("office")
    doors = (replace(before.doors[0], is_shut=True), *before.doors[1:])
    wanted = replace(before, doors=doors, battery_ratio=0.2, n_faults={"speak": 2})
    changed = load_world(write_as_changed("office", wanted, tmp_path / "office.yaml"))
    assert [door.is_shut for door in changed.doors] == [door.is_shut for door in doors]
    assert (changed.battery_ratio, changed.n_faults) == (0.2, {"speak": 2})
