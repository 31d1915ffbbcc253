import math

import numpy as np
import pytest

from mapspeak.geometry import Point, Pose
from mapspeak.simulator import World, WorldObject, WorldWall, load_world
from mapspeak.simulator.worlds.slices import Slice, fill_outlines, slice_world

UNIT_SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def world_with(*objects: WorldObject, walls: tuple[WorldWall, ...] = ()) -> World:
    return World(
        name="test", title="test", walls=walls, objects=objects, rooms=(), start=Pose(0, 0)
    )


def test_a_wall_is_a_rectangle_around_its_centre_line() -> None:
    wall = WorldWall(start=Point(1, 2), end=Point(1, 5), thickness_m=0.2, height_m=2.0)

    (outline,) = slice_world(world_with(walls=(wall,)), low_m=0.1, high_m=1.0).outlines

    assert outline.min(axis=0) == pytest.approx([0.9, 2.0])
    assert outline.max(axis=0) == pytest.approx([1.1, 5.0])


def test_a_low_wall_does_not_reach_into_a_high_slice() -> None:
    wall = WorldWall(start=Point(1, 2), end=Point(1, 5), thickness_m=0.2, height_m=0.5)

    assert not slice_world(world_with(walls=(wall,)), low_m=0.6, high_m=1.0).outlines


def test_an_object_lies_where_its_pose_puts_it() -> None:
    crate = WorldObject(name="crate", kind="crate", pose=Pose(3.0, 4.0, math.pi / 2))

    solids = slice_world(world_with(crate), low_m=0.1, high_m=1.0)

    assert solids.is_solid_at(Point(3.0, 4.0))
    assert not solids.is_solid_at(Point(5.0, 4.0))


def test_an_object_that_hangs_higher_leaves_the_slice_below_it() -> None:
    def slice_with_box_at(base_height_m: float | None) -> Slice:
        box = WorldObject(
            name="box", kind="first_aid_box", pose=Pose(0, 0), base_height_m=base_height_m
        )
        return slice_world(world_with(box), low_m=1.25, high_m=1.4)

    assert slice_with_box_at(None).outlines
    assert not slice_with_box_at(1.9).outlines
    assert not slice_with_box_at(0.2).outlines


def test_the_distance_is_that_to_the_nearest_side() -> None:
    square = Slice((UNIT_SQUARE,))

    assert square.distance_to(Point(2.0, 0.5)) == pytest.approx(1.0)
    assert square.distance_to(Point(2.0, 2.0)) == pytest.approx(math.sqrt(2))
    assert square.distance_to(Point(0.5, 0.75)) == pytest.approx(0.25)
    assert Slice(()).distance_to(Point(0.0, 0.0)) == math.inf


def test_what_is_near_is_exactly_as_near_as_in_the_whole_world() -> None:
    whole = slice_world(load_world("flat_1"), low_m=0.02, high_m=1.2)
    random = np.random.default_rng(1)
    corners = np.concatenate(whole.outlines)
    for x, y in random.uniform(corners.min(axis=0), corners.max(axis=0), (50, 2)).tolist():
        near = whole.near(Point(x, y), reach_m=2.0)
        beside = Point(x + random.uniform(-0.7, 0.7), y + random.uniform(-0.7, 0.7))
        away_m = whole.distance_to(beside)
        if away_m <= 1.0:
            assert near.distance_to(beside) == away_m
    assert len(near.outlines) < len(whole.outlines)


def test_nothing_is_near_in_an_empty_world_or_far_from_everything() -> None:
    assert not Slice(()).near(Point(0.0, 0.0), reach_m=1.0).outlines
    assert not Slice((UNIT_SQUARE,)).near(Point(9.0, 9.0), reach_m=1.0).outlines


def test_each_outline_is_closed_by_its_own_first_corner() -> None:
    triangle = np.array([[5.0, 5.0], [6.0, 5.0], [5.5, 6.0]])
    edges = Slice((UNIT_SQUARE, triangle)).edges
    assert edges.tolist() == [
        *([*UNIT_SQUARE[at], *UNIT_SQUARE[(at + 1) % 4]] for at in range(4)),
        *([*triangle[at], *triangle[(at + 1) % 3]] for at in range(3)),
    ]


def test_a_body_has_room_where_nothing_is_nearer_than_its_radius() -> None:
    square = Slice((UNIT_SQUARE,))

    assert square.has_room_at(Point(1.5, 0.5), radius_m=0.5)
    assert not square.has_room_at(Point(1.5, 0.5), radius_m=0.51)
    assert not square.has_room_at(Point(0.5, 0.5), radius_m=0.1)


def test_cells_are_filled_where_half_of_them_lies_inside() -> None:
    mask = fill_outlines([UNIT_SQUARE], shape=(4, 4), origin=Point(-0.5, -0.5), cell_size_m=0.5)

    drawing = ["".join("#" if inside else "." for inside in row) for row in mask[::-1]]
    assert drawing == [
        "....",
        ".##.",
        ".##.",
        "....",
    ]


@pytest.mark.parametrize("shift", [(0.0, 0.0), (-0.7, 0.3), (0.9, 0.9), (-3.0, 0.0), (0.2, 5.0)])
def test_a_mask_is_a_part_of_any_larger_mask(shift: tuple[float, float]) -> None:
    outlines = [UNIT_SQUARE + shift, UNIT_SQUARE @ [[0.6, -0.8], [0.8, 0.6]] + shift]

    small = fill_outlines(outlines, shape=(5, 4), origin=Point(-0.5, -0.5), cell_size_m=0.25)
    large = fill_outlines(outlines, shape=(80, 80), origin=Point(-10.5, -10.5), cell_size_m=0.25)

    assert (small == large[40:45, 40:44]).all()
    assert large.sum() * 0.25**2 == pytest.approx(2.0 - 0.4, abs=0.4)


def test_where_nothing_is_solid_no_cell_is() -> None:
    assert not fill_outlines([], shape=(3, 3), origin=Point(0, 0), cell_size_m=0.5).any()
