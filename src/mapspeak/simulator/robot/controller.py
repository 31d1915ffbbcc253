"""Follow a path by pure pursuit (Coulter, 1992), limited by the latest scan.

Obstacles are in the robot's own frame, so errors of map and pose have no effect.
"""

import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.simulator.robot.physics import (
    MAX_ACCELERATION_MPS2,
    STANDING,
    BodyVelocity,
    move_along_arc,
)
from mapspeak.simulator.robot.scanmatch import place_points
from mapspeak.simulator.worlds.world import BODY_RADIUS_M
from mapspeak.spatial.paths import Path

FloatArray = NDArray[np.float64]

_NEAR_M = 2.5
"""Points further away than this cannot be touched before the next scans."""
KEEP_OFF_M = 0.03
"""Distance of the body's edge from a point, three times the LiDAR's noise."""
_SQUEEZE_M = 0.01
"""Distance to pass at if the robot is already nearer than that."""
_REACTION_S = 0.25
_ASIDES_RAD = tuple(
    math.copysign(math.radians(degrees), side) for degrees in range(15, 106, 15) for side in (1, -1)
)
_SHARES = (1.0, 0.6, 0.3, 0.15)
_N_SAMPLES = 6


class Obstacles:
    """The points of a scan near the robot's present pose."""

    def __init__(self, points_in_base: FloatArray) -> None:
        near = np.einsum("ij,ij->i", points_in_base, points_in_base) < _NEAR_M**2
        self._points = points_in_base[near]

    @classmethod
    def seen_from(cls, points_in_base: FloatArray, now_from_then: Pose) -> "Obstacles":
        """Return the points of a scan after the robot has moved on a little."""
        return cls(place_points(now_from_then, points_in_base))

    @property
    def room_m(self) -> float:
        """Distance from the body's edge to the nearest point."""
        return self._nearest_m - BODY_RADIUS_M

    @cached_property
    def _nearest_m(self) -> float:
        """Distance from the body's centre to the nearest point."""
        if not len(self._points):
            return math.inf
        x, y = self._points.T
        return math.sqrt(float((x * x + y * y).min()))

    def is_way_free(self, target: Point) -> bool:
        """Return True when the body can move straight to a point with room on all sides."""
        length = math.hypot(target.x, target.y)
        if length == 0 or not len(self._points):
            return True
        direction = np.array([target.x, target.y]) / length
        along = (self._points @ direction).clip(0.0, length)
        gaps = self._points - along[:, None] * direction
        return float(np.hypot(gaps[:, 0], gaps[:, 1]).min()) >= self._nearest_allowed()

    def sidestep(self, target: Point) -> Point:
        """Return the point as far away as the target, in the direction nearest to it, that is free.

        If no direction is free, return the target itself.
        """
        distance, bearing = math.hypot(target.x, target.y), math.atan2(target.y, target.x)
        for aside in _ASIDES_RAD:
            turned = bearing + aside
            point = Point(distance * math.cos(turned), distance * math.sin(turned))
            if self.is_way_free(point):
                return point
        return target

    def limit(self, wanted: BodyVelocity) -> BodyVelocity:
        """Return the fastest motion on the wanted arc that can still stop before touching anything.

        The arc stays the same, the speed is a share of the wanted one. If no share is safe, only
        the turn remains, which is always safe for a round body.
        """
        if wanted.speed_mps == 0 or not len(self._points):
            return wanted
        for share in _SHARES:
            slower = BodyVelocity(share * wanted.speed_mps, share * wanted.turn_radps)
            if self._is_arc_free(slower):
                return slower
        return BodyVelocity(0.0, wanted.turn_radps)

    def _is_arc_free(self, velocity: BodyVelocity) -> bool:
        stopping_s = _REACTION_S + abs(velocity.speed_mps) / (2 * MAX_ACCELERATION_MPS2)
        allowed = self._nearest_allowed()
        step_s = stopping_s / _N_SAMPLES
        moments = (*(nth * step_s for nth in range(1, _N_SAMPLES)), stopping_s)
        places = [move_along_arc(Pose(0.0, 0.0), velocity, moment) for moment in moments]
        dx = self._points[:, 0] - np.array([[place.x] for place in places])
        dy = self._points[:, 1] - np.array([[place.y] for place in places])
        return math.sqrt(float((dx * dx + dy * dy).min())) >= allowed

    def _nearest_allowed(self) -> float:
        """Return how near to a point the body's centre may come."""
        here = self._nearest_m
        if here >= BODY_RADIUS_M + KEEP_OFF_M:
            return BODY_RADIUS_M + KEEP_OFF_M
        # A robot that is too near already may pass and leave, but not touch.
        return min(BODY_RADIUS_M + _SQUEEZE_M, here - 1e-3)


_CRUISE_MPS = 0.8
_CREEP_MPS = 0.08
_TURN_RADPS = 1.2
_COMFORT_RADPS2 = 1.5
_COMFORT_MPS2 = 0.5

_LOOKAHEADS_M = (0.8, 0.6, 0.45, 0.3, 0.15)
_LOOKAHEAD_S = 0.9
_LEAST_LOOKAHEAD_M = 0.3
"""Least lookahead on a free way, so that the robot does not waver."""
_ROOMY_M = 0.4
"""With less room than this around its edge the robot slows down."""

