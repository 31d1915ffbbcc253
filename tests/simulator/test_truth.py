from pathlib import Path

from mapspeak.geometry import Point
from mapspeak.simulator import is_in_sight
from sites import make_flat


def test_what_hangs_on_a_wall_is_not_seen_from_behind_the_wall(tmp_path: Path) -> None:
    world = make_flat(tmp_path)
    extinguisher = next(thing for thing in world.objects if thing.kind == "fire_extinguisher")
    assert is_in_sight(world, Point(6.0, 1.5), extinguisher)
    assert not is_in_sight(world, Point(8.5, 1.5), extinguisher)
