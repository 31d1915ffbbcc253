"""A robot that has got into a place gets out of it, though the gap now looks a cell too narrow."""

import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.geometry import Point
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import distances_from

RADIUS_M = 0.25
NOOK, HALL, CLOSET = Point(1.0, 0.7), Point(3.5, 0.7), Point(6.8, 0.7)
NARROW, TOO_NARROW = 7, 5
"""Cells of 0.05 m: a robot of radius 0.25 m wants nine."""


def nook_beside_a_hall(gap: int, *, resolution_m: float = 0.05) -> OccupancyGrid:
    """A nook, a hall and a closet, 1.3 m high, with gaps of so many cells."""
    n_rows, n_nook, n_hall = (round(side_m / resolution_m) for side_m in (1.3, 1.5, 4.0))
    below = (n_rows - gap) // 2
    wall = ["#"] * (n_rows - gap - below) + ["."] * gap + ["#"] * below
    rows = ["#" + "." * n_nook + post + "." * n_hall + post + "." * n_nook + "#" for post in wall]
    edge = "#" * len(rows[0])
    return grid_from_text("\n".join([edge, *rows, edge]), resolution_m=resolution_m)


def test_a_robot_in_a_nook_gets_out_by_a_gap_that_lacks_a_cell_on_each_side() -> None:
    field = distances_from(nook_beside_a_hall(NARROW), NOOK, radius_m=RADIUS_M, leaves_pockets=True)

    assert field.distance_to(HALL) == pytest.approx(2.5, abs=0.3)
    path = field.path_to(HALL)
    assert path is not None
    assert path.length_m == pytest.approx(2.5, abs=0.3)
    assert field.reachable[14, 70]


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
        OccupancyGrid(cells=cells, resolution_m=0.05), NOOK, radius_m=RADIUS_M, leaves_pockets=True
    )

    assert field.distance_to(HALL) == pytest.approx(2.5, abs=0.4)
    assert field.path_to(HALL) is not None


def test_a_coarse_map_leaves_no_doubt_about_a_gap() -> None:
    """Three cells of 0.1 m lack a cell on each side, and that is a third of the robot."""
    field = distances_from(
        nook_beside_a_hall(3, resolution_m=0.1), NOOK, radius_m=RADIUS_M, leaves_pockets=True
    )

    assert field.distance_to(HALL) is None


def test_who_asks_from_elsewhere_finds_the_gap_as_narrow_as_it_is() -> None:
    from_nook = distances_from(
        nook_beside_a_hall(NARROW), NOOK, radius_m=RADIUS_M, leaves_pockets=True
    )

    from_hall = from_nook.from_elsewhere(HALL)

    assert from_nook.distance_to(HALL) is not None
    assert from_hall.distance_to(NOOK) is None
    assert from_hall.from_elsewhere(NOOK).distance_to(HALL) is not None


def test_a_clearance_that_must_be_kept_is_kept() -> None:
    field = distances_from(nook_beside_a_hall(NARROW), NOOK, radius_m=RADIUS_M)

    assert field.distance_to(HALL) is None
