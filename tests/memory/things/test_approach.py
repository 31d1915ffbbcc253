"""Where one stands to look at a thing."""

import math

import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.memory.things.approach import find_stands, measure_faced
from mapspeak.memory.things.sight import build_sight_map
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.paths import clearance_m, distances_from

WITH_CUPBOARD = """
    #########################
    #.........#####.........#
    #.........#####.........#
    #.........#####.........#
    #.........#####.........#
    #.......................#
    #.......................#
    #.......................#
    #.......................#
    #.......................#
    #########################
"""


def test_one_stands_before_a_thing_whose_middle_lies_deep_in_its_own_body() -> None:
    grid = grid_from_text(WITH_CUPBOARD, resolution_m=0.25)
    middle, viewer = Point(3.1, 2.0), Point(3.1, 0.5)
    distances = distances_from(grid, Point(1.0, 0.6), radius_m=0.2)
    pose = find_stands(build_sight_map(grid), distances, middle, [viewer]).choose(distances)
    assert pose is not None
    assert pose.y < 1.5
    assert pose.point.distance_to(middle) <= 1.5
    assert math.isclose(pose.yaw_rad, pose.point.bearing_to(middle))


HALL = """
    ########################################
    #......................................#
    #......................................#
    #......................................#
    #......................................#
    #......................................#
    #......................................#
    #......................................#
    #......................................#
    #......................................#
    ########################################
"""


def spread_along_north_wall(half_width_m: float) -> FloatArray:
    xs = np.linspace(3.0 - half_width_m, 3.0 + half_width_m, 21)
    return np.stack([xs, np.full(21, 1.55)], axis=1)


def test_the_less_is_known_of_where_a_thing_is_the_more_of_it_one_stands_back_to_face() -> None:
    grid = grid_from_text(HALL, resolution_m=0.15)
    sight, distances = build_sight_map(grid), distances_from(grid, Point(1.0, 0.6), radius_m=0.2)
    target, seen_from = Point(3.0, 1.55), [Point(2.5, 0.4)]
    known, vague = (spread_along_north_wall(half_width_m) for half_width_m in (0.1, 0.9))
    near = find_stands(sight, distances, target, seen_from, whereabouts=known).choose(distances)
    back = find_stands(sight, distances, target, seen_from, whereabouts=vague).choose(distances)
    assert near is not None
    assert back is not None
    assert back.point.distance_to(target) > near.point.distance_to(target)
    assert measure_faced(sight, near, seen_from, known) == 1.0
    assert measure_faced(sight, back, seen_from, vague) > measure_faced(
        sight, near, seen_from, vague
    )


def test_what_lies_behind_a_wall_or_behind_ones_back_is_not_faced() -> None:
    grid = grid_from_text(WITH_CUPBOARD, resolution_m=0.25)
    sight, viewer = build_sight_map(grid), Point(2.0, 2.0)
    beside = np.array([[2.6, 2.0]])
    assert measure_faced(sight, Pose(1.6, 2.0, 0.0), [viewer], beside) == 1.0
    assert measure_faced(sight, Pose(1.6, 2.0, math.pi), [viewer], beside) == 0.0
    assert measure_faced(sight, Pose(4.0, 2.0, math.pi), [viewer], beside) == 0.0


@pytest.mark.parametrize("robot", [Point(1.0, 3.0), Point(7.0, 3.0), Point(4.0, 1.0)])
def test_a_thing_that_stands_free_is_faced_from_the_side_on_which_the_robot_is(
    robot: Point,
) -> None:
    cells = np.full((60, 80), 100, dtype=np.int8)
    cells[1:-1, 1:-1] = 0
    cells[29:31, 39:41] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.1)
    distances, thing = distances_from(grid, robot, radius_m=0.2), Point(4.0, 3.0)

    pose = find_stands(build_sight_map(grid), distances, thing, [Point(1.0, 1.0)]).choose(distances)

    assert pose is not None
    assert pose.point.distance_to(robot) < robot.distance_to(thing) - 0.5


@pytest.mark.parametrize("seed", range(6))
def test_no_place_is_so_tight_that_a_planner_may_refuse_it_where_there_is_another(
    seed: int,
) -> None:
    cells = np.full((40, 60), 100, dtype=np.int8)
    cells[1:-1, 1:-1] = 0
    for row, col in np.random.default_rng(seed).integers((3, 3), (36, 56), (25, 2)).tolist():
        cells[row : row + 2, col : col + 2] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.1)
    start = grid.point_at(Cell(*np.argwhere(grid.free)[0].tolist()))
    distances, sight = distances_from(grid, start, radius_m=0.2), build_sight_map(grid)
    for row, col in np.argwhere(cells[5:-5:7, 5:-5:7] == 0).tolist():
        thing = grid.point_at(Cell(5 + 7 * row, 5 + 7 * col))
        around = thing_spread(thing)
        stands = find_stands(sight, distances, thing, [start], whereabouts=around)
        rows, cols = grid.cells_at(stands.points)
        clear_m = clearance_m(grid)[rows, cols]
        assert clear_m.min(initial=1.0) >= 0.25 or clear_m.max() < 0.25


def thing_spread(thing: Point) -> FloatArray:
    return np.array([[thing.x + dx, thing.y] for dx in (-0.3, 0.0, 0.3)])
