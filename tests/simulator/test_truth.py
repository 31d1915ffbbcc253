from dataclasses import replace
from pathlib import Path

import pytest

from mapspeak.geometry import Point, Pose
from mapspeak.simulator import WorldObject, is_in_sight, load_world
from sites import make_flat


def test_what_hangs_on_a_wall_is_not_seen_from_behind_the_wall(tmp_path: Path) -> None:
    world = make_flat(tmp_path)
    extinguisher = next(thing for thing in world.objects if thing.kind == "fire_extinguisher")
    assert is_in_sight(world, Point(6.0, 1.5), extinguisher)
    assert not is_in_sight(world, Point(8.5, 1.5), extinguisher)


@pytest.mark.parametrize("kind", ["cabinet", "printer"])
def test_what_stands_at_a_wall_is_not_seen_from_behind_the_wall(tmp_path: Path, kind: str) -> None:
    flat = make_flat(tmp_path)
    thing = WorldObject(name="it", kind=kind, pose=Pose(3.5, 3.36, 1.57))
    world = replace(flat, objects=(*flat.objects, thing))
    assert is_in_sight(world, Point(3.5, 5.0), thing)
    assert is_in_sight(world, Point(1.0, 5.0), thing)
    assert not is_in_sight(world, Point(3.5, 1.5), thing)
    assert not is_in_sight(world, Point(4.5, 2.5), thing)


def test_what_stands_in_front_of_a_thing_hides_it(tmp_path: Path) -> None:
    flat = make_flat(tmp_path)
    screen = tuple(
        WorldObject(name=f"screen {nth}", kind="cabinet", pose=Pose(5.5, 0.5 + 0.5 * nth, 0.0))
        for nth in range(5)
    )
    (extinguisher,) = (thing for thing in flat.objects if thing.kind == "fire_extinguisher")
    assert is_in_sight(flat, Point(4.0, 1.5), extinguisher)
    hidden = replace(flat, objects=(*flat.objects, *screen))
    assert not is_in_sight(hidden, Point(4.0, 1.5), extinguisher)


def test_a_large_thing_does_not_hide_itself() -> None:
    world = load_world("warehouse")
    forklift = next(thing for thing in world.objects if thing.name == "forklift 1")
    behind = forklift.pose.transform(Point(-2.2, 0.0))
    assert is_in_sight(world, behind, forklift)
