"""When a scan is worth a look: after some way, some turn, or some time on the move."""

import math

from mapspeak.geometry import Pose

__all__ = ["Pacing"]

_PERIOD_S = 1.0
_LEAST_MOTION = 0.01
"""Metres or radians: a robot that stands still learns nothing from one more scan."""


class Pacing:
    """Remembers at which scan the robot last learned something.

    Args:
        distance_m: After so much way the next scan is worth a look.
        turn_rad: Or after so much turning.
    """

    def __init__(self, *, distance_m: float, turn_rad: float) -> None:
        self._distance_m = distance_m
        self._turn_rad = turn_rad
        self._odom_at_last: Pose | None = None
        self._last_s = -math.inf

    def is_due(self, odom_from_base: Pose, now_s: float) -> bool:
        """True when a scan is to be used; then it counts as the last one."""
        if not self._has_moved_enough(odom_from_base, now_s):
            return False
        self._odom_at_last = odom_from_base
        self._last_s = now_s
        return True

    def _has_moved_enough(self, odom_from_base: Pose, now_s: float) -> bool:
        if self._odom_at_last is None:
            return True
        moved = self._odom_at_last.inverse() @ odom_from_base
        distance, turn = math.hypot(moved.x, moved.y), abs(moved.yaw_rad)
        if distance >= self._distance_m or turn >= self._turn_rad:
            return True
        has_moved = distance >= _LEAST_MOTION or turn >= _LEAST_MOTION
        return has_moved and now_s - self._last_s >= _PERIOD_S
