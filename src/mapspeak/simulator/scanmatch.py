"""Scan matching: the pose at which a scan fits best into the map made so far.

Gauss-Newton on the distances from the points to the surfaces near them, taken as lines (Censi, "An
ICP variant using a point-to-line metric", 2008), held to the odometry where the walls say nothing,
as along a corridor. Only when that does not fit, a correlative search over turns and shifts around
the expected pose finds a better place to start from (Olson, "Real-time correlative scan matching",
2009), on the likelihood field of Thrun, Burgard and Fox, "Probabilistic robotics" (2005), sec. 6.4.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Pose, wrap_angle
from mapspeak.simulator.gridmap import CELL_SIZE_M
from mapspeak.simulator.surfacefield import SurfaceField

__all__ = ["Match", "match_scan", "place_points"]

FloatArray = NDArray[np.float64]

_N_POINTS = 360
_N_STEPS = 8
_SMALL_STEP = 2e-4
_LARGEST_STEP = 0.1
_FIT_SPREAD_M = 0.03
"""How far points scatter about their surface; those further off count for less and less."""
_SHARE_OF_NEWS = 0.1
"""Neighbouring points lie on the same cells and share their errors: ten count as one."""
_ODOMETRY_SPREAD = (0.05, 0.05, 0.03)
"""How far odometry may be off between two updates: m, m, rad."""

_GOOD_SCORE_RATIO = 0.7
_FEWEST_MAPPED_POINTS = 20

_SEARCH_SHIFT_M = 0.4
_SEARCH_TURN_RAD = 0.3
_SEARCH_TURN_STEP_RAD = 0.02
_N_SEARCH_POINTS = 120
_SEARCH_DISTANCE_COST = 0.05
"""What a metre, or a radian, away from the expected pose costs: it decides between equal fits."""


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
    """Finds the pose near the expected one at which the points fit the map best."""
    points = _thin_out(points_in_base, _N_POINTS)
    match = _refine(field, points, expected, start=expected)
    if match.is_good:
        return match
    second = _refine(field, points, expected, start=_search(field, points, expected))
    return max(match, second, key=lambda found: found.score_ratio or 0.0)


def place_points(map_from_base: Pose, points_in_base: FloatArray) -> FloatArray:
    """Gives points of the robot's frame in the map frame."""
    cos, sin = math.cos(map_from_base.yaw_rad), math.sin(map_from_base.yaw_rad)
    turned = points_in_base @ np.array([[cos, sin], [-sin, cos]])
    return np.asarray(turned + np.array([map_from_base.x, map_from_base.y]))


def _thin_out(points: FloatArray, n_points: int) -> FloatArray:
    """Gives about that many of the points, evenly chosen."""
    return points[:: max(len(points) // n_points, 1)]


def _refine(
    field: SurfaceField, points_in_base: FloatArray, expected: Pose, *, start: Pose
) -> Match:
    """Steps to the best fit by Gauss-Newton, with odometry as a prior."""
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
    """Gives the normal matrix and the right side of one Gauss-Newton step."""
    placed = place_points(pose, points_in_base)
    lines = field.find_lines(placed)
    offsets, normals = lines.offsets_m[lines.is_line], lines.normals[lines.is_line]
    arms = placed[lines.is_line] - (pose.x, pose.y)
    turning = normals[:, 1] * arms[:, 0] - normals[:, 0] * arms[:, 1]
    jacobian = np.column_stack([normals, turning])
    # Cauchy's weights: what lies far off its surface has perhaps another one.
    weighted = _SHARE_OF_NEWS * jacobian / (_FIT_SPREAD_M**2 + offsets**2)[:, None]
    return weighted.T @ jacobian, -weighted.T @ offsets


def _score(field: SurfaceField, points_in_map: FloatArray) -> float | None:
    # New ground must not count against a scan: most of what a door opens to is new.
    mapped = points_in_map[field.is_mapped(points_in_map)]
    if len(mapped) < _FEWEST_MAPPED_POINTS:
        return None
    lines = field.find_lines(mapped)
    fit = np.exp(-0.5 * (lines.offsets_m / CELL_SIZE_M) ** 2)
    return float(np.where(lines.is_near, fit, 0.0).mean())


def _search(field: SurfaceField, points_in_base: FloatArray, expected: Pose) -> Pose:
    """Tries all turns and shifts in a window, cell by cell, with some of the points."""
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
