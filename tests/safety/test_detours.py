"""Legs round closed areas, on maps fine enough for margins of centimetres to matter."""

import itertools

import numpy as np
import pytest

from guarding import corners
from mapspeak.geometry import Point, Pose
from mapspeak.safety.planning import STRAY_M, plan_legs
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import find_path
from mapspeak.worldmodel.keepout import MARGIN_M, ClosedArea
from mapspeak.worldmodel.revision import Hindrance, MapRevision

RADIUS_M = 0.3
CELL_M = 0.05


def floor(*, wall_above_m: float = 5.0) -> OccupancyGrid:
    """Gives a floor of 8 m by 6 m with a wall over its whole length."""
    cells = np.zeros((120, 160), dtype=np.int8)
    cells[round(wall_above_m / CELL_M) :] = 100
    return OccupancyGrid(cells=cells, resolution_m=CELL_M, origin=Pose(0.0, 0.0))


def revision(pit: ClosedArea, grid: OccupancyGrid) -> MapRevision:
    return MapRevision(grid, radius_m=RADIUS_M, areas=(pit,))


def nearest_m(area: ClosedArea, points: list[Point]) -> float:
    """Gives how near straight lines come to an area."""
    between = (
        Point(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y))
        for a, b in itertools.pairwise(points)
        for share in np.linspace(0.0, 1.0, 50).tolist()
    )
    return min(area.distance_to(point) for point in between)


PIT = ClosedArea(name="pit", outline=corners((3.0, 0.0), (4.5, 2.0)))


@pytest.mark.parametrize("y", [0.5, 1.0, 1.9, 2.2, 2.33])
def test_legs_keep_the_margin_and_are_few(y: float) -> None:
    start = Point(1.0, y)
    legs = plan_legs(revision(PIT, floor()), start, Pose(7.0, y))
    points = [start, *(each.point for each in legs)]
    assert nearest_m(PIT, points) >= RADIUS_M + MARGIN_M - STRAY_M - CELL_M
    assert 2 <= len(legs) <= 8


def test_a_way_that_is_clear_by_itself_is_one_leg() -> None:
    goal = Pose(7.0, 3.5)
    assert plan_legs(revision(PIT, floor()), Point(1.0, 3.5), goal) == (goal,)


def test_a_robot_that_keeps_off_the_wall_beside_an_area_gets_legs_that_it_goes_straight() -> None:
    """Between wall and area there is room for the robot, but not for the way it would choose."""
    strip = ClosedArea(name="strip", outline=corners((2.0, 0.0), (6.0, 2.0)))
    narrow = floor(wall_above_m=2.0 + 2 * RADIUS_M + 0.4)
    start, goal = Point(1.0, 2.5), Pose(7.0, 2.5)
    legs = plan_legs(revision(strip, narrow), start, goal)
    points = [start, *(each.point for each in legs)]
    for pair in itertools.pairwise(points):
        if pair[0].distance_to(pair[1]) > 0.5:
            own = find_path(narrow, *pair, radius_m=RADIUS_M)
            assert own is not None
            assert nearest_m(strip, list(own.points)) >= RADIUS_M + 0.05


@pytest.mark.parametrize(("y", "n_legs"), [(1.0, 2), (4.5, 1)])
def test_a_robot_is_led_round_a_hindrance_only_where_its_own_way_crosses_it(
    y: float, n_legs: int
) -> None:
    area = ClosedArea(name="wet floor", outline=corners((3.0, 0.0), (4.5, 2.0)))
    wet = Hindrance(area=area, extra_m=5.0, factor=3.0)
    hindered = MapRevision(floor(), radius_m=RADIUS_M, hindrances=(wet,))
    start, goal = Point(1.0, y), Pose(7.0, y)
    legs = plan_legs(hindered, start, goal)
    assert len(legs) >= n_legs
    assert (len(legs) == 1) == (n_legs == 1)
    assert legs[-1] == goal
    assert nearest_m(area, [start, *(each.point for each in legs)]) > 0
