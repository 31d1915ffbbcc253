"""The cells where known floor meets the unknown, gathered into borders."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import IntArray, Mask, OccupancyGrid

__all__ = ["Border", "find_borders"]

THINNEST_UNKNOWN_M = 0.15
"""Thinner unknown is what lies between two beams of a LiDAR, or along a wall: nothing to see."""

JOIN_M = 0.6
"""Pieces of border that are no further apart on the floor are one."""

Labels = NDArray[np.int32]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Border:
    """Free cells beside the unknown that hang together.

    Attributes:
        rows: Of its cells.
        cols: Of its cells.
        length_m: Along it.
    """

    rows: IntArray
    cols: IntArray
    length_m: float


def find_borders(grid: OccupancyGrid) -> list[Border]:
    """Finds all borders of the known floor with unknown that is worth a look.

    Only cells that touch by a side count as neighbours, so that nothing is seen between walls
    that touch at a corner. Outside the array everything is unknown.
    """
    edge = _edge(grid)
    labels, n_labels = _labelled(edge, grid.free, reach=_cells(JOIN_M, grid))
    rows, cols = np.nonzero(edge)
    of_cell = labels[rows, cols]
    order = np.argsort(of_cell, kind="stable")
    starts = np.searchsorted(of_cell[order], np.arange(1, n_labels + 1))
    groups = np.split(order, starts[1:]) if n_labels > 1 else [order]
    return [_border(grid, rows[group], cols[group]) for group in groups if group.size]


def _edge(grid: OccupancyGrid) -> Mask:
    """True in free cells that have unknown at a side, and not just a sliver of it."""
    side = max(_cells(THINNEST_UNKNOWN_M, grid), 1)
    unknown = np.pad(grid.unknown, side, constant_values=True).view(np.uint8)
    square = np.ones((side, side), dtype=np.uint8)
    thick = cv2.dilate(cv2.erode(unknown, square, anchor=(0, 0)), square, anchor=(side - 1,) * 2)
    near_thick = cv2.dilate(thick, np.ones((2 * side + 1, 2 * side + 1), dtype=np.uint8)) > 0
    plus = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    beside = cv2.dilate(unknown, plus) > 0
    inner = slice(side, -side)
    return np.asarray(grid.free & (beside & near_thick)[inner, inner], dtype=np.bool_)


def _labelled(edge: Mask, free: Mask, *, reach: int) -> tuple[Labels, int]:
    """Numbers the borders; pieces near each other on the floor share a number."""
    plus = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    grown = edge
    for _ in range(max(reach // 2, 1)):
        grown = (cv2.dilate(grown.view(np.uint8), plus) > 0) & free
    n_labels, labels = cv2.connectedComponents(grown.view(np.uint8), connectivity=4)
    return np.asarray(labels, dtype=np.int32), n_labels - 1


def _border(grid: OccupancyGrid, rows: IntArray, cols: IntArray) -> Border:
    across = np.hypot(np.ptp(rows) + 1, np.ptp(cols) + 1) if rows.size > 1 else 1.0
    length = max(float(rows.size), float(across))
    return Border(rows=rows, cols=cols, length_m=length * grid.resolution_m)


def _cells(length_m: float, grid: OccupancyGrid) -> int:
    return round(length_m / grid.resolution_m)
