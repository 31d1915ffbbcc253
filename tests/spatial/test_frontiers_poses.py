import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapspeak.geometry import Point, Pose
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.frontiers import Frontier, find_frontiers
from mapspeak.spatial.frontiers.judging import merge_by_place
from mapspeak.spatial.paths import Path, clearance_m

RADIUS_M = 0.28
COMFORT_M = 0.1


def hall_with_passage(width: int) -> OccupancyGrid:
    """A hall of 4 m by 4 m with a passage of so many cells to the east, unknown after 0.3 m."""
    cells = np.full((100, 200), 100, np.int8)
    cells[10:90, 10:90] = 0
    cells[50 : 50 + width, 90:96] = 0
    cells[50 : 50 + width, 96:190] = -1
    return OccupancyGrid(cells=cells, resolution_m=0.05)


def room_m(grid: OccupancyGrid, frontier: Frontier) -> float:
    cell = grid.cell_at(frontier.pose.point)
    return float(clearance_m(grid)[cell.row, cell.col])


def test_a_pose_has_more_room_than_the_robot_needs() -> None:
    cells = np.full((100, 200), -1, np.int8)
    cells[10:90, 10:100] = 0
    cells[[9, 90], 9:130] = 100
    cells[9:91, 9] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    frontiers = find_frontiers(grid, Point(2.0, 2.5), radius_m=RADIUS_M).frontiers
    assert frontiers
    assert all(room_m(grid, each) >= RADIUS_M + COMFORT_M for each in frontiers)


def test_before_a_passage_without_room_to_spare_the_pose_is_where_there_is_more() -> None:
    grid = hall_with_passage(width=12)
    (frontier,) = find_frontiers(grid, Point(1.5, 1.5), radius_m=RADIUS_M).frontiers
    assert room_m(grid, frontier) >= RADIUS_M + COMFORT_M
    sight = Path.through((frontier.pose.point, frontier.anchor)).sampled(0.001)
    assert all(grid.is_free(grid.cell_at(point)) for point in sight)
    assert frontier.pose.point.distance_to(frontier.anchor) <= RADIUS_M + 0.5


def test_deep_in_a_narrow_passage_the_pose_is_in_its_middle() -> None:
    cells = np.full((60, 200), 100, np.int8)
    cells[20:33, 10:120] = 0
    cells[20:33, 120:] = -1
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    (frontier,) = find_frontiers(grid, Point(1.0, 1.325), radius_m=RADIUS_M).frontiers
    assert frontier.pose.y == pytest.approx(26.5 * 0.05)
    assert np.cos(frontier.pose.yaw_rad) > 0.9


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=8)
def test_a_pose_is_never_nearer_to_a_wall_than_the_radius(seed: int) -> None:
    coarse = np.random.default_rng(seed).choice([-1, 0, 0, 0, 0, 100], size=(12, 12))
    coarse[5:7, 5:7] = 0
    cells = coarse.repeat(8, axis=0).repeat(8, axis=1).astype(np.int8)
    grid = OccupancyGrid(cells=cells, resolution_m=0.08)
    report = find_frontiers(grid, grid.point_at(Cell(48, 48)), radius_m=RADIUS_M)
    assert all(room_m(grid, each) >= RADIUS_M for each in report.frontiers)


def frontier_at(x: float, *, gain_m2: float) -> Frontier:
    return Frontier(
        id="",
        points=np.array([[x, 0.0]]),
        anchor=Point(x, 0.0),
        length_m=1.0,
        gain_m2=gain_m2,
        distance_m=2.0,
        openness_m=3.0,
        pose=Pose(x, 0.0, 0.0),
    )


def test_borders_that_are_looked_over_from_one_place_are_one_frontier() -> None:
    found = [
        frontier_at(0.0, gain_m2=2.0),
        frontier_at(0.3, gain_m2=3.0),
        frontier_at(0.8, gain_m2=1.0),
    ]
    merged, alone = merge_by_place(found)
    assert (merged.pose.x, merged.gain_m2, merged.length_m) == (0.3, 3.0, 2.0)
    assert merged.points[:, 0].tolist() == [0.3, 0.0]
    assert alone.pose is found[2].pose
