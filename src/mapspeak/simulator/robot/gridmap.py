"""The map that SLAM writes: a grid of log-odds that grows as the robot sees more.

Occupancy grids with log-odds are Moravec and Elfes, "High resolution maps from wide angle sonar"
(1985); the values published are Cartographer's: -1 unknown, else the probability in percent.
"""

import math
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import MapError
from mapspeak.geometry import Pose
from mapspeak.simulator.worlds.slices import SUBCELL_BITS
from mapspeak.spatial import UNKNOWN, OccupancyGrid

FloatArray = NDArray[np.float64]
Mask = NDArray[np.bool_]
Window = tuple[slice, slice]

CELL_SIZE_M = 0.05
_GROWTH_CELLS = 64
"""The map grows by whole blocks of this many cells, so that it seldom has to."""

_HIT = math.log(0.6 / 0.4)
_MISS = math.log(0.4 / 0.6)
_CERTAIN = math.log(0.98 / 0.02)

_SAME_SURFACE_M = 0.25
"""Neighbouring returns no further apart than this are taken to lie on one surface."""


class LogOddsMap:
    """A grid around the robot's first position, which is (0, 0) of the map frame."""

    def __init__(self) -> None:
        self._log_odds = np.zeros((2 * _GROWTH_CELLS, 2 * _GROWTH_CELLS), dtype=np.float32)
        self._is_seen = np.zeros(self._log_odds.shape, dtype=bool)
        self._n_hits = np.zeros(self._log_odds.shape)
        self._hit_cols = np.zeros(self._log_odds.shape)
        self._hit_rows = np.zeros(self._log_odds.shape)
        self._row_of_zero = _GROWTH_CELLS
        self._col_of_zero = _GROWTH_CELLS
        self._published = np.full(self._log_odds.shape, UNKNOWN, dtype=np.int8)
        self._changed: Window | None = None

    @classmethod
    def of(cls, known: OccupancyGrid) -> Self:
        """Return a map as SLAM would hold it; its surfaces lie in the middles of their cells.

        Solid cells not beside free floor are the inside of a wall, not a surface.

        Raises:
            MapError: Its cells differ from those of SLAM: in size, turned, or shifted.
        """
        shift = np.array([known.origin.x, known.origin.y]) / CELL_SIZE_M
        is_like_ours = math.isclose(known.resolution_m, CELL_SIZE_M, rel_tol=1e-6)
        if not is_like_ours or known.origin.yaw_rad or np.abs(shift - np.rint(shift)).max() > 1e-3:
            raise MapError(
                f"The simulated robot finds its place only in maps with cells of {CELL_SIZE_M} m "
                "whose borders lie at whole cells, unturned.",
                hint="Give a map that the simulated robot has made.",
            )
        made = cls()
        margin = _GROWTH_CELLS
        beside_floor = cv2.dilate(known.free.view(np.uint8), np.ones((3, 3), dtype=np.uint8)) > 0
        shown = np.where(known.occupied & ~beside_floor, UNKNOWN, known.cells)
        cells = np.pad(shown.astype(np.float32), margin, constant_values=UNKNOWN)
        share = np.clip(cells / 100.0, 0.02, 0.98)
        made._is_seen = cells != UNKNOWN
        made._log_odds = np.where(made._is_seen, np.log(share / (1 - share)), 0.0).astype(
            np.float32
        )
        made._n_hits = np.where(made.occupied, 1.0, 0.0)
        made._hit_cols = made._n_hits / 2
        made._hit_rows = made._n_hits / 2
        made._col_of_zero, made._row_of_zero = (margin - np.rint(shift)).astype(int).tolist()
        made._published = np.full(cells.shape, UNKNOWN, dtype=np.int8)
        made._changed = (slice(0, cells.shape[0]), slice(0, cells.shape[1]))
        return made

    @property
    def occupied(self) -> Mask:
        """True where an obstacle is more likely than not."""
        return self._log_odds > 0

    @property
    def is_seen(self) -> Mask:
        """True where a scan has shown floor or a surface."""
        return self._is_seen

    def fractional_cells(self, points: FloatArray) -> FloatArray:
        """Return (col, row) of map points as real numbers, both 0 at the corner of the array."""
        return points / CELL_SIZE_M + (self._col_of_zero, self._row_of_zero)

    def surface_at(
        self, rows: NDArray[np.intp], cols: NDArray[np.intp]
    ) -> tuple[FloatArray, FloatArray]:
        """Return where the returns of cells lie on average: col and row as real numbers."""
        flat = rows * self._n_hits.shape[1] + cols
        n_hits = np.maximum(self._n_hits.take(flat), 1.0)
        return (
            cols + self._hit_cols.take(flat) / n_hits,
            rows + self._hit_rows.take(flat) / n_hits,
        )

    def insert(self, ends_in_map: FloatArray, is_return: Mask) -> None:
        """Mark one scan: surfaces, and the floor between them and the LiDAR.

        Args:
            ends_in_map: Where the beams end, in the order of their angles, shape (n, 2); a beam
                without a return ends at the LiDAR itself.
            is_return: True for the beams that hit something, shape (n,).
        """
        self._grow_to_hold(ends_in_map)
        ends = self.fractional_cells(ends_in_map)
        window = self._window_around(ends)
        is_hit = self._add_surface(_join_returns(ends_in_map, is_return), window)
        is_free = _seen_through(ends, is_return, window) & ~is_hit
        log_odds = self._log_odds[window]
        log_odds[is_free] += _MISS
        log_odds[is_hit] += _HIT
        np.clip(log_odds, -_CERTAIN, _CERTAIN, out=log_odds)
        self._is_seen[window] |= is_free | is_hit
        self._changed = window if self._changed is None else _join(self._changed, window)

    def publish(self, *, stamp_s: float) -> OccupancyGrid:
        """Return the map as ROS knows it."""
        if self._changed is not None:
            percent = np.rint(100.0 / (1.0 + np.exp(-self._log_odds[self._changed])))
            is_seen = self._is_seen[self._changed]
            self._published[self._changed] = np.where(is_seen, percent, UNKNOWN)
            self._changed = None
        rows, cols = _extent(self._is_seen)
        return OccupancyGrid(
            cells=self._published[rows, cols],
            resolution_m=CELL_SIZE_M,
            origin=Pose(
                (cols.start - self._col_of_zero) * CELL_SIZE_M,
                (rows.start - self._row_of_zero) * CELL_SIZE_M,
            ),
            stamp_s=stamp_s,
        )

    def _add_surface(self, points_in_map: FloatArray, window: Window) -> Mask:
        """Add points of surfaces to the means of their cells, which a window of the map holds.

        Return those cells of the window.
        """
        places = self.fractional_cells(points_in_map)
        corners = np.floor(places)
        cols, rows = corners.astype(np.intp).T
        np.add.at(self._n_hits, (rows, cols), 1.0)
        np.add.at(self._hit_cols, (rows, cols), places[:, 0] - corners[:, 0])
        np.add.at(self._hit_rows, (rows, cols), places[:, 1] - corners[:, 1])
        is_hit = np.zeros(_shape_of(window), dtype=bool)
        is_hit[rows - window[0].start, cols - window[1].start] = True
        return is_hit

    def _window_around(self, ends: FloatArray) -> Window:
        """Return the part of the map that holds a scan, as fractional cells, and a cell more."""
        low = np.maximum(np.floor(ends.min(axis=0)).astype(int) - 1, 0)
        high = np.floor(ends.max(axis=0)).astype(int) + 2
        (left, below), (right, above) = low.tolist(), high.tolist()
        n_rows, n_cols = self._log_odds.shape
        return slice(below, min(above, n_rows)), slice(left, min(right, n_cols))

    def _grow_to_hold(self, ends_in_map: FloatArray) -> None:
        cells = self.fractional_cells(ends_in_map)
        margin = 2.0
        low = np.ceil((margin - cells.min(axis=0)) / _GROWTH_CELLS).clip(0).astype(int)
        size = np.array(self._log_odds.shape[::-1])
        high = np.ceil((cells.max(axis=0) + margin - size) / _GROWTH_CELLS).clip(0).astype(int)
        if not low.any() and not high.any():
            return
        (left, below), (right, above) = low * _GROWTH_CELLS, high * _GROWTH_CELLS
        widths = ((below, above), (left, right))
        self._log_odds = np.pad(self._log_odds, widths)
        self._is_seen = np.pad(self._is_seen, widths)
        self._n_hits = np.pad(self._n_hits, widths)
        self._hit_cols = np.pad(self._hit_cols, widths)
        self._hit_rows = np.pad(self._hit_rows, widths)
        self._published = np.pad(self._published, widths, constant_values=UNKNOWN)
        if self._changed is not None:
            rows, cols = self._changed
            self._changed = (
                slice(rows.start + int(below), rows.stop + int(below)),
                slice(cols.start + int(left), cols.stop + int(left)),
            )
        self._row_of_zero += int(below)
        self._col_of_zero += int(left)


