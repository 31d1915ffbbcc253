"""A robot that has got into a place gets out of it, though the gap now looks a cell too narrow."""

import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.geometry import Point
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import distances_from

RADIUS_M = 0.25
NOOK, HALL, CLOSET = Point(1.0, 0.7), Point(3.5, 0.7), Point(6.8, 0.7)
NARROW, TOO_NARROW = 4, 2
"""Cells of 0.1 m: a robot of radius 0.25 m wants five."""


def nook_beside_a_hall(gap: int, *, scale: int = 1) -> OccupancyGrid:
    """A nook, a hall and a closet, with gaps of so many cells of 0.1 m."""
    n_walls = 13 - gap
    below, above = n_walls // 2, n_walls - n_walls // 2
    wall = ["#"] * above + ["."] * gap + ["#"] * below
    rows = ["#" + "." * 15 + post + "." * 40 + post + "." * 15 + "#" for post in wall]
    edge = "#" * len(rows[0])
    grid = grid_from_text("\n".join([edge, *rows, edge]), resolution_m=0.1)
    cells = grid.cells.repeat(scale, axis=0).repeat(scale, axis=1)
    return OccupancyGrid(cells=cells, resolution_m=grid.resolution_m / scale)


def test_a_robot_in_a_nook_gets_out_through_a_gap_that_lacks_less_than_a_cell() -> None:
    field = distances_from(nook_beside_a_hall(NARROW), NOOK, radius_m=RADIUS_M, leaves_pockets=True)

    assert field.distance_to(HALL) == pytest.approx(2.5, abs=0.3)
    path = field.path_to(HALL)
    assert path is not None
    assert path.length_m == pytest.approx(2.5, abs=0.3)
    assert field.build_reachable_mask()[7, 35]


def test_it_stays_in_where_the_gap_is_too_narrow_for_it() -> None:
    field = distances_from(
        nook_beside_a_hall(TOO_NARROW), NOOK, radius_m=RADIUS_M, leaves_pockets=True
    )

    assert field.distance_to(HALL) is None
    assert field.path_to(HALL) is None


def test_from_the_hall_no_gap_is_taken_for_wider_than_it_is() -> None:
    wide = nook_beside_a_hall(NARROW)

    field = distances_from(wide, HALL, radius_m=RADIUS_M, leaves_pockets=True)

    assert field.distance_to(NOOK) is None
    assert field.distance_to(CLOSET) is None


def test_only_the_way_out_is_opened() -> None:
    field = distances_from(nook_beside_a_hall(NARROW), NOOK, radius_m=RADIUS_M, leaves_pockets=True)

    assert field.distance_to(CLOSET) is None


def test_the_way_out_is_found_on_a_map_of_many_cells_too() -> None:
    small = nook_beside_a_hall(NARROW)
    cells = np.full((900, 900), -1, dtype=np.int8)
    cells[: small.n_rows, : small.n_cols] = small.cells
    field = distances_from(
        OccupancyGrid(cells=cells, resolution_m=0.1), NOOK, radius_m=RADIUS_M, leaves_pockets=True
    )

    assert field.distance_to(HALL) == pytest.approx(2.5, abs=0.4)
    assert field.path_to(HALL) is not None


def test_a_finer_map_gives_less_leave() -> None:
    """The gap lacks 0.1 m, which is two cells of 0.05 m."""
    field = distances_from(
        nook_beside_a_hall(NARROW, scale=2), NOOK, radius_m=RADIUS_M + 0.03, leaves_pockets=True
    )

    assert field.distance_to(HALL) is None


def test_a_clearance_that_must_be_kept_is_kept() -> None:
    field = distances_from(nook_beside_a_hall(NARROW), NOOK, radius_m=RADIUS_M)

    assert field.distance_to(HALL) is None
