"""The plan of a picture: which part of the map it shows, and at what scale."""

import math
from dataclasses import dataclass

import numpy as np

from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.spatial.grid import FloatArray, IntArray, OccupancyGrid
from mapspeak.spatial.picture.transform import Box, PictureView, is_aligned

MAX_EDGE_PX = 1072
"""A square picture of this edge has 1.15 megapixels, as much as vision models take in whole."""

MIN_EDGE_PX = 320
_RIM_M = 1.0
_MIN_RIM_LIMIT_CELLS = 10
_BLOCK_ROWS = 512
"""Large maps are read in blocks, so that drawing them takes little memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Zoom:
    """A part of the map to look at more closely.

    Attributes:
        radius_m: From the middle to the nearest sides of the picture.
    """

    centre: Point
    radius_m: float


@dataclass(frozen=True, slots=True)
class Extent:
    """The part of the map in a picture, in metres along the picture's axes from the map's zero."""

    left_m: float
    right_m: float
    bottom_m: float
    top_m: float

    @property
    def width_m(self) -> float:
        """From left to right."""
        return self.right_m - self.left_m

    @property
    def height_m(self) -> float:
        """From bottom to top."""
        return self.top_m - self.bottom_m


@dataclass(frozen=True, slots=True, kw_only=True)
class Margins:
    """The room around the map for numbers and the legend, in pixels.

    Attributes:
        side_px: Left, and as much on the right.
    """

    side_px: int = 0
    top_px: int = 0
    bottom_px: int = 0
    min_width_px: int = 0


def extent_of_map(grid: OccupancyGrid, up_rad: float) -> Extent:
    """Return the whole array."""
    _check_not_empty(grid)
    return _extent_of_corners(grid, up_rad, np.array([0, grid.n_rows]), np.array([0, grid.n_cols]))


def extent_of_known(grid: OccupancyGrid, up_rad: float, *, place: Point | None = None) -> Extent:
    """Return the smallest part with all known cells in it, with a rim of a metre.

    A place on the array, such as the robot's, comes into it too.
    """
    _check_not_empty(grid)
    rows = np.flatnonzero(grid.cells.max(axis=1) >= 0)
    cols = np.flatnonzero(grid.cells.max(axis=0) >= 0)
    if rows.size == 0:
        return extent_of_map(grid, up_rad)
    if is_aligned(grid, up_rad):
        known = _extent_of_corners(
            grid, up_rad, np.array([rows[0], rows[-1] + 1]), np.array([cols[0], cols[-1] + 1])
        )
    else:
        known = _extent_of_known_turned(grid, up_rad, rows)
    if place is not None and grid.contains(grid.cell_at(place)):
        cell = grid.cell_at(place)
        row, col = np.array([cell.row, cell.row + 1]), np.array([cell.col, cell.col + 1])
        there = _extent_of_corners(grid, up_rad, row, col)
        known = Extent(
            min(known.left_m, there.left_m),
            max(known.right_m, there.right_m),
            min(known.bottom_m, there.bottom_m),
            max(known.top_m, there.top_m),
        )
    return _grown(known, _rim_m(grid, max(known.width_m, known.height_m)))


def extent_of_zoom(grid: OccupancyGrid, up_rad: float, zoom: Zoom) -> Extent:
    """Return a square around a point, as far as there is map.

    Raises:
        MapError: The radius is not a positive number, or no part of the map is that near.
    """
    if not (math.isfinite(zoom.radius_m) and zoom.radius_m > 0):
        raise MapError(
            f"The radius to show is {zoom.radius_m} m.", hint="Give a positive number of metres."
        )
    whole = extent_of_map(grid, up_rad)
    whole = _grown(whole, _rim_m(grid, max(whole.width_m, whole.height_m)))
    right, up = _in_picture_axes(np.array([[zoom.centre.x, zoom.centre.y]]), up_rad)[0]
    radius_m = max(zoom.radius_m, grid.resolution_m)
    near = Extent(
        max(whole.left_m, right - radius_m),
        min(whole.right_m, right + radius_m),
        max(whole.bottom_m, up - radius_m),
        min(whole.top_m, up + radius_m),
    )
    if not (near.width_m > 0 and near.height_m > 0):
        raise MapError(
            f"No part of the map is within {zoom.radius_m} m of "
            f"({zoom.centre.x:.2f}, {zoom.centre.y:.2f}).",
            hint="Give a point on the map, or leave the centre out to see the whole map.",
        )
    return _snapped(near, grid, up_rad) if is_aligned(grid, up_rad) else near


def plan_view(
    grid: OccupancyGrid,
    extent: Extent,
    *,
    up_rad: float,
    margins: Margins,
    max_edge_px: int,
    steps_per_pixel: int = 1,
) -> PictureView:
    """Return the view that shows an extent as large as the edge allows.

    Cells of a grid whose axes are the picture's become blocks of pixels, or pixels cover several
    cells; a turned grid may have any scale. The side of a block is a whole number of pixels; with
    two steps per pixel it may be one and a half, in turns of 1 and 2 pixels.

    Raises:
        MapError: The edge is not between 320 and 1072 pixels.
    """
    if not MIN_EDGE_PX <= max_edge_px <= MAX_EDGE_PX:
        raise MapError(
            f"A picture of {max_edge_px} pixels cannot be drawn.",
            hint=f"Ask for a longest edge of {MIN_EDGE_PX} to {MAX_EDGE_PX} pixels.",
        )
    room_width = max_edge_px - 2 * margins.side_px
    room_height = max_edge_px - margins.top_px - margins.bottom_px
    pixels_per_m = min(room_width / extent.width_m, room_height / extent.height_m)
    if is_aligned(grid, up_rad) and pixels_per_m * grid.resolution_m >= 1:
        pixels_per_cell = pixels_per_m * grid.resolution_m
        steps = steps_per_pixel if pixels_per_cell < 2 else 1
        pixels_per_m = math.floor(steps * pixels_per_cell + 1e-9) / steps / grid.resolution_m
    width_px = min(room_width, _n_pixels(extent.width_m * pixels_per_m))
    height_px = min(room_height, _n_pixels(extent.height_m * pixels_per_m))
    whole_px = max(width_px + 2 * margins.side_px, margins.min_width_px)
    left = (whole_px - width_px) // 2
    cos, sin = math.cos(up_rad), math.sin(up_rad)
    corner = Point(
        sin * extent.left_m + cos * extent.top_m, -cos * extent.left_m + sin * extent.top_m
    )
    return PictureView(
        corner=corner,
        up_rad=up_rad,
        pixels_per_m=pixels_per_m,
        area=Box(left, margins.top_px, left + width_px, margins.top_px + height_px),
        width_px=whole_px,
        height_px=height_px + margins.top_px + margins.bottom_px,
    )


def _n_pixels(length_px: float) -> int:
    return max(1, math.ceil(length_px - 1e-6))


def _check_not_empty(grid: OccupancyGrid) -> None:
    if grid.cells.size == 0:
        raise MapError(
            f"The map has {grid.n_rows} x {grid.n_cols} cells: there is nothing to draw.",
            hint="Wait until the robot has published a map with at least one cell.",
        )


def _in_picture_axes(points: FloatArray, up_rad: float) -> FloatArray:
    """Return (right, up) in metres from the map's zero, for points of shape (n, 2)."""
    cos, sin = math.cos(up_rad), math.sin(up_rad)
    return np.stack(
        [sin * points[:, 0] - cos * points[:, 1], cos * points[:, 0] + sin * points[:, 1]], axis=1
    )


