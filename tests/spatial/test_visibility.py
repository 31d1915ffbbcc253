"""Rays and lines over a map."""

import math

import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.spatial.visibility import cast_rays, mean_on_line, measure_sight

HALL = grid_from_text(
    """
    ##########
    #........#
    #....#...#
    #........#
    ##########
    """
)
TO_THE_RIGHT = np.zeros(1)


def middle_of(row: int, col: int) -> np.ndarray:
    return np.array([[row + 0.5, col + 0.5]])


def test_a_ray_follows_the_floor_up_to_the_first_wall_and_not_behind_it() -> None:
    rays = cast_rays(
        HALL.cells.shape, middle_of(2, 1), angles_rad=TO_THE_RIGHT, steps=np.arange(9.0)
    )
    assert rays.follow(HALL.free)[0, 0].tolist() == [True] * 4 + [False] * 5


def test_a_ray_that_leaves_the_array_is_outside_from_there_on() -> None:
    rays = cast_rays(
        HALL.cells.shape, middle_of(1, 8), angles_rad=TO_THE_RIGHT, steps=np.arange(4.0)
    )
    assert rays.is_inside[0, 0].tolist() == [True, True, False, False]
    assert rays.cells[0, 0].tolist() == [18, 19, 19, 19]


def test_rays_that_begin_beside_the_middle_of_a_cell_pass_the_cells_on_their_own_line() -> None:
    starts = np.array([[1.9, 1.1], [1.1, 1.9]])
    up = np.array([math.pi / 2])
    rays = cast_rays(HALL.cells.shape, starts, angles_rad=up, steps=np.array([0.0, 0.5, 1.0]))
    assert (rays.cells[:, 0] // HALL.n_cols).tolist() == [[1, 2, 2], [1, 1, 2]]


@pytest.mark.parametrize(("reach", "sight"), [(20.0, 4.0), (2.0, 2.0)])
def test_sight_ends_at_an_obstacle_or_where_it_is_to_end(reach: float, sight: float) -> None:
    rows, cols = np.nonzero(HALL.occupied)
    at = np.indices(HALL.cells.shape).reshape(2, -1)
    off = np.hypot(at[0][:, None] - rows, at[1][:, None] - cols).min(axis=1)
    clearance = off.reshape(HALL.cells.shape).astype(np.float32)
    measured = measure_sight(clearance, middle_of(2, 1), TO_THE_RIGHT, begin=0.0, reach=reach)
    assert measured[0] == pytest.approx(sight, abs=0.5)


def test_a_line_through_a_corner_touches_all_four_cells_that_meet_there() -> None:
    values = np.ones((3, 3))
    values[0, 1] = np.inf
    assert mean_on_line(values, np.array([0.5, 0.5]), np.array([1.5, 1.5])) == np.inf
    assert mean_on_line(values, np.array([1.5, 0.5]), np.array([2.5, 1.5])) == 1.0


def test_the_mean_on_a_line_weighs_each_cell_by_its_share_of_the_line() -> None:
    values = np.array([[1.0, 2.0, 3.0, 4.0]])
    assert mean_on_line(values, np.array([0.5, 0.5]), np.array([0.5, 3.0])) == pytest.approx(2.2)
    assert mean_on_line(values, np.array([0.2, 1.5]), np.array([0.2, 1.5])) == 2.0
