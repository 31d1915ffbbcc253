import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.geometry import Point
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import DistanceField, distances_from

RING = grid_from_text(
    """
    ############
    #..........#
    #..######..#
    #..######..#
    #..........#
    #..........#
    #..........#
    ############
    """,
    resolution_m=0.5,
)
"""A block in a hall: the way above it is as short as the one below."""
WEST, EAST = Point(1.0, 2.5), Point(5.0, 2.5)


def enlarged(times: int) -> OccupancyGrid:
    cells = RING.cells.repeat(times, axis=0).repeat(times, axis=1)
    return OccupancyGrid(cells=cells, resolution_m=0.5 / times)


def highest_y(field: DistanceField, weights: np.ndarray) -> float:
    path = field.cheapest_path_to(EAST, weights)
    assert path is not None
    return max(point.y for point in path.points)


@pytest.mark.parametrize("times", [5, 80], ids=["fine cells", "cells two by two"])
def test_a_way_leads_round_floor_that_costs_more(times: int) -> None:
    grid = enlarged(times)
    field = distances_from(grid, WEST, radius_m=0.2)
    above, below = (np.ones(grid.cells.shape, dtype=np.float32) for _ in range(2))
    above[int(3.0 * grid.n_rows / 4.0) :] = 10.0
    below[: int(2.0 * grid.n_rows / 4.0)] = 10.0

    assert highest_y(field, above) < 2.6
    assert highest_y(field, below) > 3.0


def test_where_all_floor_costs_the_same_the_way_is_the_usual_one() -> None:
    field = distances_from(enlarged(5), WEST, radius_m=0.2)
    usual = field.path_to(EAST)
    assert usual is not None

    path = field.cheapest_path_to(EAST, np.ones(enlarged(5).cells.shape, dtype=np.float32))

    assert path is not None
    assert path.length_m == pytest.approx(usual.length_m, abs=0.05)


def test_there_is_no_way_where_there_is_none() -> None:
    grid = grid_from_text("..#..")
    field = distances_from(grid, Point(0.5, 0.5), radius_m=0.0)

    assert field.cheapest_path_to(Point(4.5, 0.5), np.ones((1, 5), dtype=np.float32)) is None
