import itertools
import math

import cv2
import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.paths import (
    Path,
    clearance_m,
    distances_from,
    find_path,
    known_clearance_m,
)

TWO_ROOMS = """
    ####################
    #........##........#
    #........##........#
    #........##........#
    #..................#
    #..................#
    #........##........#
    #........##........#
    #........##........#
    ####################
    """


def cells_of(grid: OccupancyGrid, path: Path) -> tuple[np.ndarray, np.ndarray]:
    points = path.sampled(grid.resolution_m / 50)
    return grid.cells_at(np.array([(point.x, point.y) for point in points]))


def at(grid: OccupancyGrid, row: int, col: int) -> Point:
    return grid.point_at(Cell(row, col))


def test_clearance_is_measured_in_metres_to_the_nearest_occupied_cell() -> None:
    grid = grid_from_text("#...?", resolution_m=0.5)
    assert clearance_m(grid).tolist() == [[0.0, 0.5, 1.0, 1.5, 2.0]]


@pytest.mark.parametrize("n_threads", [1, 2, 3])
def test_clearance_is_the_same_to_the_last_digit_whoever_has_time_for_it(n_threads: int) -> None:
    cells = np.where(np.random.default_rng(4).random((711, 711)) < 0.05, 100, 0).astype(np.int8)
    grid = OccupancyGrid(cells=cells, resolution_m=1.0)
    before = cv2.getNumThreads()
    cv2.setNumThreads(n_threads)
    found = clearance_m(grid)
    cv2.setNumThreads(before)
    assert (found == np.sqrt(np.rint(found.astype(np.float64) ** 2)).astype(np.float32)).all()


def test_clearance_is_infinite_where_nothing_is_occupied() -> None:
    assert np.isinf(clearance_m(grid_from_text("..."))).all()


def test_known_clearance_treats_unknown_cells_and_the_outside_as_obstacles() -> None:
    grid = grid_from_text(".....\n.....\n..?..\n.....\n.....")
    assert known_clearance_m(grid)[2].tolist() == [1.0, 1.0, 0.0, 1.0, 1.0]
    assert known_clearance_m(grid_from_text("...\n...\n..."))[1, 1] == 2.0


def test_a_path_goes_through_the_door_and_ends_exactly_at_the_goal() -> None:
    grid = grid_from_text(TWO_ROOMS, resolution_m=0.5)
    start, goal = Point(1.1, 4.2), Point(8.9, 0.8)
    path = find_path(grid, start, goal, radius_m=0.4)
    assert path is not None
    assert (path.points[0], path.points[-1]) == (start, goal)
    rows, cols = cells_of(grid, path)
    assert grid.free[rows, cols].all()
    assert path.length_m == pytest.approx(
        sum(a.distance_to(b) for a, b in itertools.pairwise(path.points))
    )


def test_a_path_keeps_the_robots_radius_from_walls() -> None:
    grid = grid_from_text(TWO_ROOMS, resolution_m=0.5)
    path = find_path(grid, Point(0.8, 2.5), Point(9.2, 2.5), radius_m=0.5)
    assert path is not None
    assert clearance_m(grid)[cells_of(grid, path)].min() >= 0.5


def test_a_gap_narrower_than_the_robot_is_no_way() -> None:
    grid = grid_from_text(TWO_ROOMS, resolution_m=0.5)
    assert find_path(grid, Point(1.0, 2.5), Point(9.0, 2.5), radius_m=0.6) is None


def test_a_path_never_leads_through_the_unknown() -> None:
    grid = grid_from_text("...?...")
    assert find_path(grid, Point(0.5, 0.5), Point(6.5, 0.5), radius_m=0.0) is None


def test_walls_that_touch_at_a_corner_leave_no_way_between() -> None:
    grid = grid_from_text(".#\n#.")
    assert find_path(grid, Point(1.5, 0.5), Point(0.5, 1.5), radius_m=0.0) is None


def test_a_path_does_not_cut_the_corner_of_a_wall() -> None:
    grid = grid_from_text("...\n.#.\n...")
    path = find_path(grid, Point(0.5, 0.5), Point(2.5, 2.5), radius_m=0.0)
    assert path is not None
    assert grid.free[cells_of(grid, path)].all()


@pytest.mark.parametrize(
    ("goal", "why"),
    [
        (Point(0.5, 0.5), "in a wall"),
        (Point(99.0, 1.0), "off the map"),
        (Point(1.5, 1.5), "nearer to a wall than the radius"),
    ],
)
def test_there_is_no_path_to_where_the_robot_cannot_stand(goal: Point, why: str) -> None:
    grid = grid_from_text("#####\n#...#\n#...#\n#...#\n#####")
    assert find_path(grid, Point(2.5, 2.5), goal, radius_m=1.5) is None, why


def test_in_the_open_a_path_is_one_straight_leg() -> None:
    grid = OccupancyGrid(cells=np.zeros((80, 120), np.int8), resolution_m=0.05)
    path = find_path(grid, Point(0.31, 0.42), Point(5.6, 3.3), radius_m=0.25)
    assert path is not None
    assert len(path.points) == 2


