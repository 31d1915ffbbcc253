"""Path following: regulated pure pursuit, and the turn to the goal's heading at its end.

Pure pursuit is Coulter, "Implementation of the pure pursuit path tracking algorithm" (1992); the
speed is regulated by curvature, nearness and approach as in Macenski et al., "Regulated pure
pursuit for robot path tracking" (2023).
"""

import math

import numpy as np

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.simulator.avoidance import Obstacles
from mapspeak.simulator.motion import STANDING, Velocity
from mapspeak.spatial.paths import Path

__all__ = ["PathFollower"]

_CRUISE_MPS = 0.8
_CREEP_MPS = 0.08
_TURN_RADPS = 1.2
_COMFORT_RADPS2 = 1.5
_COMFORT_MPS2 = 0.5

_LOOKAHEADS_M = (0.8, 0.6, 0.45, 0.3, 0.15)
_LOOKAHEAD_S = 0.9
_LEAST_LOOKAHEAD_M = 0.3
"""Where the way is free, no nearer point is aimed at, so that the robot does not waver."""
_ROOMY_M = 0.4
"""With less room than this around its edge the robot slows down."""

_TURN_FIRST_RAD = 1.0
"""A path that starts more than this to the side is turned to on the spot."""
_TURNED_RAD = 0.1
_NARROW_M = 0.12
"""With less room than this an arc would touch what a turn and a straight line pass."""
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
        """Along the path from where the robot was last seen on it."""
        return (len(self._points) - 1 - self._at) * _STEP_M

    @property
    def points_left(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """The path from where the robot was last seen on it, a point every 5 cm."""
        return self._points[self._at :]

    def has_arrived(self, pose: Pose) -> bool:
        """True when the robot stands on the goal with the goal's heading."""
        turn_left = wrap_angle(self._goal.yaw_rad - pose.yaw_rad)
        return self._is_at_end and abs(turn_left) <= _ARRIVED_RAD

    def steer(self, pose: Pose, speed_mps: float, obstacles: Obstacles) -> Velocity:
        """Gives the velocity that follows the path from here."""
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
        """Finds the nearest point of the path a little ahead of the last one."""
        last = self._at + round(_SEARCH_AHEAD_M / _STEP_M)
        ahead = self._points[self._at : last + 1] - (pose.x, pose.y)
        self._at += int(np.hypot(ahead[:, 0], ahead[:, 1]).argmin())

    def _choose_target(self, pose: Pose, speed_mps: float, obstacles: Obstacles) -> Point:
        """Gives the furthest point to aim at, in the robot's frame, with a free straight way.

        Where there is none, the robot stands nearer to something than the path does, and steps
        around it.
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

    def _pursue(self, target: Point, obstacles: Obstacles) -> Velocity:
        squared = target.x**2 + target.y**2
        curvature = 2 * target.y / squared if squared > 0 else 0.0
        room = max(min(obstacles.room_m / _ROOMY_M, 1.0), 0.3)
        approach = math.sqrt(2 * _COMFORT_MPS2 * max(self.distance_left_m, 0.0))
        speed = min(_CRUISE_MPS * room, approach)
        if abs(curvature) * speed > _TURN_RADPS:
            speed = _TURN_RADPS / abs(curvature)
        speed = max(speed, _CREEP_MPS)
        return Velocity(speed, curvature * speed)


def _turn_by(angle_rad: float) -> Velocity:
    """Turns on the spot, slowing down early enough to stop at the angle."""
    speed = min(math.sqrt(2 * _COMFORT_RADPS2 * abs(angle_rad)), _TURN_RADPS)
    return Velocity(0.0, math.copysign(speed, angle_rad))


def _sample(path: Path) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Gives a point about every 5 cm of a path, its last one included."""
    corners = np.array([(point.x, point.y) for point in path.points])
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    n_steps = max(math.ceil(along[-1] / _STEP_M), 1)
    places = np.linspace(0.0, along[-1], n_steps + 1)
    return np.stack([np.interp(places, along, corners[:, axis]) for axis in (0, 1)], axis=1)
