"""SLAM, which makes the map, and localisation in a finished one.

SLAM: the robot's first pose is (0, 0, 0) of the map frame. Between scans the pose follows odometry;
now and then, as the robot moves, a scan is matched to the map and then added to it.

Localisation is what AMCL and a map server are to a real robot. The robot is told roughly where it
stands, as a person does with RViz's "2D Pose Estimate"; from then on it follows odometry and
matches scans to the map, which never changes. Obstacles in scans
but not on the map are kept apart, like an obstacle layer of a costmap, and planned around.
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

_PERIOD_S = 1.0
_LEAST_MOTION = 0.01
"""Metres or radians: a robot that stands still learns nothing from one more scan."""
_LOWEST_SCORE_RATIO = 0.35
"""Below this a scan does not fit the map; it neither moves the robot nor marks the map."""

_MAPPING_STEP = (0.15, 0.1)
"""Distance in metres, or turn in radians, between two scans of the map."""
_FEWEST_RETURNS = 40
"""A scan with fewer returns places nothing; odometry goes on alone."""

_LOCALISING_STEP = (0.25, 0.2)
"""Likewise between two corrections: AMCL's own defaults in Nav2."""
_FIRST_GUESS_M = 0.1
_FIRST_GUESS_RAD = 0.05
"""The spread of the pose that the robot is told at first."""
_NEW_M = 0.25
"""Hits this far from everything on the map are new; nearer ones may be errors of the pose."""
_OBSTACLE_RANGE_M = 5.0
"""Farther returns mark nothing: there the error of the heading counts for too much."""
_FEWEST_HITS = 3
"""Number of hits from which a cell counts as new."""
_OCCUPIED = 100


class PoseTracker:
    """A pose in the map that follows odometry and is corrected by some of the scans.

    Args:
        step: Metres, or radians of turning, after which the next scan is used.
    """

    def __init__(self, map_from_odom: Pose, *, step: tuple[float, float]) -> None:
        self._map_from_odom = map_from_odom
        self._odom_from_base = Pose(0.0, 0.0, 0.0)
        self._step_m, self._step_rad = step
        self._odom_at_last: Pose | None = None
        self._last_s = -math.inf

    @property
    def map_from_base(self) -> Pose:
        """The robot's estimated pose."""
        return self._map_from_odom @ self._odom_from_base

    def follow_odometry(self, odom_from_base: Pose) -> None:
        """Move the pose as the wheels report."""
        self._odom_from_base = odom_from_base

    def _is_due(self, now_s: float) -> bool:
        """Return True when a scan is to be used; then it counts as the last one."""
        if not self._has_moved_enough(now_s):
            return False
        self._odom_at_last = self._odom_from_base
        self._last_s = now_s
        return True

    def _has_moved_enough(self, now_s: float) -> bool:
        if self._odom_at_last is None:
            return True
        moved = self._odom_at_last.inverse() @ self._odom_from_base
        distance, turn = math.hypot(moved.x, moved.y), abs(moved.yaw_rad)
        if distance >= self._step_m or turn >= self._step_rad:
            return True
        has_moved = distance >= _LEAST_MOTION or turn >= _LEAST_MOTION
        return has_moved and now_s - self._last_s >= _PERIOD_S

    def _correct(self, field: SurfaceField, scan: LidarScan) -> bool:
        """Correct the pose by a scan; False when the scan does not fit the map."""
        match = match_scan(field, scan.points_in_base, self.map_from_base)
        if match.score_ratio is not None and match.score_ratio < _LOWEST_SCORE_RATIO:
            return False
        self._map_from_odom = match.map_from_base @ self._odom_from_base.inverse()
        return True


class Mapper(PoseTracker):
    """Scan-to-map SLAM."""

    def __init__(self) -> None:
        super().__init__(Pose(0.0, 0.0, 0.0), step=_MAPPING_STEP)
        self._map = LogOddsMap()
        self.n_updates = 0
        self._published: OccupancyGrid | None = None

    @property
    def planning_map(self) -> OccupancyGrid | None:
        """None: the robot plans on the map it publishes."""
        return None

    def forget_obstacles(self) -> None:
        """Do nothing: scans clear obstacles from the robot's own map."""

    def add_scan(self, scan: LidarScan) -> None:
        """Match a scan to the map and add it, if the robot has moved enough to learn from it."""
        if not self._is_due(scan.stamp_s) or scan.n_returns < _FEWEST_RETURNS:
            return
        if self.n_updates == 0 or self._correct(SurfaceField(self._map), scan):
            ends = place_points(self.map_from_base, scan.ends_in_base)
            self._map.insert(ends, scan.is_return)
            self.n_updates += 1
            self._published = None

    def publish(self, *, stamp_s: float) -> OccupancyGrid:
        """Return the map; the same one until a scan has changed it."""
        if self._published is None:
            self._published = self._map.publish(stamp_s=stamp_s)
        return self._published


class Localiser(PoseTracker):
    """Localisation in a known map that never changes.

    Args:
        known: The map; its frame is the map frame.
        pose: The robot's true pose in it.
        random: For the error of the first guess.
    """

    def __init__(self, known: OccupancyGrid, pose: Pose, *, random: np.random.Generator) -> None:
        dx, dy = random.normal(0.0, _FIRST_GUESS_M, 2).tolist()
        told = Pose(pose.x + dx, pose.y + dy, pose.yaw_rad + random.normal(0.0, _FIRST_GUESS_RAD))
        super().__init__(told, step=_LOCALISING_STEP)
        self._known = known
        self._field = FinishedField(LogOddsMap.of(known))
        self._layer = _ObstacleLayer(known)

    @property
    def planning_map(self) -> OccupancyGrid:
        """The known map and the obstacles seen besides; the same one until there are more."""
        return self._layer.grid

    def forget_obstacles(self) -> None:
        """Forget obstacles that are not on the map, as when a costmap is cleared."""
        self._layer = _ObstacleLayer(self._known)

    def add_scan(self, scan: LidarScan) -> None:
        """Correct the pose by a scan, if the robot has moved enough to learn from it."""
        if self._is_due(scan.stamp_s) and self._correct(self._field, scan):
            near = scan.points_in_base[np.hypot(*scan.points_in_base.T) <= _OBSTACLE_RANGE_M]
            self._layer.mark(place_points(self.map_from_base, near))

    def publish(self, *, stamp_s: float) -> OccupancyGrid:
        """Return the known map with its original stamp."""
        del stamp_s
        return self._known


class _ObstacleLayer:
    """Obstacles on floor that is free on the map."""

    def __init__(self, known: OccupancyGrid) -> None:
        self.grid = known
        free = np.logical_not(known.occupied).view(np.uint8)
        distance = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_5)
        self._is_open = known.free & (distance * known.resolution_m > _NEW_M)
        self._n_hits = np.zeros(known.cells.shape, dtype=np.int16)

    def mark(self, points_in_map: FloatArray) -> None:
        """Count the hits of a scan on open floor."""
        rows, cols = self.grid.cells_at(points_in_map)
        is_inside = self.grid.contains_cells(rows, cols)
        rows, cols = rows[is_inside], cols[is_inside]
        is_new = self._is_open[rows, cols]
        if not is_new.any():
            return
        cells = np.unique(np.stack([rows[is_new], cols[is_new]], axis=1), axis=0)
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
