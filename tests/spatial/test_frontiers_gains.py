import numpy as np
import pytest

from mapspeak.geometry import Point
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.frontiers import FrontierReport, find_frontiers
from mapspeak.spatial.frontiers.viewpoints import find_views
from mapspeak.spatial.paths import clearance_m

RADIUS_M = 0.2


def half_known_hall(*, n_pillars: int) -> OccupancyGrid:
    """A hall of 8 m by 16 m whose western half is known, with rows of pillars in it."""
    cells = np.full((180, 340), 100, np.int8)
    cells[10:170, 10:330] = -1
    cells[10:170, 10:170] = 0
    for row in range(30, 30 + 30 * n_pillars, 30):
        cells[row : row + 10, 30:160:30] = 100
    return OccupancyGrid(cells=cells, resolution_m=0.05)


def find(grid: OccupancyGrid) -> FrontierReport:
    return find_frontiers(grid, Point(1.0, 1.0), radius_m=RADIUS_M)


def test_less_is_promised_where_things_stand_in_the_way_on_the_known_floor() -> None:
    open_hall, full_hall = (
        find(half_known_hall(n_pillars=n_pillars)).frontiers[0] for n_pillars in (0, 5)
    )
    assert full_hall.openness_m < open_hall.openness_m
    assert full_hall.gain_m2 < open_hall.gain_m2


def test_no_more_is_promised_than_lies_within_sight() -> None:
    cells = np.full((400, 400), -1, np.int8)
    cells[190:210, 190:210] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    (frontier,) = find_frontiers(grid, Point(10.0, 10.0), radius_m=RADIUS_M).frontiers
    assert 0 < frontier.gain_m2 <= np.pi * 8.0**2


def test_nothing_is_promised_behind_a_wall() -> None:
    cells = np.zeros((200, 200), np.int8)
    cells[:, 100] = 100
    cells[:, 101:] = -1
    grid = OccupancyGrid(cells=np.pad(cells, 1, constant_values=100), resolution_m=0.05)
    views = find_views(grid, clearance_m(grid), [Cell(100, 50)])
    assert views.find_gains()[0].area_m2 == 0.0


def test_known_floor_is_no_gain_and_unknown_in_sight_counts_in_full_where_nothing_hides_it() -> (
    None
):
    cells = np.full((401, 401), -1, np.int8)
    cells[:, 200:] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    views = find_views(grid, clearance_m(grid), [Cell(200, 200)])
    assert views.areas_m2(1e9).sum() == pytest.approx(np.pi * 8.0**2 / 2, rel=0.05)
    prospect = views.find_gains()[0]
    assert prospect.bearing_rad is not None
    assert np.cos(prospect.bearing_rad) == pytest.approx(-1.0, abs=0.01)


def test_rays_last_as_far_in_the_unknown_as_the_map_lets_them() -> None:
    cells = np.full((401, 401), -1, np.int8)
    cells[200, 200] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    views = find_views(grid, clearance_m(grid), [Cell(200, 200)])
    reach_m = 2.0
    shares = np.linspace(0.0, 8.0, 4000)
    expected_m2 = 2 * np.pi * np.trapezoid(shares * np.exp(-shares / reach_m), shares)
    assert views.areas_m2(reach_m).sum() == pytest.approx(expected_m2, rel=0.05)


@pytest.mark.parametrize("resolution_m", [0.025, 0.05, 0.1])
def test_openness_is_how_far_one_sees_on_known_floor(resolution_m: float) -> None:
    n_cells = round(6.0 / resolution_m)
    cells = np.pad(np.zeros((n_cells, n_cells), np.int8), 1, constant_values=100)
    grid = OccupancyGrid(cells=cells, resolution_m=resolution_m)
    middle = Cell(n_cells // 2, n_cells // 2)
    views = find_views(grid, clearance_m(grid), [middle])
    assert views.openness_m == pytest.approx(3.2, abs=0.4)


def test_holes_that_beams_have_left_in_a_wall_show_nothing() -> None:
    cells = np.full((200, 200), -1, np.int8)
    cells[:, :100] = 0
    cells[:, 100] = 100
    cells[::12, 100] = cells[1::12, 100] = cells[2::12, 100] = -1
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    views = find_views(grid, clearance_m(grid), [Cell(100, 60)])
    east = views.areas_m2(1e9)[0, [71, 0, 1]]
    assert east.sum() == 0.0