def _extent_of_corners(
    grid: OccupancyGrid, up_rad: float, rows: IntArray, cols: IntArray
) -> Extent:
    """Return the extent of cell corners: each row number with each column number."""
    corners = _corner_points(grid, np.repeat(rows, cols.size), np.tile(cols, rows.size))
    return _extent_of_points(corners, up_rad)


def _corner_points(grid: OccupancyGrid, rows: IntArray, cols: IntArray) -> FloatArray:
    """Return the corners of cells that lie towards the grid's origin."""
    # Half a cell off their centres: exact to the last digit, by which pictures are rounded.
    zero = np.array([0])
    half_cell = grid.points_at(zero, zero) - np.array([grid.origin.x, grid.origin.y])
    return np.asarray(grid.points_at(rows, cols) - half_cell)


def _extent_of_points(points: FloatArray, up_rad: float) -> Extent:
    in_axes = _in_picture_axes(points, up_rad)
    (left_m, bottom_m), (right_m, top_m) = in_axes.min(axis=0), in_axes.max(axis=0)
    return Extent(float(left_m), float(right_m), float(bottom_m), float(top_m))


def _extent_of_known_turned(grid: OccupancyGrid, up_rad: float, rows: IntArray) -> Extent:
    """Return the extent of the known cells from the first and the last one of each row."""
    first, last = np.empty_like(rows), np.empty_like(rows)
    for start in range(0, rows.size, _BLOCK_ROWS):
        block = slice(start, start + _BLOCK_ROWS)
        known = grid.cells[rows[block]] >= 0
        first[block] = known.argmax(axis=1)
        last[block] = grid.n_cols - known[:, ::-1].argmax(axis=1)
    corners = [
        _corner_points(grid, rows + above, cols) for above in (0, 1) for cols in (first, last)
    ]
    return _extent_of_points(np.concatenate(corners), up_rad)


def _rim_m(grid: OccupancyGrid, longest_m: float) -> float:
    """Return a metre in whole cells, but never more than the map itself on very fine grids."""
    n_cells = math.ceil(_RIM_M / grid.resolution_m - 1e-9)
    limit = max(_MIN_RIM_LIMIT_CELLS, math.ceil(longest_m / grid.resolution_m))
    return min(n_cells, limit) * grid.resolution_m


def _grown(extent: Extent, rim_m: float) -> Extent:
    return Extent(
        extent.left_m - rim_m, extent.right_m + rim_m, extent.bottom_m - rim_m, extent.top_m + rim_m
    )


def _snapped(extent: Extent, grid: OccupancyGrid, up_rad: float) -> Extent:
    """Return the extent grown outward to the borders of cells of a grid with the same axes."""
    origin = np.array([[grid.origin.x, grid.origin.y]])
    zeros_m = _in_picture_axes(origin, up_rad)[0].repeat(2)
    sides_m = np.array([extent.left_m, extent.right_m, extent.bottom_m, extent.top_m])
    cells, slack = (sides_m - zeros_m) / grid.resolution_m, 1e-6
    left, _, bottom, _ = np.floor(cells + slack)
    _, right, _, top = np.ceil(cells - slack)
    snapped = zeros_m + np.array([left, right, bottom, top]) * grid.resolution_m
    return Extent(*snapped.tolist())
