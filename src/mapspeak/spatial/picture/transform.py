"""Where a map lies in a picture, grid spacings, and what each pixel shows of the map.

A pixel that covers several cells shows the highest value among them, so that a wall one cell thick
stays a wall at any scale. Where the grid's axes are those of the picture, cells become whole
blocks of pixels; a turned grid is read at points so dense that none of its cells is missed.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point
from mapspeak.spatial.grid import FREE_MAX, UNKNOWN, FloatArray, IntArray, OccupancyGrid
from mapspeak.spatial.picture.marks import FREE, GREYS, UNKNOWN_GROUND, WALL, Canvas

NORTH_UP_RAD = math.pi / 2
"""The view in which the map's y axis points up and its x axis to the right."""

_ANGLE_SLACK_RAD = 1e-9
_BORDER_SLACK_PX = 1e-6
"""Rounding in the last digits must not push a cell's corner into the pixel before it."""
_N_LINES_ALONG_LONG_SIDE = 8.5
"""Between 6 and 12: enough to read coordinates from, few enough to see the map."""
_PAPER_N_LINES = 15
_PAPER_MAX_LINES = 90
_STEPS = (1.0, 2.0, 5.0)
Number = TypeVar("Number", np.int8, np.uint16)
_MAX_SAMPLE_STEP_CELLS = 0.7
"""A lattice this fine has a point in every cell, however it is turned (below 1/sqrt 2)."""


def is_north_up(up_rad: float) -> bool:
    """Return True for the view with the map's y axis up."""
    return abs(math.remainder(up_rad - NORTH_UP_RAD, math.tau)) < _ANGLE_SLACK_RAD


