"""A closer look, from any side: every pixel, mark and arrow is where it belongs."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.picture import Colour, MapLayers, MapPicture, Mark, Zoom, draw_map
from seeing import WALL_RGB, colours_at, full_colour, is_colour, pixels_of

VALUES = np.array([-1, 0, 100], dtype=np.int8)
yaws = st.one_of(st.floats(-math.pi, math.pi), st.sampled_from([0.0, math.pi / 2, math.pi]))
shares = st.floats(-0.3, 1.3)


@st.composite
def maps(draw: st.DrawFn) -> OccupancyGrid:
    generator = np.random.default_rng(draw(st.integers(0, 2**32)))
    shape = draw(st.tuples(st.integers(1, 60), st.integers(1, 60)))
    return OccupancyGrid(
        cells=generator.choice(VALUES, size=shape, p=[0.2, 0.6, 0.2]),
        resolution_m=draw(st.floats(0.02, 0.5)),
        origin=Pose(draw(st.floats(1e3, 1e5)), draw(st.floats(-1e5, -1e3)), draw(yaws)),
    )


@st.composite
def looks(draw: st.DrawFn) -> tuple[OccupancyGrid, Zoom, float]:
    """Draws a map, a part of it that may lie partly or wholly off it, and what is up."""
    grid = draw(maps())
    across, along = draw(shares), draw(shares)
    centre = grid.origin.transform(Point(across * grid.width_m, along * grid.height_m))
    radius_m = 10.0 ** draw(st.floats(-1.0, 2.0))
    return grid, Zoom(centre=centre, radius_m=radius_m), draw(yaws)


def draw_or_skip(
    grid: OccupancyGrid, zoom: Zoom, up_rad: float, layers: MapLayers | None = None
) -> MapPicture:
    """Draws a closer look; a place wholly off the map has to be refused by name."""
    try:
        return draw_map(
            grid, layers=layers or MapLayers(), zoom=zoom, up_rad=up_rad, max_edge_px=400
        )
    except MapError as error:
        assert f"({zoom.centre.x:.2f}, {zoom.centre.y:.2f})" in str(error)  # noqa: PT017
        rows, cols = np.indices(grid.cells.shape)
        away = grid.points_at(rows.ravel(), cols.ravel()) - [zoom.centre.x, zoom.centre.y]
        assert np.hypot(*away.T).min() > zoom.radius_m
        assume(condition=False)
        raise


@settings(max_examples=30)
@given(look=looks())
def test_every_cell_of_a_closer_look_is_seen_at_its_own_place(
    look: tuple[OccupancyGrid, Zoom, float],
) -> None:
    grid, zoom, up_rad = look
    picture = draw_or_skip(grid, zoom, up_rad)
    rows, cols = np.indices(grid.cells.shape)
    points = grid.points_at(rows.ravel(), cols.ravel())
    shown = picture.view.shows_each(points)
    is_wall = is_colour(colours_at(picture, points[shown]), WALL_RGB)
    if picture.view.pixels_per_m * grid.resolution_m > 1.5:
        assert is_wall.tolist() == (grid.cells.ravel()[shown] == 100).tolist()


@settings(max_examples=30)
@given(look=looks(), across=st.floats(0, 1), along=st.floats(0, 1), yaw_rad=yaws)
def test_a_mark_and_the_robot_are_drawn_where_they_are_or_not_at_all(
    look: tuple[OccupancyGrid, Zoom, float], across: float, along: float, yaw_rad: float
) -> None:
    grid, zoom, up_rad = look
    place = grid.origin.transform(Point(across * grid.width_m, along * grid.height_m))
    robot = Pose(place.x, place.y, yaw_rad)
    mark = Mark(point=place, label="W1", colour=Colour.GREEN)
    marked = draw_or_skip(grid, zoom, up_rad, MapLayers(marks=(mark,)))
    is_shown = marked.view.shows(place)
    seen = is_colour(pixels_of(marked), full_colour(Colour.GREEN))
    assert seen.any() == is_shown
    with_robot = draw_or_skip(grid, zoom, up_rad, MapLayers(robot=robot))
    drawn = is_colour(pixels_of(with_robot), full_colour(Colour.VERMILION))
    assert drawn.any() == is_shown
    if not is_shown:
        return
    assert colours_at(marked, np.array([[place.x, place.y]]))[0].tolist() == list(
        full_colour(Colour.GREEN)
    )
    check_arrow(with_robot, robot)


def check_arrow(picture: MapPicture, robot: Pose) -> None:
    """Asserts that the arrow, if it is whole, points along the robot's yaw."""
    u, v = picture.view.fractional_pixels_at(np.array([[robot.x, robot.y]]))[0]
    area = picture.view.area
    if min(u - area.left, area.right - u, v - area.top, area.bottom - v) < 22:
        return
    rows, cols = np.nonzero(is_colour(pixels_of(picture), full_colour(Colour.VERMILION)))
    reach = np.stack([cols + 0.5 - u, rows + 0.5 - v], axis=1)
    tip = reach[np.hypot(*reach.T).argmax()] + [u, v]
    x, y = picture.view.points_at(np.array([tip]))[0]
    bearing = math.atan2(y - robot.y, x - robot.x)
    assert math.remainder(bearing - robot.yaw_rad, math.tau) == pytest.approx(0.0, abs=0.15)


