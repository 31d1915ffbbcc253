import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from drawing import grid_from_text
from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.picture import (
    NORTH_UP_RAD,
    MapLayers,
    MapPicture,
    Zoom,
    draw_map,
)
from seeing import (
    FREE_RGB,
    UNKNOWN_RGB,
    WALL_RGB,
    colour_at,
    colours_at,
    is_colour,
    pixels_of,
)

# The origin mark at (0, 0) would hide walls, so these maps lie elsewhere.
Points = NDArray[np.float64]

far = st.floats(1000.0, 1e5)
yaws = st.floats(-math.pi, math.pi)
resolutions = st.floats(0.02, 1.5)
VALUES = np.array([-1, 0, 100], dtype=np.int8)
shapes = st.tuples(st.integers(1, 40), st.integers(1, 40))


@st.composite
def maps(draw: st.DrawFn, *, yaw_rad: st.SearchStrategy[float]) -> OccupancyGrid:
    generator = np.random.default_rng(draw(st.integers(0, 2**32)))
    return OccupancyGrid(
        cells=generator.choice(VALUES, size=draw(shapes), p=[0.3, 0.4, 0.3]),
        resolution_m=draw(resolutions),
        origin=Pose(draw(far), -draw(far), draw(yaw_rad)),
    )


def middles(grid: OccupancyGrid, picture: MapPicture) -> tuple[Points, NDArray[np.int8]]:
    """Gives the middles of the cells that a picture shows, and the values of those cells."""
    rows, cols = np.indices(grid.cells.shape)
    points = grid.points_at(rows.ravel(), cols.ravel())
    is_shown = [picture.view.shows(Point(float(x), float(y))) for x, y in points]
    return points[is_shown], grid.cells.ravel()[is_shown]


def distance_to_walls_m(grid: OccupancyGrid, points: Points) -> Points:
    """Gives how far points lie from the middle of the nearest occupied cell."""
    walls = grid.points_at(*np.nonzero(grid.occupied))
    apart = points[:, np.newaxis] - walls[np.newaxis]
    return np.asarray(np.hypot(apart[..., 0], apart[..., 1]).min(axis=1))


@settings(max_examples=40)
@given(grid=maps(yaw_rad=st.just(0.0)))
def test_every_cell_of_an_unturned_map_is_seen_at_its_own_place(grid: OccupancyGrid) -> None:
    picture = draw_map(grid, max_edge_px=400)
    points, values = middles(grid, picture)
    colours = colours_at(picture, points)
    assert is_colour(colours, WALL_RGB).tolist() == (values == 100).tolist()
    assert not is_colour(colours[values == 0], UNKNOWN_RGB).any()
    assert not is_colour(colours[values == -1], FREE_RGB).any()


@settings(max_examples=40)
@given(grid=maps(yaw_rad=yaws), up_rad=yaws)
def test_every_wall_of_a_turned_map_is_seen_at_its_own_place(
    grid: OccupancyGrid, up_rad: float
) -> None:
    picture = draw_map(grid, up_rad=up_rad, max_edge_px=400)
    points, values = middles(grid, picture)
    is_wall = is_colour(colours_at(picture, points), WALL_RGB)
    if picture.view.pixels_per_m * grid.resolution_m > 1.5:
        assert is_wall.tolist() == (values == 100).tolist()


@settings(max_examples=25)
@given(grid=maps(yaw_rad=yaws), up_rad=yaws)
def test_where_a_wall_is_seen_there_is_one_within_half_a_cell(
    grid: OccupancyGrid, up_rad: float
) -> None:
    picture = draw_map(grid, up_rad=up_rad, max_edge_px=320)
    rows, cols = np.nonzero(is_colour(picture.view.area_of(pixels_of(picture)), WALL_RGB))
    if not rows.size:
        return
    area = picture.view.area
    pixels = np.stack([cols + area.left + 0.5, rows + area.top + 0.5], axis=1)
    seen = picture.view.points_at(pixels)
    half_pixel_m = math.sqrt(0.5) / picture.view.pixels_per_m
    half_cell_m = math.sqrt(0.5) * grid.resolution_m
    assert distance_to_walls_m(grid, seen).max() <= half_cell_m + half_pixel_m


