"""The ground of a picture: what each pixel of the map area shows of the grid.

A pixel that covers several cells shows the highest value among them, so that a wall one cell thick
stays a wall at any scale. Where the grid's axes are those of the picture, cells become whole
blocks of pixels; a turned grid is read at points so dense that none of its cells is missed.
"""

import math
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import FREE_MAX, UNKNOWN, IntArray, OccupancyGrid
from mapspeak.spatial.picture.marks import FREE, GREYS, UNKNOWN_GROUND, WALL, Canvas
from mapspeak.spatial.picture.view import PictureView

Number = TypeVar("Number", np.int8, np.uint16)

_ANGLE_SLACK_RAD = 1e-9
_MAX_SAMPLE_STEP_CELLS = 0.7
"""A lattice this fine has a point in every cell, however it is turned (below 1/sqrt 2)."""


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
