import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from drawing import grid_from_text
from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.picture import (
    Colour,
    draw_map_axis,
    draw_map_plain,
    draw_robot_pose,
    paper_spacing_m,
)
from mapspeak.spatial.picture.ink import arrow_pixels
from seeing import colours_at, full_colour, is_colour, pixels_of

ROOM = """
    #####
    #...#
    #..?#
    #####
    """


def grey_levels(grid: OccupancyGrid) -> NDArray[np.uint8]:
    pixels = pixels_of(draw_map_plain(grid))
    scale = pixels.shape[1] // grid.n_cols
    return pixels[scale // 2 :: scale, scale // 2 :: scale, 0]


def test_grey_levels_follow_equation_1_for_every_occupancy() -> None:
    occupancy = np.arange(-1, 101, dtype=np.int8)
    grid = OccupancyGrid(cells=occupancy[np.newaxis], resolution_m=0.05)
    expected = [127, 255] + [255 * (1 - g / 100) for g in range(1, 101)]
    assert grey_levels(grid)[0] == pytest.approx(expected, abs=0.5 + 1e-9)


def test_no_occupancy_has_the_grey_of_unknown() -> None:
    grid = OccupancyGrid(cells=np.arange(0, 101, dtype=np.int8)[np.newaxis], resolution_m=0.05)
    assert not (grey_levels(grid) == 127).any()


def test_grey_levels_have_the_lowest_row_of_the_map_at_the_bottom() -> None:
    grid = grid_from_text("#.\n.?")
    assert grey_levels(grid).tolist() == [[0, 255], [255, 127]]


def test_the_plain_picture_is_the_grey_levels_and_nothing_else() -> None:
    grid = grid_from_text(ROOM)
    pixels = pixels_of(draw_map_plain(grid))
    scale = pixels.shape[1] // grid.n_cols
    assert pixels.shape == (grid.n_rows * scale, grid.n_cols * scale, 3)
    blocks = np.repeat(np.repeat(grey_levels(grid), scale, axis=0), scale, axis=1)
    assert (pixels == blocks[:, :, np.newaxis]).all()


@given(x=st.floats(-50, 50), y=st.floats(-50, 50))
def test_a_point_falls_where_equation_3_says(x: float, y: float) -> None:
    grid = grid_from_text(ROOM, resolution_m=0.5, origin=Pose(-3.0, 7.0))
    view = draw_map_plain(grid).view
    scale = view.width_px / grid.n_cols
    u, v = view.fractional_pixels_at(np.array([[x, y]]))[0] / scale
    assert u == pytest.approx((x - grid.origin.x) / grid.resolution_m)
    assert v == pytest.approx(grid.n_rows - (y - grid.origin.y) / grid.resolution_m)


@pytest.mark.parametrize(
    ("width_m", "height_m", "expected_m"),
    [(15.0, 40.0, 1.0), (16.0, 16.0, 2.0), (30.0, 31.0, 2.0), (31.0, 31.0, 5.0), (7.0, 7.0, 0.5)],
)
def test_the_spacing_is_the_next_intuitive_value_from_a_fifteenth_on(
    width_m: float, height_m: float, expected_m: float
) -> None:
    assert paper_spacing_m(width_m, height_m, 0.05) == pytest.approx(expected_m)


def test_the_spacing_is_never_below_one_cell() -> None:
    assert paper_spacing_m(3.0, 3.0, 0.5) == pytest.approx(0.5)


def test_lines_across_a_very_long_map_stay_apart() -> None:
    assert paper_spacing_m(200.0, 1.0, 0.05) >= 200.0 / 90


def test_an_arrow_point_moves_as_equation_7_says() -> None:
    theta = 0.3
    (right, down), *_ = arrow_pixels(np.array([[2.0, 1.0]]), theta)
    assert right == pytest.approx(2 * math.cos(theta) - math.sin(theta))
    assert down == pytest.approx(-(2 * math.sin(theta) + math.cos(theta)))


@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, math.pi / 2, -2.5])
def test_the_arrow_points_along_the_heading_from_where_the_robot_is(yaw_rad: float) -> None:
    grid = OccupancyGrid(
        cells=np.zeros((60, 80), dtype=np.int8), resolution_m=0.1, origin=Pose(100.0, -20.0)
    )
    picture = draw_robot_pose(grid, Pose(104.0, -17.0, yaw_rad))
    rows, cols = np.nonzero(is_colour(pixels_of(picture), full_colour(Colour.VERMILION)))
    place = picture.view.fractional_pixels_at(np.array([[104.0, -17.0]]))[0]
    reach = np.stack([cols + 0.5 - place[0], place[1] - rows - 0.5])
    tip = reach[:, np.hypot(*reach).argmax()]
    assert math.atan2(tip[1], tip[0]) == pytest.approx(yaw_rad, abs=0.15)
    assert np.ptp(rows) + np.ptp(cols) >= 18


def test_a_robot_outside_the_map_is_not_drawn_in_a_corner() -> None:
    grid = grid_from_text(ROOM)
    picture = draw_robot_pose(grid, Pose(50.0, 50.0))
    assert not is_colour(pixels_of(picture), full_colour(Colour.VERMILION)).any()


def test_walls_under_the_lines_of_the_metric_grid_stay_black() -> None:
    cells = np.zeros((40, 40), dtype=np.int8)
    cells[::5, :] = cells[:, ::5] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=1.0, origin=Pose(-20.0, 300.0))
    picture = draw_map_axis(grid)
    colours = colours_at(picture, grid.points_at(*np.nonzero(grid.occupied)))
    assert (colours == 0).all()
