"""The surfaces of a map as a scan matcher needs them: the nearest one to a point, as a line."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.simulator.gridmap import CELL_SIZE_M, LogOddsMap

__all__ = ["FinishedField", "NearestLines", "SurfaceField"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
Mask = NDArray[np.bool_]

_SPREAD_M = 0.10
"""How far from a surface its likelihood has fallen to 0.6: about two cells."""
_REACH_CELLS = 3
"""How many cells around a point its surface is looked for."""
_LINE_RATIO = 4.0
"""How much longer than wide, in squares, a scatter must be to count as a line."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class NearestLines:
    """The surface nearest to each of n points, as a line.

    Attributes:
        offsets_m: From the line to the point, along the normal, shape (n,).
        normals: Unit vectors across the lines, shape (n, 2).
        is_line: True where there is a surface near by that has a direction, shape (n,).
        is_near: True where there is any surface near by, shape (n,).
    """

    offsets_m: FloatArray
    normals: FloatArray
    is_line: Mask
    is_near: Mask


class SurfaceField:
    """A map's surfaces at one moment."""

    def __init__(self, log_odds_map: LogOddsMap) -> None:
        self._map = log_odds_map
        self._occupied = log_odds_map.occupied

    def is_mapped(self, points_in_map: FloatArray) -> Mask:
        """True for the points that fall on ground the map knows."""
        return np.asarray(self._map.is_seen[self._cells(points_in_map, margin=0)])

    def find_lines(self, points_in_map: FloatArray) -> NearestLines:
        """Finds the surface near each point and fits a line to it."""
        rows, cols, is_near = self._find_nearest(points_in_map)
        middles, normals, has_direction = self._fit_lines(rows, cols)
        away_m = (self._map.fractional_cells(points_in_map) - middles) * CELL_SIZE_M
        return NearestLines(
            offsets_m=np.einsum("ij,ij->i", away_m, normals),
            normals=normals,
            is_line=is_near & has_direction,
            is_near=is_near,
        )

    def build_likelihood(self) -> NDArray[np.float32]:
        """Builds a map of how well a return fits in each cell: 1 on a surface, 0 far from all."""
        away = np.logical_not(self._occupied).view(np.uint8)
        distance = cv2.distanceTransform(away, cv2.DIST_L2, cv2.DIST_MASK_5)
        in_spreads = distance * np.float32(CELL_SIZE_M / _SPREAD_M)
        return np.asarray(np.exp(np.float32(-0.5) * in_spreads**2))

    def look_up(
        self, likelihood: NDArray[np.float32], points_in_map: FloatArray
    ) -> NDArray[np.float32]:
        """Gives the values of such a map at points of shape (..., 2)."""
        return np.asarray(likelihood[self._cells(points_in_map, margin=0)])

    def _find_nearest(self, points_in_map: FloatArray) -> tuple[IntArray, IntArray, Mask]:
        """Gives the nearest occupied cell for each point, and whether there is one in reach."""
        rows, cols = self._cells(points_in_map, margin=_REACH_CELLS)
        n_cols = self._occupied.shape[1]
        steps = _BY_DISTANCE[:, 0] * n_cols + _BY_DISTANCE[:, 1]
        is_occupied = self._occupied.take((rows * n_cols + cols)[:, None] + steps)
        first = is_occupied.argmax(axis=1)
        point = np.arange(len(rows))
        return (
            rows + _BY_DISTANCE[first, 0],
            cols + _BY_DISTANCE[first, 1],
            is_occupied[point, first],
        )

    def _fit_lines(self, rows: IntArray, cols: IntArray) -> tuple[FloatArray, FloatArray, Mask]:
        """Fits a line to the surface in each cell and its eight neighbours.

        Gives middles as (col, row), unit normals, and whether the surface has a direction at all.
        """
        around_rows = rows.clip(1, self._occupied.shape[0] - 2)[:, None] + _NEIGHBOURS[:, 0]
        around_cols = cols.clip(1, self._occupied.shape[1] - 2)[:, None] + _NEIGHBOURS[:, 1]
        at = around_rows * self._occupied.shape[1] + around_cols
        weights = self._occupied.take(at).astype(np.float64)
        x, y = self._map.surface_at(around_rows, around_cols)
        totals = np.maximum(weights.sum(axis=1), 1.0)
        middle_x = (weights * x).sum(axis=1) / totals
        middle_y = (weights * y).sum(axis=1) / totals
        dx, dy = x - middle_x[:, None], y - middle_y[:, None]
        xx, yy = (weights * dx * dx).sum(axis=1), (weights * dy * dy).sum(axis=1)
        xy = (weights * dx * dy).sum(axis=1)
        # The long axis of a scatter, in closed form: half the angle of (xx - yy, 2 xy).
        along = 0.5 * np.arctan2(2 * xy, xx - yy)
        longer = (xx + yy) / 2 + np.hypot((xx - yy) / 2, xy)
        has_direction = (totals >= 2) & (longer > _LINE_RATIO * (xx + yy - longer))
        return (
            np.stack([middle_x, middle_y], axis=1),
            np.stack([-np.sin(along), np.cos(along)], axis=1),
            has_direction,
        )

    def _cells(self, points_in_map: FloatArray, *, margin: int) -> tuple[IntArray, IntArray]:
        # Points outside the map count as on its border, which lies away from everything seen.
        cells = np.floor(self._map.fractional_cells(points_in_map)).astype(np.intp)
        n_rows, n_cols = self._occupied.shape
        return (
            cells[..., 1].clip(margin, n_rows - 1 - margin),
            cells[..., 0].clip(margin, n_cols - 1 - margin),
        )