def _seen_through(ends: FloatArray, is_return: Mask, window: Window) -> Mask:
    """Return the cells of a window inside the star of beams, whose ends are fractional cells.

    The line from one return to the next is left out: where beams graze a wall it runs along
    the wall, which no beam has shown to be free.
    """
    picture = np.zeros(_shape_of(window), dtype=np.uint8)
    corner = np.array([window[1].start, window[0].start], dtype=np.int32) << SUBCELL_BITS
    corners = _fixed(ends) - corner
    cv2.fillPoly(picture, [corners], 1, shift=SUBCELL_BITS)
    sides = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    between_returns = list(sides[is_return & np.roll(is_return, -1)])
    cv2.polylines(picture, between_returns, isClosed=False, color=0, shift=SUBCELL_BITS)
    return picture.astype(bool)


def _shape_of(window: Window) -> tuple[int, int]:
    rows, cols = window
    return rows.stop - rows.start, cols.stop - cols.start


def _join(one: Window, other: Window) -> Window:
    """Return the smallest window that holds two others."""
    rows, cols = (
        slice(min(mine.start, its.start), max(mine.stop, its.stop))
        for mine, its in zip(one, other, strict=True)
    )
    return rows, cols


def _join_returns(ends_in_map: FloatArray, is_return: Mask) -> FloatArray:
    """Return the returns, and points between neighbours that seem to lie on one surface.

    Far away, or on a wall that the beams graze, returns lie apart. A map of single dots would draw
    the next scan's dots onto them, and the pose with them.
    """
    steps = np.roll(ends_in_map, -1, axis=0) - ends_in_map
    gaps_m = np.hypot(steps[:, 0], steps[:, 1])
    is_joined = is_return & np.roll(is_return, -1) & (gaps_m <= _SAME_SURFACE_M)
    n_points = np.where(is_joined, np.ceil(gaps_m / (CELL_SIZE_M / 2)), is_return).astype(np.intp)
    beam = np.repeat(np.arange(len(ends_in_map)), n_points)
    nth = np.arange(len(beam)) - np.repeat(np.cumsum(n_points) - n_points, n_points)
    return np.asarray(ends_in_map[beam] + (nth / n_points[beam])[:, None] * steps[beam])


def _fixed(cells: FloatArray) -> NDArray[np.int32]:
    """Return fractional cells as OpenCV draws them: whole numbers are the middles of pixels."""
    return np.round((cells - 0.5) * (1 << SUBCELL_BITS)).astype(np.int32)


def _extent(is_seen: Mask) -> tuple[slice, slice]:
    """Return the rows and columns that hold everything seen; all of them where nothing is."""
    rows, cols = np.flatnonzero(is_seen.any(axis=1)), np.flatnonzero(is_seen.any(axis=0))
    if not len(rows):
        return slice(0, is_seen.shape[0]), slice(0, is_seen.shape[1])
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(cols[0]), int(cols[-1]) + 1)