class Box(NamedTuple):
    """A rectangle of pixels, which arrays are made of; right and bottom are the first outside."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def width(self) -> int:
        """Pixels from left to right."""
        return self.right - self.left

    @property
    def height(self) -> int:
        """Pixels from top to bottom."""
        return self.bottom - self.top

    def overlaps(self, other: "Box") -> bool:
        """Return True when the two share a pixel."""
        return (
            self.left < other.right
            and other.left < self.right
            and self.top < other.bottom
            and other.top < self.bottom
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureView:
    """The exact transform between metres in the map and pixels of one picture.

    Attributes:
        corner: The point of the map in the top left corner of the map area.
        up_rad: The direction in the map that points up in the picture; pi/2 is y up.
        pixels_per_m: The scale, the same along both axes.
        area: The part of the picture that shows the map.
    """

    corner: Point
    up_rad: float
    pixels_per_m: float
    area: Box
    width_px: int
    height_px: int

    def shows(self, point: Point) -> bool:
        """Return True when the point lies in the part of the map that the picture shows."""
        return bool(self.shows_each(np.array([[point.x, point.y]]))[0])

    def fractional_pixels_at(self, points: FloatArray) -> FloatArray:
        """Return (u, v) of shape (n, 2) as real numbers; a pixel's middle is at +0.5, +0.5.

        For an unturned map that fills the picture at one pixel per cell this is eq. 3 of the paper.
        """
        dx, dy = points[:, 0] - self.corner.x, points[:, 1] - self.corner.y
        cos, sin = math.cos(self.up_rad), math.sin(self.up_rad)
        u = self.area.left + self.pixels_per_m * (sin * dx - cos * dy)
        v = self.area.top - self.pixels_per_m * (cos * dx + sin * dy)
        return np.stack([u, v], axis=1)

    def pixels_at(self, points: FloatArray) -> IntArray:
        """Return the pixels (u, v) that points fall in, which may lie outside the picture."""
        return np.floor(self.fractional_pixels_at(points) + _BORDER_SLACK_PX).astype(np.intp)

    def shows_each(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return `shows` for points of shape (n, 2)."""
        pixels = self.pixels_at(points)
        first, end = (self.area.left, self.area.top), (self.area.right, self.area.bottom)
        return np.asarray(((pixels >= first) & (pixels < end)).all(axis=1))

    def area_pixels_at(self, points: FloatArray) -> FloatArray:
        """Return (u, v) as real numbers, counted from the top left corner of the map area."""
        corner = np.array([self.area.left, self.area.top])
        return np.asarray(self.fractional_pixels_at(points) - corner)

    def area_of(self, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the map area of a picture's array, sharing its memory."""
        return picture[self.area.top : self.area.bottom, self.area.left : self.area.right]

    def points_at(self, pixels: FloatArray) -> FloatArray:
        """Return the points of the map for (u, v) as real numbers, shape (n, 2)."""
        right_m = (pixels[:, 0] - self.area.left) / self.pixels_per_m
        up_m = (self.area.top - pixels[:, 1]) / self.pixels_per_m
        cos, sin = math.cos(self.up_rad), math.sin(self.up_rad)
        x = self.corner.x + sin * right_m + cos * up_m
        y = self.corner.y - cos * right_m + sin * up_m
        return np.stack([x, y], axis=1)

    def area_corners(self) -> FloatArray:
        """Return the four corners of the map area as points of the map, shape (4, 2)."""
        left, top, right, bottom = self.area
        corners = [[left, top], [right, top], [right, bottom], [left, bottom]]
        return self.points_at(np.array(corners, dtype=np.float64))

    def heading_at(self, yaw_rad: float) -> float:
        """Return a yaw of the map as an angle in the picture, counter-clockwise from its right."""
        return yaw_rad - self.up_rad + NORTH_UP_RAD


def even_spacing_m(longest_m: float) -> float:
    """Return the spacing that puts about 6 to 12 lines across the longest side of a map."""
    return round_length_m(longest_m / _N_LINES_ALONG_LONG_SIDE)


def round_length_m(wanted_m: float) -> float:
    """Return the 1, 2 or 5 times a power of ten that comes nearest to a length."""
    return min(_candidates(wanted_m), key=lambda step_m: abs(math.log(step_m / wanted_m)))


def paper_spacing_m(width_m: float, height_m: float, resolution_m: float) -> float:
    """Return the paper's adaptive spacing: the next intuitive value from s_base on (eq. 5).

    On maps more than six times as long as wide it grows beyond the paper's, for the same purpose:
    so that the lines across the long side do not merge into a grey floor.
    """
    base_m = max(min(width_m, height_m) / _PAPER_N_LINES, resolution_m)
    base_m = max(base_m, max(width_m, height_m) / _PAPER_MAX_LINES)
    return next(step_m for step_m in _candidates(base_m) if step_m >= base_m * (1 - 1e-9))


def _candidates(around_m: float) -> list[float]:
    exponent = math.floor(math.log10(around_m))
    return [step * 10.0**power for power in range(exponent - 1, exponent + 2) for step in _STEPS]


def is_aligned(grid: OccupancyGrid, up_rad: float) -> bool:
    """Return True when the grid's axes point right and up in a picture with that direction up."""
    turn_rad = math.remainder(grid.origin.yaw_rad - up_rad + math.pi / 2, math.tau)
    return abs(turn_rad) < _ANGLE_SLACK_RAD


def sample(values: NDArray[Number], grid: OccupancyGrid, view: PictureView) -> NDArray[Number]:
    """Return, for each pixel of the map area, the highest value of the cells it covers.

    Pixels outside the grid get -1 (signed values) or 0 (unsigned ones).
    """
    if is_aligned(grid, view.up_rad):
        return _sample_aligned(values, grid, view)
    return _sample_turned(values, grid, view)


def paint_ground(grid: OccupancyGrid, view: PictureView) -> Canvas:
    """Return the map area in palette numbers: unknown, free, wall."""
    seen = sample(grid.cells, grid, view)
    ground = np.full(seen.shape, UNKNOWN_GROUND, dtype=np.uint8)
    ground[seen >= 0] = FREE
    ground[seen > FREE_MAX] = WALL
    return ground


def paint_paper_ground(grid: OccupancyGrid, view: PictureView) -> Canvas:
    """Return the map area in palette numbers of the paper's grey levels (eq. 1)."""
    seen = sample(grid.cells, grid, view)
    painted: Canvas = GREYS[seen.astype(np.intp) - UNKNOWN]
    return painted


def _sample_aligned(
    values: NDArray[Number], grid: OccupancyGrid, view: PictureView
) -> NDArray[Number]:
    cells_per_pixel = 1.0 / (view.pixels_per_m * grid.resolution_m)
    corner = grid.fractional_cells_at(np.array([[view.corner.x, view.corner.y]]))[0]
    top = round(corner[0]) - 1
    down = _spans(_first_cells(view.area.height + 1, cells_per_pixel))
    right = _spans(_first_cells(view.area.width + 1, cells_per_pixel))
    rows = (top - down[1], top - down[0])
    cols = (round(corner[1]) + right[0], round(corner[1]) + right[1])
    if cells_per_pixel < 1:
        # Cells become larger: taken from few rows, repeated last.
        first = min(max(0, int(rows[0].min())), grid.n_rows - 1)
        window = values[first : max(first, int(rows[1].max())) + 1]
        wide = _pool(window, *cols, axis=1)
        return _pool(wide, rows[0] - first, rows[1] - first, axis=0)
    return _pool(_pool(values, *rows, axis=0), *cols, axis=1)


def _first_cells(n_pixels: int, cells_per_pixel: float) -> IntArray:
    """Return the first cell of each pixel in a row; a cell belongs to the pixel of its middle."""
    pixels = np.arange(n_pixels)
    if cells_per_pixel < 1:
        return np.asarray(np.floor(pixels * cells_per_pixel + 1e-6), dtype=np.intp)
    return np.asarray(np.ceil(pixels * cells_per_pixel - 0.5 - 1e-9), dtype=np.intp)


def _spans(starts: IntArray) -> tuple[IntArray, IntArray]:
    """Return the first and the last cell from each start to before the next; one at the least."""
    return starts[:-1], np.maximum(starts[1:] - 1, starts[:-1])


def _pool(
    values: NDArray[Number], firsts: IntArray, lasts: IntArray, *, axis: int
) -> NDArray[Number]:
    """Return the highest value from each first to its last place along an axis."""
    n_cells = values.shape[axis]
    pooled = np.take(values, np.clip(firsts, 0, n_cells - 1), axis=axis)
    for offset in range(1, int((lasts - firsts).max(initial=0)) + 1):
        index = np.clip(np.minimum(firsts + offset, lasts), 0, n_cells - 1)
        np.maximum(pooled, np.take(values, index, axis=axis), out=pooled)
    is_outside = (lasts < 0) | (firsts >= n_cells)
    np.moveaxis(pooled, axis, 0)[is_outside] = _outside_value(values)
    return pooled


def _outside_value(values: NDArray[Number]) -> int:
    return UNKNOWN if np.issubdtype(values.dtype, np.signedinteger) else 0


def _sample_turned(
    values: NDArray[Number], grid: OccupancyGrid, view: PictureView
) -> NDArray[Number]:
    """Read a turned grid: made as coarse as the pixels, read densely, then pooled."""
    cells_per_pixel = 1.0 / (view.pixels_per_m * grid.resolution_m)
    n_pooled = max(1, math.floor(cells_per_pixel))
    n_fine = math.ceil(cells_per_pixel / n_pooled / _MAX_SAMPLE_STEP_CELLS)
    corners, size = grid.fractional_cells_at(view.area_corners()), np.array(grid.cells.shape)
    top_left = np.clip(np.floor(corners.min(axis=0)).astype(np.intp), 0, size)
    bottom_right = np.clip(np.ceil(corners.max(axis=0)).astype(np.intp), 0, size)
    window = values[top_left[0] : bottom_right[0], top_left[1] : bottom_right[1]]
    if window.size == 0:
        shape = (view.area.height, view.area.width)
        return np.full(shape, _outside_value(values), dtype=values.dtype)
    fine = cv2.warpAffine(
        _coarsen(window, n_pooled),
        _coarse_from_fine(grid, view, n_fine=n_fine, n_pooled=n_pooled, first=top_left),
        (view.area.width * n_fine, view.area.height * n_fine),
        flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(_outside_value(values),),
    )
    return _coarsen(fine.astype(values.dtype, copy=False), n_fine)


def _coarsen(values: NDArray[Number], n_pooled: int) -> NDArray[Number]:
    """Return the highest value of each block of n x n; blocks at the far sides may be smaller."""
    for axis in (0, 1):
        n_blocks = -(-values.shape[axis] // n_pooled)
        values = _pool(values, *_spans(np.arange(n_blocks + 1) * n_pooled), axis=axis)
    return values


def _coarse_from_fine(
    grid: OccupancyGrid, view: PictureView, *, n_fine: int, n_pooled: int, first: IntArray
) -> NDArray[np.float64]:
    """Return the affine map from a point of the fine lattice to a coarse cell, both (x, y).

    Args:
        n_fine: Lattice points per pixel along each axis.
        n_pooled: Cells per coarse cell along each axis.
        first: The (row, col) at which the coarse cells begin.
    """
    lattice = np.array([[0.5, 0.5], [1.5, 0.5], [0.5, 1.5]]) / n_fine
    pixels = lattice + np.array([view.area.left, view.area.top])
    rows_cols = (grid.fractional_cells_at(view.points_at(pixels)) - first) / n_pooled - 0.5
    x_y = rows_cols[:, ::-1]
    return np.stack([x_y[1] - x_y[0], x_y[2] - x_y[0], x_y[0]], axis=1)