@settings(max_examples=30)
@given(look=looks(), u=st.integers(0, 399), v=st.integers(0, 399))
def test_a_pixel_of_a_closer_look_gives_a_point_that_gives_the_pixel(
    look: tuple[OccupancyGrid, Zoom, float], u: int, v: int
) -> None:
    view = draw_or_skip(*look).view
    middle = np.array([[u + 0.5, v + 0.5]])
    assert view.fractional_pixels_at(view.points_at(middle)) == pytest.approx(middle)


@settings(max_examples=40)
@given(look=looks())
def test_a_closer_look_shows_no_more_than_was_asked_for_and_no_less_than_there_is(
    look: tuple[OccupancyGrid, Zoom, float],
) -> None:
    grid, zoom, up_rad = look
    view = draw_or_skip(grid, zoom, up_rad).view
    rows, cols = np.indices(grid.cells.shape)
    points = grid.points_at(rows.ravel(), cols.ravel())
    away = points - [zoom.centre.x, zoom.centre.y]
    turn = np.array([[math.sin(up_rad), math.cos(up_rad)], [-math.cos(up_rad), math.sin(up_rad)]])
    from_centre_m = np.abs(away @ turn).max(axis=1)
    slack_m = 1e-3 + 1.0 / view.pixels_per_m
    radius_m = max(zoom.radius_m, grid.resolution_m)
    shown = view.shows_each(points)
    assert shown[from_centre_m < radius_m - slack_m].all()
    assert not shown[from_centre_m > radius_m + grid.resolution_m + slack_m].any()


@pytest.mark.parametrize("radius_m", [0.1, 1.0, 5.0, 1000.0])
@pytest.mark.parametrize("up_rad", [math.pi / 2, 0.0, 0.7])
def test_a_wall_one_cell_thick_is_seen_at_any_radius(radius_m: float, up_rad: float) -> None:
    cells = np.zeros((400, 400), dtype=np.int8)
    cells[200, :] = cells[:, 200] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(500.0, 500.0))
    crossing = Point(510.025, 510.025)
    picture = draw_map(grid, zoom=Zoom(centre=crossing, radius_m=radius_m), up_rad=up_rad)
    points = grid.points_at(*np.nonzero(grid.occupied))
    shown = points[picture.view.shows_each(points)]
    assert len(shown) >= 3
    assert is_colour(colours_at(picture, shown), WALL_RGB).all()


def test_a_radius_of_a_few_cells_shows_them_as_whole_blocks() -> None:
    cells = np.zeros((40, 40), dtype=np.int8)
    cells[20, 20] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(500.0, 500.0))
    picture = draw_map(grid, zoom=Zoom(centre=Point(501.025, 501.025), radius_m=0.1))
    side_px = picture.view.pixels_per_m * 0.05
    n_wall = np.count_nonzero(is_colour(picture.view.area_of(pixels_of(picture)), WALL_RGB))
    assert side_px == pytest.approx(round(side_px))
    assert n_wall == round(side_px) ** 2
