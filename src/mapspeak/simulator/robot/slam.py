"""Where the robot is in a map: SLAM, which makes the map, and localisation in a finished one.

SLAM: the robot's first pose is (0, 0, 0) of the map frame. Between scans the pose follows odometry;
now and then, as the robot moves, a scan is matched to the map and then added to it.

Localisation is what AMCL and a map server are to a real robot. The robot is told roughly where it
stands, as a person does with RViz's "2D Pose Estimate"; from then on it follows odometry and
matches scans to the map, which never changes. What the scans show and the map does not is kept
apart, as an obstacle layer of a costmap is, and planned around.
"""

import math

import cv2
import numpy as np

from mapspeak.geometry import Pose
from mapspeak.simulator.robot.gridmap import LogOddsMap
from mapspeak.simulator.robot.lidar import LidarScan
from mapspeak.simulator.robot.scanmatch import (
    FinishedField,
    FloatArray,
    SurfaceField,
    match_scan,
    place_points,
)
from mapspeak.spatial import OccupancyGrid

__all__ = ["Localiser", "Mapper", "Pacing"]

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
        """Move the pose as the wheels report."""
        self._odom_from_base = odom_from_base

    def add_scan(self, scan: LidarScan) -> None:
        """Match a scan to the map and add it, if the robot has moved enough to learn from it."""
        if not self._pacing.is_due(self._odom_from_base, scan.stamp_s):
            return
        if scan.n_returns >= _FEWEST_RETURNS and self._place(scan):
            ends = place_points(self.map_from_base, scan.ends_in_base)
            self._map.insert(ends, scan.is_return)
            self.n_updates += 1

    def publish(self, *, stamp_s: float) -> OccupancyGrid:
        """Return the map; the same one until a scan has changed it."""
        if self._published is None or self._n_published != self.n_updates:
            self._published = self._map.publish(stamp_s=stamp_s)
            self._n_published = self.n_updates
        return self._published

    def _place(self, scan: LidarScan) -> bool:
        """Correct the pose by the map made so far; False when the scan does not fit in."""
        if self.n_updates == 0:
            return True
        match = match_scan(SurfaceField(self._map), scan.points_in_base, self.map_from_base)
        if match.score_ratio is not None and match.score_ratio < _LOWEST_SCORE_RATIO:
            return False
        self._map_from_odom = match.map_from_base @ self._odom_from_base.inverse()
        return True


FIRST_GUESS_M = 0.1
FIRST_GUESS_RAD = 0.05
"""The spread of the pose that the robot is told at first."""

UPDATE_M, UPDATE_RAD = 0.25, 0.2
"""How far the robot moves between two corrections: AMCL's own defaults in Nav2."""

"""Below this a scan does not fit the map and does not move the robot."""
_NEW_M = 0.25
"""What is seen this far from everything on the map is new; less may be an error of the pose."""
_OBSTACLE_RANGE_M = 5.0
"""Farther returns mark nothing: there the error of the heading counts for too much."""
_FEWEST_HITS = 3
"""A cell is new once so many scans have hit it."""


class Localiser:
    """The robot's place in a map that is known and stays as it is.

    Attributes:
        n_updates: How many scans have been matched.

    Args:
        known: The map; its frame is the map frame.
        pose: Where the robot truly stands in it.
        random: Of what it is told at first.
    """

    def __init__(self, known: OccupancyGrid, pose: Pose, *, random: np.random.Generator) -> None:
        self.n_updates = 0
        self._known = known
        self._field = FinishedField(LogOddsMap.of(known))
        dx, dy = random.normal(0.0, FIRST_GUESS_M, 2).tolist()
        told = Pose(pose.x + dx, pose.y + dy, pose.yaw_rad + random.normal(0.0, FIRST_GUESS_RAD))
        self._map_from_odom = told
        self._odom_from_base = Pose(0.0, 0.0, 0.0)
        self._pacing = Pacing(distance_m=UPDATE_M, turn_rad=UPDATE_RAD)
        self._layer = _ObstacleLayer(known)

    @property
    def map_from_base(self) -> Pose:
        """Where the robot believes it is."""
        return self._map_from_odom @ self._odom_from_base

    @property
    def planning_map(self) -> OccupancyGrid:
        """The known map and the obstacles seen besides; the same one until there are more."""
        return self._layer.grid

    def follow_odometry(self, odom_from_base: Pose) -> None:
        """Move the pose as the wheels report."""
        self._odom_from_base = odom_from_base

    def add_scan(self, scan: LidarScan) -> None:
        """Correct the pose by a scan, if the robot has moved enough to learn from it."""
        if not self._pacing.is_due(self._odom_from_base, scan.stamp_s):
            return
        match = match_scan(self._field, scan.points_in_base, self.map_from_base)
        if match.score_ratio is not None and match.score_ratio < _LOWEST_SCORE_RATIO:
            return
        self._map_from_odom = match.map_from_base @ self._odom_from_base.inverse()
        self.n_updates += 1
        near = scan.points_in_base[np.hypot(*scan.points_in_base.T) <= _OBSTACLE_RANGE_M]
        self._layer.mark(place_points(self.map_from_base, near))

    def publish(self, *, stamp_s: float) -> OccupancyGrid:
        """Return the known map, which is as old as it is."""
        del stamp_s
        return self._known


class _ObstacleLayer:
    """What stands on floor that the map calls free."""

    def __init__(self, known: OccupancyGrid) -> None:
        self.grid = known
        free = np.logical_not(known.occupied).view(np.uint8)
        distance = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_5)
        self._is_open = known.free & (distance * known.resolution_m > _NEW_M)
        self._n_hits = np.zeros(known.cells.shape, dtype=np.int16)

    def mark(self, points_in_map: FloatArray) -> None:
        """Count what a scan shows on open floor."""
        rows, cols = self.grid.cells_at(points_in_map)
        is_inside = self.grid.contains_cells(rows, cols)
        rows, cols = rows[is_inside], cols[is_inside]
        is_news = self._is_open[rows, cols]
        if not is_news.any():
            return
        cells = np.unique(np.stack([rows[is_news], cols[is_news]], axis=1), axis=0)
        self._n_hits[cells[:, 0], cells[:, 1]] += 1
        found = cells[self._n_hits[cells[:, 0], cells[:, 1]] >= _FEWEST_HITS]
        if (self.grid.cells[found[:, 0], found[:, 1]] < _OCCUPIED).any():
            with_them = self.grid.cells.copy()
            with_them[found[:, 0], found[:, 1]] = _OCCUPIED
            self.grid = OccupancyGrid(
                cells=with_them,
                resolution_m=self.grid.resolution_m,
                origin=self.grid.origin,
                stamp_s=self.grid.stamp_s,
            )


_OCCUPIED = 100