_TURN_FIRST_RAD = 1.0
"""A path that starts more than this to the side is turned to on the spot."""
_TURNED_RAD = 0.1
_NARROW_M = 0.12
"""With less room than this an arc would touch obstacles that turn and straight line avoid."""
_TURN_FIRST_IF_NARROW_RAD = 0.25

_ARRIVED_M = 0.08
_ARRIVED_RAD = 0.04
_PASSED_M = 0.14
"""Within this distance a robot that has just passed the goal does not turn back to it."""
_SEARCH_AHEAD_M = 1.0
_STEP_M = 0.05


class PathFollower:
    """Drives along one path to one goal."""

    def __init__(self, path: Path, goal: Pose) -> None:
        self._points = _sample(path)
        self._goal = goal
        self._at = 0
        self._is_turning = False
        self._is_at_end = False

    @property
    def distance_left_m(self) -> float:
        """Remaining path length from the robot's last position on it."""
        return (len(self._points) - 1 - self._at) * _STEP_M

    @property
    def points_left(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """The path from the robot's last position on it, a point every 5 cm."""
        return self._points[self._at :]

    def has_arrived(self, pose: Pose) -> bool:
        """Return True when the robot stands on the goal with the goal's heading."""
        turn_left = wrap_angle(self._goal.yaw_rad - pose.yaw_rad)
        return self._is_at_end and abs(turn_left) <= _ARRIVED_RAD

    def steer(self, pose: Pose, speed_mps: float, obstacles: Obstacles) -> BodyVelocity:
        """Return the velocity that follows the path from here."""
        self._advance(pose)
        distance = pose.point.distance_to(self._goal.point)
        if self._is_at_end or distance <= _ARRIVED_M:
            self._is_at_end = True
            return _turn_by(wrap_angle(self._goal.yaw_rad - pose.yaw_rad))
        target = self._choose_target(pose, speed_mps, obstacles)
        bearing = math.atan2(target.y, target.x)
        if distance <= _PASSED_M and abs(bearing) > _TURN_FIRST_RAD:
            self._is_at_end = True
            return STANDING
        if self._must_turn(bearing, obstacles):
            return _turn_by(bearing)
        return self._pursue(target, obstacles)

    def _advance(self, pose: Pose) -> None:
        """Find the nearest point of the path a little ahead of the last one."""
        last = self._at + round(_SEARCH_AHEAD_M / _STEP_M)
        ahead = self._points[self._at : last + 1] - (pose.x, pose.y)
        self._at += int(np.hypot(ahead[:, 0], ahead[:, 1]).argmin())

    def _choose_target(self, pose: Pose, speed_mps: float, obstacles: Obstacles) -> Point:
        """Return the furthest point to aim at, in the robot's frame, with a free straight way.

        If there is none, the robot is nearer to an obstacle than the path, and steps around it.
        """
        base_from_map = pose.inverse()
        wanted = max(_LOOKAHEAD_S * speed_mps, _LEAST_LOOKAHEAD_M)
        target = Point(0.0, 0.0)
        for reach in _LOOKAHEADS_M:
            if reach > wanted:
                continue
            at = min(self._at + round(reach / _STEP_M), len(self._points) - 1)
            target = base_from_map.transform(Point(*map(float, self._points[at])))
            if obstacles.is_way_free(target):
                return target
        return obstacles.sidestep(target)

    def _must_turn(self, bearing_rad: float, obstacles: Obstacles) -> bool:
        first = _TURN_FIRST_RAD if obstacles.room_m > _NARROW_M else _TURN_FIRST_IF_NARROW_RAD
        limit = _TURNED_RAD if self._is_turning else first
        self._is_turning = abs(bearing_rad) > limit
        return self._is_turning

    def _pursue(self, target: Point, obstacles: Obstacles) -> BodyVelocity:
        squared = target.x**2 + target.y**2
        curvature = 2 * target.y / squared if squared > 0 else 0.0
        room = max(min(obstacles.room_m / _ROOMY_M, 1.0), 0.3)
        approach = math.sqrt(2 * _COMFORT_MPS2 * max(self.distance_left_m, 0.0))
        speed = min(_CRUISE_MPS * room, approach)
        if abs(curvature) * speed > _TURN_RADPS:
            speed = _TURN_RADPS / abs(curvature)
        speed = max(speed, _CREEP_MPS)
        return BodyVelocity(speed, curvature * speed)


def _turn_by(angle_rad: float) -> BodyVelocity:
    """Turn on the spot, slowing down early enough to stop at the angle."""
    speed = min(math.sqrt(2 * _COMFORT_RADPS2 * abs(angle_rad)), _TURN_RADPS)
    return BodyVelocity(0.0, math.copysign(speed, angle_rad))


def _sample(path: Path) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Return a point about every 5 cm of a path, its last one included."""
    corners = np.array([(point.x, point.y) for point in path.points])
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    n_steps = max(math.ceil(along[-1] / _STEP_M), 1)
    places = np.linspace(0.0, along[-1], n_steps + 1)
    return np.stack([np.interp(places, along, corners[:, axis]) for axis in (0, 1)], axis=1)
