"""The floor of one room while it is furnished: what is taken, and whether the robot gets about.

Worked out on cells of 5 cm. Positions are metres in the world's own frame.
"""

from collections.abc import Iterator, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.simulator.worlds.world import BODY_RADIUS_M
from tools.worldgen.layout import Corner, Rect, Space

__all__ = ["RoomFloor"]

Mask = NDArray[np.bool_]

CELL_M = 0.05
WAY_RADIUS_M = BODY_RADIUS_M + 0.12
"""Ways are wider than the robot by what a planner with a rough map needs."""
FREE_RATIO = 0.12
"""The least share of a room's floor on which the robot can stand."""


class RoomFloor:
    """What stands in a room and what has to stay free."""

    def __init__(self, space: Space, *, wall_thickness_m: float) -> None:
        bounds = space.bounds
        self._left, self._bottom = bounds.left, bounds.bottom
        shape = (round(bounds.height_m / CELL_M), round(bounds.width_m / CELL_M))
        self._size = shape
        walls = list(_walls(space, wall_thickness_m / 2))
        self._floor = self._inside(space.outline, shape) & ~self._mask_all(walls)
        self._taken = np.zeros(shape, dtype=bool)
        self._kept = np.zeros(shape, dtype=bool)
        self._solids = walls
        self._entries: list[Corner] = []

    def keep_free(self, rect: Rect) -> None:
        """Keep things off a rectangle."""
        self._kept |= self._mask(rect)

    def add_entry(self, point: Corner) -> None:
        """Add a place that the robot must get to from every other one."""
        self._entries.append(point)

    def add(self, solids: Sequence[Rect], *, kept: Rect, fronts: Sequence[Corner]) -> bool:
        """Place solid things, if they fit and leave a way; gives whether they do.

        Args:
            solids: What they take up.
            kept: What must stay free before them; it may lie before other things too.
            fronts: Places of which the robot must get to at least one.
        """
        if self._is_outside(solids) or self._touches(solids):
            return False
        covered = self._mask_all(solids)
        if (covered & (self._kept | ~self._floor)).any():
            return False
        if (self._mask(kept) & self._taken).any():
            return False
        if not self._leaves_ways(self._taken | covered, fronts):
            return False
        self._solids += solids
        self._taken |= covered
        self._kept |= self._mask(kept)
        return True

    def _touches(self, solids: Sequence[Rect]) -> bool:
        return any(solid.overlaps(other) for solid in solids for other in self._solids)

    def _leaves_ways(self, taken: Mask, fronts: Sequence[Corner]) -> bool:
        free = np.pad(self._floor & ~taken, 1).astype(np.uint8)
        clear_m = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1]
        clear_m = (clear_m - 0.5) * CELL_M
        _, ways = cv2.connectedComponents((clear_m >= WAY_RADIUS_M).astype(np.uint8))
        labels = {int(ways[self._cell(point)]) for point in self._entries}
        if len(labels) > 1 or 0 in labels:
            return False
        label = labels.pop() if labels else int(ways.max())
        reached = [int(ways[self._cell(p)]) == label for p in fronts if self._holds(p)]
        if fronts and not any(reached):
            return False
        _, places = cv2.connectedComponents(
            (clear_m >= BODY_RADIUS_M - CELL_M / 2).astype(np.uint8)
        )
        if len(set(places[places > 0].tolist())) > 1:
            return False
        return bool((ways == label).sum() >= FREE_RATIO * self._floor.sum())

    @staticmethod
    def _inside(outline: Sequence[Corner], shape: tuple[int, int]) -> Mask:
        left, bottom = np.array(outline).min(axis=0).tolist()
        cols = (np.arange(shape[1]) + 0.5) * CELL_M + left
        rows = (np.arange(shape[0]) + 0.5) * CELL_M + bottom
        inside = np.zeros(shape, dtype=bool)
        # A row lies inside wherever an odd number of upright sides lies to its left.
        for (x, y), (to_x, to_y) in zip(outline, (*outline[1:], outline[0]), strict=True):
            if x == to_x:
                spans = (rows > min(y, to_y)) & (rows < max(y, to_y))
                inside ^= spans[:, None] & (cols > x)[None, :]
        return inside

    def _mask_all(self, rects: Sequence[Rect]) -> Mask:
        return np.asarray(np.logical_or.reduce([self._mask(rect) for rect in rects]))

    def _mask(self, rect: Rect) -> Mask:
        mask = np.zeros(self._size, dtype=bool)
        rows = [rect.bottom - self._bottom, rect.top - self._bottom]
        cols = [rect.left - self._left, rect.right - self._left]
        mask[_cells(rows, self._size[0]), _cells(cols, self._size[1])] = True
        return mask

    def _is_outside(self, solids: Sequence[Rect]) -> bool:
        height_m, width_m = (size * CELL_M for size in self._size)
        return any(
            solid.left < self._left
            or solid.bottom < self._bottom
            or solid.right > self._left + width_m
            or solid.top > self._bottom + height_m
            for solid in solids
        )

    def _cell(self, point: Corner) -> tuple[int, int]:
        return int((point[1] - self._bottom) / CELL_M), int((point[0] - self._left) / CELL_M)

    def _holds(self, point: Corner) -> bool:
        row, col = self._cell(point)
        n_rows, n_cols = self._size
        return 0 <= row < n_rows and 0 <= col < n_cols


def _walls(space: Space, half_m: float) -> Iterator[Rect]:
    for edge in space.edges:
        low, high = edge.low - half_m, edge.high + half_m
        near, far = edge.at - half_m, edge.at + half_m
        yield Rect(near, low, far, high) if edge.is_upright else Rect(low, near, high, far)


def _cells(ends_m: Sequence[float], n: int) -> slice:
    """Return the cells whose middles lie between two places."""
    low, high = (min(max(round(end_m / CELL_M), 0), n) for end_m in ends_m)
    return slice(low, high)
