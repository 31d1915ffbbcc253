"""SLAM: keeps the map and the robot's place in it from odometry and scans.

The robot's first pose is (0, 0, 0) of the map frame. Between scans the pose follows odometry; now
and then, as the robot moves, a scan is matched to the map and then added to it.
"""

from mapspeak.geometry import Pose
from mapspeak.simulator.gridmap import LogOddsMap
from mapspeak.simulator.lidar import LidarScan
from mapspeak.simulator.pacing import Pacing
from mapspeak.simulator.scanmatch import match_scan, place_points
from mapspeak.simulator.surfacefield import SurfaceField
from mapspeak.spatial import OccupancyGrid

__all__ = ["Mapper"]

_UPDATE_DISTANCE_M = 0.15
_UPDATE_TURN_RAD = 0.1

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
        self._pacing = Pacing(distance_m=_UPDATE_DISTANCE_M, turn_rad=_UPDATE_TURN_RAD)
        self._published: OccupancyGrid | None = None
        self._n_published = -1

    @property
    def map_from_base(self) -> Pose:
        """Where the robot believes it is."""
        return self._map_from_odom @ self._odom_from_base

    @property
    def planning_map(self) -> OccupancyGrid | None:
        """None: the robot plans on the map it publishes."""
        return None

    def follow_odometry(self, odom_from_base: Pose) -> None:
        """Moves the pose as the wheels report."""
        self._odom_from_base = odom_from_base

    def add_scan(self, scan: LidarScan) -> None:
        """Matches a scan to the map and adds it, if the robot has moved enough to learn from it."""
        if not self._pacing.is_due(self._odom_from_base, scan.stamp_s):
            return
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

    def _place(self, scan: LidarScan) -> bool:
        """Corrects the pose by the map made so far; False when the scan does not fit in."""
        if self.n_updates == 0:
            return True
        match = match_scan(SurfaceField(self._map), scan.points_in_base, self.map_from_base)
        if match.score_ratio is not None and match.score_ratio < _LOWEST_SCORE_RATIO:
            return False
        self._map_from_odom = match.map_from_base @ self._odom_from_base.inverse()
        return True
