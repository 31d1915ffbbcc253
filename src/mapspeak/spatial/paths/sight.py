"""The cells that a straight line passes."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point
from mapspeak.spatial.grid import FloatArray, IntArray, OccupancyGrid

__all__ = ["cells_on_line", "mean_on_line"]


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
    beside = _corner_cells(cells)
    if len(beside) and np.isinf(values[beside[..., 0], beside[..., 1]]).any():
        return math.inf
    return mean


def _pieces(start: FloatArray, end: FloatArray) -> tuple[IntArray, FloatArray]:
    """Cuts the line where it crosses grid lines: the cell and the share of every piece.

    The idea is that of Amanatides and Woo, "A fast voxel traversal algorithm" (1987).
    """
    cuts = np.concatenate([_crossings(start[axis], end[axis]) for axis in (0, 1)])
    borders = np.concatenate([[0.0], np.sort(cuts), [1.0]])
    shares = np.diff(borders)
    is_piece = shares > 1e-9
    if not is_piece.any():
        return np.floor(start).astype(np.intp)[None, :], np.ones(1)
    middles = ((borders[:-1] + borders[1:]) / 2)[is_piece]
    cells = np.floor(start + middles[:, None] * (end - start)).astype(np.intp)
    return cells, shares[is_piece]


def _crossings(start: float, end: float) -> FloatArray:
    """Gives where, from 0 to 1, a coordinate that goes from start to end passes whole numbers."""
    whole = np.arange(np.floor(min(start, end)) + 1, np.ceil(max(start, end)))
    return np.asarray((whole - start) / (end - start) if whole.size else whole, dtype=np.float64)


def _with_corner_cells(cells: IntArray) -> IntArray:
    beside = _corner_cells(cells)
    at = np.repeat(_corners(cells) + 1, 2)
    return np.insert(cells, at, beside.reshape(-1, 2), axis=0)


def _corner_cells(cells: IntArray) -> IntArray:
    """Gives, for each corner that a line goes through, the two cells it touches there."""
    corners = _corners(cells)
    before, after = cells[corners], cells[corners + 1]
    turned = np.stack([before[:, 0], after[:, 1]], axis=1)
    return np.stack([turned, before + after - turned], axis=1)


def _corners(cells: IntArray) -> IntArray:
    """Gives after which cells a line goes on diagonally."""
    return np.flatnonzero((cells[1:] != cells[:-1]).all(axis=1))