class FinishedField(SurfaceField):
    """The surfaces of a map that never changes again: every line is fitted once, beforehand."""

    def __init__(self, log_odds_map: LogOddsMap) -> None:
        super().__init__(log_odds_map)
        margin = _REACH_CELLS
        inner = self._occupied[margin:-margin, margin:-margin]
        rows, cols = (index + margin for index in np.nonzero(inner))
        self._middles, self._normals, self._has_direction = self._fit_lines(rows, cols)
        self._nearest = np.full(self._occupied.shape, -1, dtype=np.int32)
        # The farthest first, so that nearer ones overwrite them.
        for row_step, col_step in _BY_DISTANCE[::-1]:
            self._nearest[rows - row_step, cols - col_step] = np.arange(len(rows))

    def find_lines(self, points_in_map: FloatArray) -> NearestLines:
        """Looks up the surface near each point."""
        nearest = self._nearest[self._cells(points_in_map, margin=_REACH_CELLS)]
        is_near = nearest >= 0
        nearest = np.where(is_near, nearest, 0)
        if not len(self._middles):
            return _no_lines(len(points_in_map))
        normals = self._normals[nearest]
        away = self._map.fractional_cells(points_in_map) - self._middles[nearest]
        return NearestLines(
            offsets_m=(away * normals).sum(axis=1) * CELL_SIZE_M,
            normals=normals,
            is_line=is_near & self._has_direction[nearest],
            is_near=is_near,
        )


def _no_lines(n_points: int) -> NearestLines:
    nowhere = np.zeros(n_points, dtype=np.bool_)
    return NearestLines(
        offsets_m=np.zeros(n_points),
        normals=np.zeros((n_points, 2)),
        is_line=nowhere,
        is_near=nowhere,
    )


def _square(reach: int) -> IntArray:
    """Gives the (row, col) steps of a square around a cell, the nearest first."""
    steps = np.arange(-reach, reach + 1)
    square = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    ordered = square[np.argsort((square**2).sum(axis=1), kind="stable")]
    ordered.setflags(write=False)
    return ordered


_BY_DISTANCE = _square(_REACH_CELLS)
_NEIGHBOURS = _square(1)
