"""Group cells where known floor meets the unknown into borders; find ways to them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import IntArray, OccupancyGrid
from mapspeak.spatial.paths.distances import DistanceField

THINNEST_UNKNOWN_M = 0.15
"""Thinner unknown is a gap between two LiDAR beams, or along a wall: nothing to see."""

JOIN_M = 0.6
"""Pieces of border no further apart on the floor belong together."""

PLUS = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], dtype=np.uint8)

Labels = NDArray[np.int32]
Picture = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Border:
    """Connected free cells beside the unknown."""

    rows: IntArray
    cols: IntArray
    length_m: float


def find_borders(grid: OccupancyGrid, *, least_length_m: float) -> tuple[tuple[Border, ...], int]:
    """Find borders of the known floor with unknown worth a look; count the shorter ones.

    Only cells that touch by a side count as neighbours, so that nothing is seen between walls
    that touch at a corner. Outside the array everything is unknown.
    """
    free = grid.free.view(np.uint8)
    side = max(round(THINNEST_UNKNOWN_M / grid.resolution_m), 1)
    edge = _edge(grid.unknown.view(np.uint8), free, side=side)
    labels = _labelled(edge, free, reach=round(JOIN_M / grid.resolution_m))
    cells = np.flatnonzero(edge.view(np.bool_))
    of_cell = labels.ravel()[cells]
    order = np.argsort(of_cell, kind="stable")
    starts = np.flatnonzero(np.diff(of_cell[order], prepend=0))
    if not starts.size:
        return (), 0
    rows, cols = np.divmod(cells[order], grid.n_cols)
    lengths_m = _lengths(rows, cols, starts) * grid.resolution_m
    kept = np.flatnonzero(lengths_m >= least_length_m)
    ends = np.append(starts[1:], rows.size)
    borders = (
        Border(rows=rows[first:end], cols=cols[first:end], length_m=float(length_m))
        for first, end, length_m in zip(starts[kept], ends[kept], lengths_m[kept], strict=True)
    )
    return tuple(borders), starts.size - kept.size


def find_middle(rows: IntArray, cols: IntArray) -> int:
    """Return the index of the cell nearest to the mean of all."""
    off_rows, off_cols = rows - rows.sum() / rows.size, cols - cols.sum() / cols.size
    return int((off_rows * off_rows + off_cols * off_cols).argmin())


def _edge(unknown: Picture, free: Picture, *, side: int) -> Picture:
    """Return True in free cells with more than a sliver of unknown at a side."""
    square = np.ones((side, side), dtype=np.uint8)
    thick = np.asarray(cv2.erode(unknown, square, anchor=(0, 0)), dtype=np.uint8)
    # One dilation gives the squares of unknown back and looks as far around them again.
    near_thick = _dilate(thick, np.ones((3 * side, 3 * side), np.uint8), (2 * side - 1,) * 2)
    beside = _dilate(unknown, PLUS, (1, 1))
    beside &= near_thick
    beside &= free
    return beside


def _dilate(picture: Picture, kernel: Picture, anchor: tuple[int, int]) -> Picture:
    """Dilate a picture that is set everywhere outside the array."""
    dilated = cv2.dilate(
        picture, kernel, anchor=anchor, borderType=cv2.BORDER_CONSTANT, borderValue=1
    )
    return np.asarray(dilated, dtype=np.uint8)


def _labelled(edge: Picture, free: Picture, *, reach: int) -> Labels:
    """Label the borders from 1; pieces near each other on the floor share a number."""
    grown = edge
    for _ in range(max(reach // 2, 1)):
        grown = np.asarray(cv2.bitwise_and(cv2.dilate(grown, PLUS), free), dtype=np.uint8)
    _, labels = cv2.connectedComponents(grown, connectivity=4)
    return np.asarray(labels, dtype=np.int32)


def _lengths(rows: IntArray, cols: IntArray, starts: IntArray) -> NDArray[np.float64]:
    """Return the lengths in cells of borders whose cells follow each other from each start on."""
    n_cells = np.diff(starts, append=rows.size)
    high = np.maximum.reduceat(rows, starts) - np.minimum.reduceat(rows, starts) + 1
    wide = np.maximum.reduceat(cols, starts) - np.minimum.reduceat(cols, starts) + 1
    across = np.where(n_cells > 1, np.hypot(high, wide), 1.0)
    return np.asarray(np.maximum(n_cells, across), dtype=np.float64)


WIDTH_STEP_M = 0.1
"""Gaps are measured in steps of this."""
ROUNDING_CELLS = 2
"""Error of the reachable floor of a large map, whose cells are joined two by two."""


def find_parts_beyond(distances: DistanceField, borders: Sequence[Border]) -> list[Border | None]:
    """Find the part of each border where the robot does not fit; None if it is the lesser part.

    The body of a robot that drives wherever it can covers all floor but slits, what lies behind
    them, and corners, which are no deeper than that of a right angle.
    """
    if not borders:
        return []
    away = cv2.distanceTransform((~distances.reachable).view(np.uint8), cv2.DIST_L2, 5)
    deepest = math.sqrt(2) * distances.radius_m / distances.grid.resolution_m + ROUNDING_CELLS
    parts: list[Border | None] = []
    for border in borders:
        is_part = away[border.rows, border.cols] > deepest
        rows, cols, ratio = border.rows[is_part], border.cols[is_part], float(is_part.mean())
        part = Border(rows=rows, cols=cols, length_m=ratio * border.length_m)
        parts.append(part if ratio > 0.5 else None)
    return parts


def find_gap_widths_m(distances: DistanceField, borders: Sequence[Border]) -> list[float | None]:
    """Find for each border the bottleneck width of the widest way to it; None without a way.

    Floor with less clearance is removed step by step; a border stays connected to the robot until
    its way is too narrow.
    """
    widths_m: list[float | None] = [None] * len(borders)
    joined = list(range(len(borders))) if distances.reachable.any() else []
    for width_m in np.arange(0.0, 2 * distances.radius_m - 1e-9, WIDTH_STEP_M):
        if not joined:
            break
        # The pieces of floor that are nowhere narrower, and the robot's position.
        wide = distances.grid.free & (distances.clearances_m >= width_m / 2 - 1e-6)
        wide |= distances.reachable
        _, labels = cv2.connectedComponents(wide.view(np.uint8), connectivity=4)
        robot = labels.flat[distances.reachable.argmax()]
        joined = [i for i in joined if (labels[borders[i].rows, borders[i].cols] == robot).any()]
        for index in joined:
            widths_m[index] = float(width_m)
    return widths_m
