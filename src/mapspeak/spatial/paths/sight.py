"""The cells that a straight line passes."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point
from mapspeak.spatial.grid import FloatArray, IntArray, OccupancyGrid

__all__ = ["cells_on_line", "mean_on_line"]

_WHOLE = np.array([0.0, 1.0])
_WHOLE.setflags(write=False)


def cells_on_line(grid: OccupancyGrid, start: Point, end: Point) -> tuple[IntArray, IntArray]:
    """Gives rows and columns of all cells that the line passes, in order, both ends included.

    The cells may lie outside the array. A line through the very corner of four cells gives all
    four, so that nothing is seen or driven between two walls that touch at a corner.
    """
    ends = grid.fractional_cells_at(np.array([[start.x, start.y], [end.x, end.y]]))
    cells = _with_corner_cells(_pieces(ends[0], ends[1])[0])
    return cells[:, 0], cells[:, 1]


def mean_on_line(values: NDArray[np.floating[Any]], start: FloatArray, end: FloatArray) -> float:
    """Gives the mean of a map of values along the line between two places, in fractional cells.

    It is infinite where the line passes or touches a cell whose value is.
    """
    cells, shares = _pieces(start, end)
    mean = float(values[cells[:, 0], cells[:, 1]] @ shares)
    if not math.isfinite(mean):
        return mean
    corners = _corners(cells)
    if corners.size:
        beside = _cells_beside(cells, corners)
        if np.isinf(values[beside[..., 0], beside[..., 1]]).any():
            return math.inf
    return mean


def _pieces(start: FloatArray, end: FloatArray) -> tuple[IntArray, FloatArray]:
    """Cuts the line where it crosses grid lines: the cell and the share of every piece.

    The idea is that of Amanatides and Woo, "A fast voxel traversal algorithm" (1987).
    """
    pairs = zip(start.tolist(), end.tolist(), strict=True)
    cuts = np.concatenate([_crossings(first, last) for first, last in pairs])
    cuts.sort()
    borders = np.concatenate([_WHOLE[:1], cuts, _WHOLE[1:]])
    shares = borders[1:] - borders[:-1]
    is_piece = shares > 1e-9
    if not is_piece.any():
        return np.floor(start).astype(np.intp)[None, :], np.ones(1)
    middles = ((borders[:-1] + borders[1:]) / 2)[is_piece]
    cells = np.floor(start + middles[:, None] * (end - start)).astype(np.intp)
    return cells, shares[is_piece]


def _crossings(start: float, end: float) -> FloatArray:
    """Gives where, from 0 to 1, a coordinate that goes from start to end passes whole numbers."""
    first, last = math.floor(min(start, end)) + 1, math.ceil(max(start, end))
    if first >= last:
        return _WHOLE[:0]
    return np.asarray((np.arange(first, last) - start) / (end - start))


def _with_corner_cells(cells: IntArray) -> IntArray:
    beside = _corner_cells(cells)
    at = np.repeat(_corners(cells) + 1, 2)
    return np.insert(cells, at, beside.reshape(-1, 2), axis=0)


def _corner_cells(cells: IntArray) -> IntArray:
    """Gives, for each corner that a line goes through, the two cells it touches there."""
    return _cells_beside(cells, _corners(cells))


def _cells_beside(cells: IntArray, corners: IntArray) -> IntArray:
    before, after = cells[corners], cells[corners + 1]
    turned = np.stack([before[:, 0], after[:, 1]], axis=1)
    return np.stack([turned, before + after - turned], axis=1)


def _corners(cells: IntArray) -> IntArray:
    """Gives after which cells a line goes on diagonally."""
    is_turned = cells[1:] != cells[:-1]
    return np.flatnonzero(is_turned[:, 0] & is_turned[:, 1])