def test_a_path_keeps_to_the_middle_of_a_corridor() -> None:
    cells = np.zeros((22, 200), np.int8)
    cells[[0, -1]] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    path = find_path(grid, Point(0.5, 0.35), Point(9.5, 0.35), radius_m=0.2)
    assert path is not None
    middle = [point.y for point in path.points[1:-1]]
    assert middle == pytest.approx([0.55] * len(middle), abs=0.15)
    assert path.length_m < 9.3


def test_a_path_is_found_the_same_on_a_map_with_a_turned_origin() -> None:
    flat = grid_from_text(TWO_ROOMS, resolution_m=0.5)
    origin = Pose(-3.0, 7.0, 2.1)
    turned = grid_from_text(TWO_ROOMS, resolution_m=0.5, origin=origin)
    start, goal = Point(1.1, 4.2), Point(8.9, 0.8)
    plain = find_path(flat, start, goal, radius_m=0.4)
    moved = find_path(turned, origin.transform(start), origin.transform(goal), radius_m=0.4)
    assert plain is not None
    assert moved is not None
    assert moved.length_m == pytest.approx(plain.length_m, rel=0.01)
    assert turned.free[cells_of(turned, moved)].all()


@pytest.mark.parametrize("start", [Point(0.0, 1.3), Point(0.02, 1.0)])
def test_a_robot_that_seems_to_stand_in_a_wall_leaves_it_on_the_near_side(start: Point) -> None:
    cells = np.zeros((60, 60), np.int8)
    cells[:, 0] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    path = find_path(grid, start, Point(2.0, 2.0), radius_m=0.25)
    assert path is not None
    assert path.points[0] == start
    assert clearance_m(grid)[cells_of(grid, Path.through(path.points[1:]))].min() >= 0.25


def test_a_robot_whose_own_cell_is_unknown_hops_to_known_floor() -> None:
    cells = np.zeros((60, 60), np.int8)
    cells[26:34, 26:34] = -1
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    path = find_path(grid, Point(1.5, 1.5), Point(2.8, 1.5), radius_m=0.25)
    assert path is not None
    assert path.length_m == pytest.approx(1.3, abs=0.05)


def test_a_hop_does_not_go_through_a_wall() -> None:
    cells = np.full((40, 41), 0, np.int8)
    cells[:, 20] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    beside_the_wall = Point(0.95, 1.0)
    assert find_path(grid, beside_the_wall, Point(0.4, 1.0), radius_m=0.3) is not None
    assert find_path(grid, beside_the_wall, Point(1.6, 1.0), radius_m=0.3) is None


def test_a_robot_that_sees_itself_as_an_obstacle_can_leave() -> None:
    cells = np.zeros((60, 60), np.int8)
    cells[28:32, 28:32] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    for goal in (Point(0.5, 1.5), Point(2.5, 1.5)):
        assert find_path(grid, Point(1.5, 1.5), goal, radius_m=0.25) is not None


def test_a_robot_with_no_passable_cell_near_has_no_path() -> None:
    cells = np.full((80, 80), 100, np.int8)
    cells[60:, 60:] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    assert find_path(grid, Point(1.0, 1.0), Point(3.5, 3.5), radius_m=0.2) is None


def test_there_is_no_path_from_outside_the_map() -> None:
    grid = grid_from_text("...")
    assert find_path(grid, Point(-5.0, 0.5), Point(1.5, 0.5), radius_m=0.0) is None
    assert distances_from(grid, Point(-5.0, 0.5), radius_m=0.0).distance_to(Point(1, 0)) is None


def test_a_large_map_gives_as_good_a_path_through_a_narrow_door() -> None:
    cells = np.zeros((801, 803), np.int8)
    cells[401] = 100
    cells[401, 203:214] = 0
    cells[:, 700:] = -1
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(1.0, 2.0, 0.4))
    start, goal = at(grid, 100, 600), at(grid, 700, 603)
    path = find_path(grid, start, goal, radius_m=0.25)
    assert path is not None
    rows, cols = cells_of(grid, path)
    assert (grid.free & (clearance_m(grid) >= 0.25))[rows, cols].all()
    door = at(grid, 401, 208)
    shortest = start.distance_to(door) + door.distance_to(goal)
    assert shortest - 0.5 <= path.length_m <= 1.02 * shortest


def test_a_path_is_the_same_length_there_and_back() -> None:
    grid = grid_from_text(TWO_ROOMS, resolution_m=0.5)
    there = find_path(grid, Point(1.0, 4.0), Point(9.0, 1.0), radius_m=0.4)
    back = find_path(grid, Point(9.0, 1.0), Point(1.0, 4.0), radius_m=0.4)
    assert there is not None
    assert back is not None
    assert math.isclose(there.length_m, back.length_m, rel_tol=0.05)


def test_a_path_is_sampled_at_its_corners_and_in_even_steps_between_them() -> None:
    path = Path.through((Point(0.0, 0.0), Point(1.0, 0.0), Point(1.0, 0.3)))
    sampled = path.sampled(0.5)
    assert [(point.x, point.y) for point in sampled] == [(0, 0), (0.5, 0), (1, 0), (1, 0.3)]


def test_a_way_within_one_cell_is_straight() -> None:
    grid = OccupancyGrid(cells=np.zeros((40, 40), np.int8), resolution_m=0.05)
    start, goal = Point(1.01, 1.01), Point(1.02, 1.01)
    way = distances_from(grid, start, radius_m=0.2).path_to(goal)
    assert way is not None
    assert way.length_m == pytest.approx(0.01)
