from pathlib import Path

import pytest

from mapspeak.errors import ConfigError
from mapspeak.geometry import Pose
from mapspeak.simulator import WorldObject, load_world
from mapspeak.simulator.worlds.worldfiles import write_with_more

CRATE = WorldObject(name="added crate", kind="crate", pose=Pose(3.0, 5.0, 0.5))


def test_a_world_with_one_more_thing_is_a_world_file_again(tmp_path: Path) -> None:
    changed = load_world(write_with_more("warehouse", [CRATE], tmp_path / "warehouse.yaml"))
    before = load_world("warehouse")
    assert changed.name == before.name
    assert changed.objects[:-1] == before.objects
    assert changed.objects[-1].pose.point == CRATE.pose.point
    assert changed.walls == before.walls


def test_a_map_has_no_things_to_add_to(tmp_path: Path) -> None:
    path = tmp_path / "map.yaml"
    path.write_text("image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    with pytest.raises(ConfigError, match="is a map"):
        write_with_more(path, [CRATE], tmp_path / "changed.yaml")
