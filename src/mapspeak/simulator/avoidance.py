"""What the latest scan forbids: how near things are, and which motions would touch them.

Everything is in the robot's own frame, so no error of the map or of the pose comes in.
"""

import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point, Pose
from mapspeak.simulator.motion import (
    BODY_RADIUS_M,
    MAX_ACCELERATION_MPS2,
    Velocity,
    move_along_arc,
)
from mapspeak.simulator.scanmatch import place_points

__all__ = ["KEEP_OFF_M", "Obstacles"]

FloatArray = NDArray[np.float64]

_NEAR_M = 2.5
"""Points further away than this cannot be touched before the next scans."""
KEEP_OFF_M = 0.03
"""How far the body's edge stays from a point, three times the LiDAR's noise."""
_SQUEEZE_M = 0.01
"""How near it may pass where it stands nearer than that already."""
_REACTION_S = 0.25
_ASIDES_RAD = tuple(
    math.copysign(math.radians(degrees), side) for degrees in range(15, 106, 15) for side in (1, -1)
)
_SHARES = (1.0, 0.6, 0.3, 0.15)
_N_SAMPLES = 6


class Obstacles:
    """The points of a scan near the robot, as it stands now."""

    def __init__(self, points_in_base: FloatArray) -> None:
        near = np.einsum("ij,ij->i", points_in_base, points_in_base) < _NEAR_M**2
        self._points = points_in_base[near]

    @classmethod
    def seen_from(cls, points_in_base: FloatArray, now_from_then: Pose) -> "Obstacles":
        """Gives the points of a scan after the robot has moved on a little."""
        return cls(place_points(now_from_then, points_in_base))

    @property
    def room_m(self) -> float:
        """How much room the body's edge has to the nearest point."""
        return self._nearest_m - BODY_RADIUS_M

    @cached_property
    def _nearest_m(self) -> float:
        """How far the nearest point is from the body's centre."""
        return self._distance_from(Point(0.0, 0.0))

    def is_way_free(self, target: Point) -> bool:
        """True when the body can move straight to a point without coming too near to anything."""
        length = math.hypot(target.x, target.y)
        if length == 0 or not len(self._points):
            return True
        direction = np.array([target.x, target.y]) / length
        along = (self._points @ direction).clip(0.0, length)
        gaps = self._points - along[:, None] * direction
        return float(np.hypot(gaps[:, 0], gaps[:, 1]).min()) >= self._nearest_allowed()

    def sidestep(self, target: Point) -> Point:
        """Gives the point as far away as the target, in the direction nearest to it, that is free.

        Where no direction is, it is the target itself.
        """
        distance, bearing = math.hypot(target.x, target.y), math.atan2(target.y, target.x)
        for aside in _ASIDES_RAD:
            turned = bearing + aside
            point = Point(distance * math.cos(turned), distance * math.sin(turned))
            if self.is_way_free(point):
                return point
        return target

    def limit(self, wanted: Velocity) -> Velocity:
        """Gives the fastest motion on the wanted arc that can still stop before touching anything.

        The arc stays the same, the speed is a share of what is wanted. Where none will do, only
        the turn is left, which a round body may always make.
        """
        if wanted.speed_mps == 0 or not len(self._points):
            return wanted
        for share in _SHARES:
            slower = Velocity(share * wanted.speed_mps, share * wanted.turn_radps)
            if self._is_arc_free(slower):
                return slower
        return Velocity(0.0, wanted.turn_radps)

    def _is_arc_free(self, velocity: Velocity) -> bool:
        stopping_s = _REACTION_S + abs(velocity.speed_mps) / (2 * MAX_ACCELERATION_MPS2)
        allowed = self._nearest_allowed()
        step_s = stopping_s / _N_SAMPLES
        moments = (*(nth * step_s for nth in range(1, _N_SAMPLES)), stopping_s)
        places = [move_along_arc(Pose(0.0, 0.0), velocity, moment) for moment in moments]
        dx = self._points[:, 0] - np.array([[place.x] for place in places])
        dy = self._points[:, 1] - np.array([[place.y] for place in places])
        return math.sqrt(float((dx * dx + dy * dy).min())) >= allowed

    def _nearest_allowed(self) -> float:
        """Gives how near to a point the body's centre may come."""
        here = self._nearest_m
        if here >= BODY_RADIUS_M + KEEP_OFF_M:
            return BODY_RADIUS_M + KEEP_OFF_M
        # Who stands too near already may pass and leave, but not touch.
        return min(BODY_RADIUS_M + _SQUEEZE_M, here - 1e-3)

    def _distance_from(self, place: Point) -> float:
        if not len(self._points):
            return math.inf
        dx, dy = self._points[:, 0] - place.x, self._points[:, 1] - place.y
        return math.sqrt(float((dx * dx + dy * dy).min()))
