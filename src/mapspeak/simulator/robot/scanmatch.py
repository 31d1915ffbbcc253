"""Scan matching: the pose at which a scan fits best into the map made so far.

Gauss-Newton on the distances from the points to the surfaces near them, taken as lines (Censi, "An
ICP variant using a point-to-line metric", 2008), held to the odometry where the walls say nothing,
as along a corridor. Only when that does not fit, a correlative search over turns and shifts around
the expected pose finds a better place to start from (Olson, "Real-time correlative scan matching",
2009), on the likelihood field of Thrun, Burgard and Fox, "Probabilistic robotics" (2005), sec. 6.4.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Pose, wrap_angle
from mapspeak.simulator.robot.gridmap import CELL_SIZE_M, LogOddsMap

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
Mask = NDArray[np.bool_]

_SPREAD_M = 0.10
"""Distance from a surface at which its likelihood falls to 0.6: about two cells."""
_REACH_CELLS = 3
"""Radius, in cells, of the search for the surface of a point."""
_LINE_RATIO = 4.0
"""Least ratio of length to width, squared, of a scatter that counts as a line."""


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
        """Return True for the points that fall on ground the map knows."""
        return np.asarray(self._map.is_seen[self._cells(points_in_map, margin=0)])

    def find_lines(self, points_in_map: FloatArray) -> NearestLines:
        """Find the surface near each point and fit a line to it."""
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
        """Build a map of how well a return fits in each cell: 1 on a surface, 0 far from all."""
        away = np.logical_not(self._occupied).view(np.uint8)
        distance = cv2.distanceTransform(away, cv2.DIST_L2, cv2.DIST_MASK_5)
        in_spreads = distance * np.float32(CELL_SIZE_M / _SPREAD_M)
        return np.asarray(np.exp(np.float32(-0.5) * in_spreads**2))

    def look_up(
        self, likelihood: NDArray[np.float32], points_in_map: FloatArray
    ) -> NDArray[np.float32]:
        """Return the values of such a map at points of shape (..., 2)."""
        return np.asarray(likelihood[self._cells(points_in_map, margin=0)])

    def _find_nearest(self, points_in_map: FloatArray) -> tuple[IntArray, IntArray, Mask]:
        """Return the nearest occupied cell for each point, and whether there is one in reach."""
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
        """Fit a line to the surface in each cell and its eight neighbours.

        Return middles as (col, row), unit normals, and whether the surface has a direction at all.
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
        """Look up the surface near each point."""
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
    """Return the (row, col) steps of a square around a cell, the nearest first."""
    steps = np.arange(-reach, reach + 1)
    square = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    ordered = square[np.argsort((square**2).sum(axis=1), kind="stable")]
    ordered.setflags(write=False)
    return ordered


_BY_DISTANCE = _square(_REACH_CELLS)
_NEIGHBOURS = _square(1)


_N_POINTS = 360
_N_STEPS = 8
_SMALL_STEP = 2e-4
_LARGEST_STEP = 0.1
_FIT_SPREAD_M = 0.03
"""Scatter of points about their surface; farther ones count less and less."""
_INDEPENDENT_RATIO = 0.1
"""Neighbouring points lie on the same cells and share their errors: ten count as one."""
_ODOMETRY_SPREAD = (0.05, 0.05, 0.03)
"""Error of odometry between two updates: m, m, rad."""

_GOOD_SCORE_RATIO = 0.7
_FEWEST_MAPPED_POINTS = 20

_SEARCH_SHIFT_M = 0.4
_SEARCH_TURN_RAD = 0.3
_SEARCH_TURN_STEP_RAD = 0.02
_N_SEARCH_POINTS = 120
_SEARCH_DISTANCE_COST = 0.05
"""Cost per metre, or radian, from the expected pose; it decides between equal fits."""


@dataclass(frozen=True, slots=True)
class Match:
    """A scan placed in the map.

    Attributes:
        map_from_base: The best pose.
        score_ratio: How well those points fit that fall on mapped ground: 1 where all of them lie
            on known surfaces; None where too few points do to tell.
    """

    map_from_base: Pose
    score_ratio: float | None

    @property
    def is_good(self) -> bool:
        """True unless the scan contradicts the map."""
        return self.score_ratio is None or self.score_ratio >= _GOOD_SCORE_RATIO


def match_scan(field: SurfaceField, points_in_base: FloatArray, expected: Pose) -> Match:
    """Find the pose near the expected one at which the points fit the map best."""
    points = _thin_out(points_in_base, _N_POINTS)
    match = _refine(field, points, expected, start=expected)
    if match.is_good:
        return match
    second = _refine(field, points, expected, start=_search(field, points, expected))
    return max(match, second, key=lambda found: found.score_ratio or 0.0)