@settings(max_examples=30)
@given(grid=maps(yaw_rad=yaws), up_rad=yaws, u=st.integers(0, 319), v=st.integers(0, 319))
def test_a_pixel_gives_a_point_that_gives_the_pixel(
    grid: OccupancyGrid, up_rad: float, u: int, v: int
) -> None:
    view = draw_map(grid, up_rad=up_rad, max_edge_px=320).view
    middle = np.array([[u + 0.5, v + 0.5]])
    assert view.fractional_pixels_at(view.points_at(middle)) == pytest.approx(middle)


@settings(max_examples=20)
@given(rows=st.integers(1, 3000), cols=st.integers(1, 3000), max_edge_px=st.integers(320, 1072))
def test_a_picture_is_never_larger_than_asked(rows: int, cols: int, max_edge_px: int) -> None:
    grid = OccupancyGrid(cells=np.zeros((rows, cols), dtype=np.int8), resolution_m=0.05)
    picture = draw_map(grid, max_edge_px=max_edge_px)
    height, width, _ = pixels_of(picture).shape
    assert (width, height) == (picture.view.width_px, picture.view.height_px)
    assert max(width, height) <= max_edge_px
    assert width * height <= 1.15e6


@pytest.mark.parametrize("n_cells", [100, 500, 905, 1000, 1500, 3000])
def test_a_wall_one_cell_thick_is_seen_at_any_scale(n_cells: int) -> None:
    cells = np.zeros((n_cells, n_cells), dtype=np.int8)
    wall = n_cells // 3
    cells[wall, :] = cells[:, wall] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(500.0, 500.0))
    picture = draw_map(grid)
    along = np.arange(n_cells)
    for rows, cols in ((along, np.full(n_cells, wall)), (np.full(n_cells, wall), along)):
        assert is_colour(colours_at(picture, grid.points_at(rows, cols)), WALL_RGB).all()


@pytest.mark.parametrize("n_cells", [100, 905, 2000])
@pytest.mark.parametrize("turn_rad", [0.3, math.pi / 4, math.pi / 2])
def test_a_wall_one_cell_thick_stays_closed_on_a_turned_map(n_cells: int, turn_rad: float) -> None:
    cells = np.zeros((n_cells, n_cells), dtype=np.int8)
    wall = n_cells // 3
    cells[wall, :] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(500.0, 500.0, turn_rad))
    picture = draw_map(grid)
    points = grid.points_at(np.full(n_cells, wall), np.arange(n_cells))
    pixels = np.floor(picture.view.fractional_pixels_at(points)).astype(int)
    is_wall = np.pad(is_colour(pixels_of(picture), WALL_RGB), 1)
    is_near_wall = np.zeros(len(points), dtype=bool)
    for down in (0, 1, 2):
        for right in (0, 1, 2):
            is_near_wall |= is_wall[pixels[:, 1] + down, pixels[:, 0] + right]
    assert is_near_wall.all()


def test_walls_on_the_lines_of_the_metric_grid_keep_all_their_pixels() -> None:
    cells = np.zeros((200, 200), dtype=np.int8)
    cells[::20, :] = cells[:, ::20] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(100.0, 200.0))
    picture = draw_map(grid)
    scale = picture.view.pixels_per_m * grid.resolution_m
    n_wall_pixels = np.count_nonzero(is_colour(picture.view.area_of(pixels_of(picture)), WALL_RGB))
    assert n_wall_pixels == np.count_nonzero(grid.occupied) * round(scale) ** 2


def test_only_the_known_part_is_shown_with_a_metre_around_it() -> None:
    cells = np.full((400, 400), -1, dtype=np.int8)
    cells[100:140, 200:300] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(-7.0, 3.0))
    corners = draw_map(grid).view.area_corners()
    assert corners.min(axis=0) == pytest.approx((-7.0 + 10.0 - 1.0, 3.0 + 5.0 - 1.0))
    assert corners.max(axis=0) == pytest.approx((-7.0 + 15.0 + 1.0, 3.0 + 7.0 + 1.0))


@pytest.mark.parametrize("turn_rad", [0.0, 0.4])
def test_a_robot_on_unknown_ground_is_in_the_picture(turn_rad: float) -> None:
    cells = np.full((400, 400), -1, dtype=np.int8)
    cells[100:140, 200:300] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(-7.0, 3.0, turn_rad))
    robot = grid.point_at(Cell(350, 20))
    picture = draw_map(grid, layers=MapLayers(robot=Pose(robot.x, robot.y)))
    assert picture.view.shows(robot)


