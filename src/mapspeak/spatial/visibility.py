"""Lines over a map: rays that are sampled, rays that end at obstacles, and means along lines."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import FloatArray, IntArray, Mask

_Reals = NDArray[np.floating[Any]]
_FARTHEST_CELL = 1e6
"""No map reaches so far; farther places overflow cell indices."""
_WHOLE = np.array([0.0, 1.0])
_WHOLE.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Rays:
    """The cells on rays from each of some places, all of shape (places, rays, steps).

    Attributes:
        cells: Flat indices into the array; of the nearest cell inside where the ray is outside.
    """

    cells: IntArray
    is_inside: Mask

    def follow(self, floor: Mask) -> Mask:
        """Return True on each ray up to where it first leaves the cells set in a mask."""
        is_floor = floor.ravel()[self.cells] & self.is_inside
        return np.asarray(np.logical_and.accumulate(is_floor, axis=2))


def cast_rays(shape: tuple[int, ...], starts: _Reals, *, angles_rad: _Reals, steps: _Reals) -> Rays:
    """Cast rays from places over an array, and sample them at the same distances.

    Args:
        shape: Rows and columns of the array.
        starts: Places as fractional cells (row, col), shape (n, 2).
        angles_rad: Of the rays of each place, from the array's own x axis.
        steps: Where to sample a ray, in cells from its start.
    """
    on_rows = _passed(starts[:, 0], np.outer(np.sin(angles_rad), steps))
    on_cols = _passed(starts[:, 1], np.outer(np.cos(angles_rad), steps))
    n_rows, n_cols = shape
    is_inside = (on_rows >= 0) & (on_rows < n_rows) & (on_cols >= 0) & (on_cols < n_cols)
    inside_rows = np.clip(on_rows, 0, n_rows - 1).astype(np.intp)
    cells = inside_rows * n_cols + np.clip(on_cols, 0, n_cols - 1)
    return Rays(cells=cells, is_inside=is_inside)


def measure_sight(
    clearance: NDArray[np.float32],
    starts: FloatArray,
    angles_rad: FloatArray,
    *,
    begin: float | FloatArray,
    reach: float | FloatArray,
) -> FloatArray:
    """Return how far each ray goes until it meets an obstacle or leaves the array, in cells.

    Rays go on by as much as is free around them ("sphere tracing"; Hart, 1996).

    Args:
        clearance: Cells from each cell to the nearest obstacle; 0 in obstacles.
        starts: A place for each ray, as fractional cells (row, col), shape (n, 2).
        angles_rad: From the array's own x axis, shape (n,).
        begin: Nearer obstacles do not count; one number, or one for each ray.
        reach: Rays end there; one number, or one for each ray.
    """
    far = np.zeros(len(starts)) + begin
    farthest = np.zeros(len(starts)) + reach
    rows, cols = np.clip(starts, -_FARTHEST_CELL, _FARTHEST_CELL).T
    rays = np.stack([rows, cols, np.sin(angles_rad), np.cos(angles_rad), farthest, far])
    going = np.arange(len(starts))
    while going.size:
        row, col, down, across, most, at = rays
        free = _clearance_at(clearance, row + at * down, col + at * across)
        is_on = (free > 0.0) & (at < most)
        if not is_on.all():
            far[going] = at
            going, free, rays = going[is_on], free[is_on], rays[:, is_on]
        # Both the ray's place in its cell and the obstacle's corner may be nearer by 0.71.
        rays[-1] += np.maximum(free - math.sqrt(2), 0.5)
    return np.minimum(far, farthest)


def mean_on_line(values: NDArray[np.floating[Any]], start: FloatArray, end: FloatArray) -> float:
    """Return the mean of a map of values along the line between two places, in fractional cells.

    It is infinite where the line passes or touches a cell whose value is.
    """
    cells, shares = _pieces(start, end)
    mean = float(values[cells[:, 0], cells[:, 1]] @ shares)
    if not math.isfinite(mean):
        return mean
    # Through the very corner of four cells a line goes on diagonally, and touches all four.
    before, after = cells[:-1], cells[1:]
    is_corner = (before != after).all(axis=1)
    if not is_corner.any():
        return mean
    (rows, cols), (next_rows, next_cols) = before[is_corner].T, after[is_corner].T
    touched = np.concatenate([values[rows, next_cols], values[next_rows, cols]])
    return math.inf if np.isinf(touched).any() else mean


def _pieces(start: FloatArray, end: FloatArray) -> tuple[IntArray, FloatArray]:
    """Cut the line where it crosses grid lines: the cell and the share of every piece.

    The idea is that of Amanatides and Woo, "A fast voxel traversal algorithm" (1987).
    """
    crossings = []
    for first, last in zip(start.tolist(), end.tolist(), strict=True):
        # Where, from 0 to 1, the coordinate passes whole numbers.
        low, high = math.floor(min(first, last)) + 1, math.ceil(max(first, last))
        if low < high:
            crossings.append((np.arange(low, high) - first) / (last - first))
    cuts = np.sort(np.concatenate([_WHOLE[:0], *crossings]))
    borders = np.concatenate([_WHOLE[:1], cuts, _WHOLE[1:]])
    shares = borders[1:] - borders[:-1]
    is_piece = shares > 1e-9
    if not is_piece.any():
        return np.floor(start).astype(np.intp)[None, :], np.ones(1)
    middles = ((borders[:-1] + borders[1:]) / 2)[is_piece]
    cells = np.floor(start + middles[:, None] * (end - start)).astype(np.intp)
    return cells, shares[is_piece]


def _passed(starts: _Reals, offsets: _Reals) -> NDArray[np.int32]:
    """Return the rows, or the columns, in which places lie that are so far off the starts."""
    whole = np.floor(starts)
    if not (starts - whole == 0.5).all():
        return np.floor(starts[:, None, None] + offsets).astype(np.int32)
    # From the middle of every cell the steps are the same.
    steps = np.floor(offsets + 0.5).astype(np.int32)
    return np.asarray(whole.astype(np.int32)[:, None, None] + steps, dtype=np.int32)


def _clearance_at(
    clearance: NDArray[np.float32], rows: FloatArray, cols: FloatArray
) -> NDArray[np.float32]:
    """Return the clearance at fractional cells; 0 outside the array."""
    n_rows, n_cols = clearance.shape
    rows, cols = np.floor(rows), np.floor(cols)
    is_inside = (rows >= 0) & (rows < n_rows) & (cols >= 0) & (cols < n_cols)
    flat = np.where(is_inside, rows * n_cols + cols, 0).astype(np.intp)
    return np.asarray(np.where(is_inside, clearance.ravel()[flat], 0.0), dtype=np.float32)