def place_points(map_from_base: Pose, points_in_base: FloatArray) -> FloatArray:
    """Return points of the robot's frame in the map frame."""
    cos, sin = math.cos(map_from_base.yaw_rad), math.sin(map_from_base.yaw_rad)
    turned = points_in_base @ np.array([[cos, sin], [-sin, cos]])
    return np.asarray(turned + np.array([map_from_base.x, map_from_base.y]))


def _thin_out(points: FloatArray, n_points: int) -> FloatArray:
    """Return about that many of the points, evenly chosen."""
    return points[:: max(len(points) // n_points, 1)]


def _refine(
    field: SurfaceField, points_in_base: FloatArray, expected: Pose, *, start: Pose
) -> Match:
    """Step to the best fit by Gauss-Newton, with odometry as a prior."""
    prior = np.diag(1.0 / np.square(_ODOMETRY_SPREAD))
    pose = start
    for _ in range(_N_STEPS):
        normal, pull = _linearise(field, points_in_base, pose)
        step = np.linalg.solve(normal + prior, pull + prior @ _difference(expected, pose))
        step = np.clip(step, -_LARGEST_STEP, _LARGEST_STEP)
        dx, dy, turn = step.tolist()
        pose = Pose(pose.x + dx, pose.y + dy, wrap_angle(pose.yaw_rad + turn))
        if np.abs(step).max() < _SMALL_STEP:
            break
    return Match(pose, _score(field, place_points(pose, points_in_base)))


def _difference(target: Pose, pose: Pose) -> FloatArray:
    turn = wrap_angle(target.yaw_rad - pose.yaw_rad)
    return np.array([target.x - pose.x, target.y - pose.y, turn])


def _linearise(
    field: SurfaceField, points_in_base: FloatArray, pose: Pose
) -> tuple[FloatArray, FloatArray]:
    """Return the normal matrix and the right side of one Gauss-Newton step."""
    placed = place_points(pose, points_in_base)
    lines = field.find_lines(placed)
    offsets, normals = lines.offsets_m[lines.is_line], lines.normals[lines.is_line]
    arms = placed[lines.is_line] - (pose.x, pose.y)
    turning = normals[:, 1] * arms[:, 0] - normals[:, 0] * arms[:, 1]
    jacobian = np.column_stack([normals, turning])
    # Cauchy weights: a point far off its surface may belong to another one.
    weighted = _INDEPENDENT_RATIO * jacobian / (_FIT_SPREAD_M**2 + offsets**2)[:, None]
    return weighted.T @ jacobian, -weighted.T @ offsets


def _score(field: SurfaceField, points_in_map: FloatArray) -> float | None:
    # New ground must not count against a scan: most of the view through a new door is new.
    mapped = points_in_map[field.is_mapped(points_in_map)]
    if len(mapped) < _FEWEST_MAPPED_POINTS:
        return None
    lines = field.find_lines(mapped)
    fit = np.exp(-0.5 * (lines.offsets_m / CELL_SIZE_M) ** 2)
    return float(np.where(lines.is_near, fit, 0.0).mean())


def _search(field: SurfaceField, points_in_base: FloatArray, expected: Pose) -> Pose:
    """Try all turns and shifts in a window, cell by cell, with some of the points."""
    points = _thin_out(points_in_base, _N_SEARCH_POINTS)
    likelihood = field.build_likelihood()
    steps = np.arange(-_SEARCH_SHIFT_M, _SEARCH_SHIFT_M + 1e-9, CELL_SIZE_M)
    shifts = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    shift_costs = _SEARCH_DISTANCE_COST * np.hypot(shifts[:, 0], shifts[:, 1])
    best, best_score = expected, -math.inf
    for turn in np.arange(-_SEARCH_TURN_RAD, _SEARCH_TURN_RAD + 1e-9, _SEARCH_TURN_STEP_RAD):
        turned = Pose(expected.x, expected.y, wrap_angle(expected.yaw_rad + float(turn)))
        placed = place_points(turned, points)[None] + shifts[:, None]
        fits = field.look_up(likelihood, placed).mean(axis=1)
        scores = fits - shift_costs - _SEARCH_DISTANCE_COST * abs(float(turn))
        at = int(scores.argmax())
        if scores[at] > best_score:
            best_score = float(scores[at])
            dx, dy = shifts[at].tolist()
            best = Pose(turned.x + dx, turned.y + dy, turned.yaw_rad)
    return best