def test_a_robot_off_the_map_does_not_widen_the_picture() -> None:
    grid = grid_from_text("...")
    picture = draw_map(grid, layers=MapLayers(robot=Pose(1e6, 0.0)))
    assert picture.view == draw_map(grid).view


def test_a_map_without_any_known_cell_is_shown_whole() -> None:
    grid = OccupancyGrid(cells=np.full((10, 20), -1, dtype=np.int8), resolution_m=0.5)
    corners = draw_map(grid).view.area_corners()
    assert corners.max(axis=0) == pytest.approx((10.0, 5.0))


def test_a_map_of_one_cell_can_be_drawn() -> None:
    grid = grid_from_text("#", resolution_m=0.05, origin=Pose(7.0, 7.0))
    assert colour_at(draw_map(grid), Point(7.02, 7.02)) == WALL_RGB


def test_seen_from_the_robot_what_lies_ahead_is_above() -> None:
    robot = Pose(4.0, 2.0, 2.2)
    view = draw_map(grid_from_text("." * 20), up_rad=robot.yaw_rad).view
    ahead = robot.transform(Point(1.0, 0.0))
    (u0, v0), (u1, v1) = view.fractional_pixels_at(
        np.array([[robot.x, robot.y], [ahead.x, ahead.y]])
    )
    assert u1 == pytest.approx(u0)
    assert v0 - v1 == pytest.approx(view.pixels_per_m)


def test_zoom_shows_the_surroundings_of_a_point_on_whole_cells() -> None:
    grid = OccupancyGrid(cells=np.zeros((400, 400), dtype=np.int8), resolution_m=0.05)
    picture = draw_map(grid, zoom=Zoom(centre=Point(10.01, 5.0), radius_m=2.0))
    corners = picture.view.area_corners()
    assert corners.min(axis=0) == pytest.approx((8.0, 3.0))
    assert corners.max(axis=0) == pytest.approx((12.05, 7.0))
    pixels_per_cell = picture.view.pixels_per_m * 0.05
    assert pixels_per_cell == pytest.approx(round(pixels_per_cell))


def test_zoom_at_the_edge_of_the_map_shows_no_more_than_there_is() -> None:
    grid = OccupancyGrid(cells=np.zeros((400, 400), dtype=np.int8), resolution_m=0.05)
    corners = draw_map(grid, zoom=Zoom(centre=Point(0.0, 0.0), radius_m=5.0)).view.area_corners()
    assert corners.min(axis=0) == pytest.approx((-1.0, -1.0))


@pytest.mark.parametrize("radius_m", [0.0, -1.0, math.nan, math.inf])
def test_a_radius_that_is_no_positive_number_is_refused(radius_m: float) -> None:
    with pytest.raises(MapError, match="radius"):
        draw_map(grid_from_text("..."), zoom=Zoom(centre=Point(1, 0), radius_m=radius_m))


def test_a_zoom_far_off_the_map_is_refused_with_its_place() -> None:
    with pytest.raises(MapError, match=r"\(90\.00, 0\.00\)"):
        draw_map(grid_from_text("..."), zoom=Zoom(centre=Point(90, 0), radius_m=3.0))


def test_a_map_without_cells_is_refused() -> None:
    with pytest.raises(MapError, match="0 x 5 cells"):
        draw_map(OccupancyGrid(cells=np.zeros((0, 5), dtype=np.int8), resolution_m=0.05))


@pytest.mark.parametrize("max_edge_px", [0, 319, 5000])
def test_a_picture_too_small_or_too_large_is_refused(max_edge_px: int) -> None:
    with pytest.raises(MapError, match=str(max_edge_px)):
        draw_map(grid_from_text("..."), max_edge_px=max_edge_px)


def test_the_same_map_gives_the_same_bytes() -> None:
    grid = grid_from_text("#..\n.?#")
    assert draw_map(grid).png == draw_map(grid).png


def test_up_is_the_maps_y_axis_unless_told_otherwise() -> None:
    assert draw_map(grid_from_text("...")).view.up_rad == NORTH_UP_RAD
