"""SLAM: keeps the map and the robot's place in it from odometry and scans.

The robot's first pose is (0, 0, 0) of the map frame. Between scans the pose follows odometry; now
and then, as the robot moves, a scan is matched to the map and then added to it.
"""

import math

from mapspeak.geometry import Pose
from mapspeak.simulator.gridmap import LogOddsMap
from mapspeak.simulator.lidar import LidarScan
from mapspeak.simulator.scanmatch import match_scan, place_points
from mapspeak.simulator.surfacefield import SurfaceField
from mapspeak.spatial import OccupancyGrid

__all__ = ["Mapper"]

_UPDATE_DISTANCE_M = 0.15
_UPDATE_TURN_RAD = 0.1
_UPDATE_PERIOD_S = 1.0
_LEAST_MOTION = 0.01
"""Metres or radians: a robot that stands still learns nothing from one more scan."""

_FEWEST_RETURNS = 40
"""A scan with fewer returns places nothing; odometry goes on alone."""
_LOWEST_SCORE_RATIO = 0.35
"""Below this a scan does not fit the map; it neither moves the robot nor marks the map."""


class Mapper:
    """Scan-to-map SLAM.

    Attributes:
        n_updates: How many scans the map was made from.
    """

    def __init__(self) -> None:
        self.n_updates = 0
        self._map = LogOddsMap()
        self._map_from_odom = Pose(0.0, 0.0, 0.0)
        self._odom_from_base = Pose(0.0, 0.0, 0.0)
        self._odom_at_update: Pose | None = None
        self._updated_s = -math.inf
        self._published: OccupancyGrid | None = None
        self._n_published = -1

    @property
    def map_from_base(self) -> Pose:
        """Where the robot believes it is."""
        return self._map_from_odom @ self._odom_from_base

    def follow_odometry(self, odom_from_base: Pose) -> None:
        """Moves the pose as the wheels report."""
        self._odom_from_base = odom_from_base

    def add_scan(self, scan: LidarScan) -> None:
        """Matches a scan to the map and adds it, if the robot has moved enough to learn from it."""
        if not self._is_due(scan.stamp_s):
            return
        self._odom_at_update = self._odom_from_base
        self._updated_s = scan.stamp_s
        if scan.n_returns >= _FEWEST_RETURNS and self._place(scan):
            ends = place_points(self.map_from_base, scan.ends_in_base)
            self._map.insert(ends, scan.is_return)
            self.n_updates += 1

    def publish(self, *, stamp_s: float) -> OccupancyGrid:
        """Gives the map; the same one until a scan has changed it."""
        if self._published is None or self._n_published != self.n_updates:
            self._published = self._map.publish(stamp_s=stamp_s)
            self._n_published = self.n_updates
        return self._published

    def _is_due(self, now_s: float) -> bool:
        if self._odom_at_update is None:
            return True
        moved = self._odom_at_update.inverse() @ self._odom_from_base
        distance, turn = math.hypot(moved.x, moved.y), abs(moved.yaw_rad)
        if distance >= _UPDATE_DISTANCE_M or turn >= _UPDATE_TURN_RAD:
            return True
        has_moved = distance >= _LEAST_MOTION or turn >= _LEAST_MOTION
        return has_moved and now_s - self._updated_s >= _UPDATE_PERIOD_S

    def _place(self, scan: LidarScan) -> bool:
        """Corrects the pose by the map made so far; False when the scan does not fit in."""
        if self.n_updates == 0:
            return True
        match = match_scan(SurfaceField(self._map), scan.points_in_base, self.map_from_base)
        if match.score_ratio is not None and match.score_ratio < _LOWEST_SCORE_RATIO:
            return False
        self._map_from_odom = match.map_from_base @ self._odom_from_base.inverse()
        return True
