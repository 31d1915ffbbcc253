"""The robot's own navigation: plans on its map, drives on its own pose, and says how it went.

It sees what a real navigation stack sees: the SLAM map and pose, odometry and the latest scan.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.robot import Cause, CauseCode, GoalState, GoalStatus
from mapspeak.simulator.robot.controller import Obstacles, PathFollower
from mapspeak.simulator.robot.physics import STANDING, BodyVelocity
from mapspeak.simulator.worlds.world import BODY_RADIUS_M
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import Path, clearance_m, distances_from, find_path

_PLANNING_RADII_M = (BODY_RADIUS_M + 0.05, BODY_RADIUS_M + 0.01)
"""The radius to plan with, and the one for places that are too narrow for it."""
_CHECK_PERIOD_S = 1.0
_SLACK_M = 0.06
"""A path stays good while the map lacks no more than this of the radius it was planned with."""

_UNDER_ROBOT_POINTS = 8
"""The first points of a path, one every 5 cm, are not checked again: the robot is nearly there."""

_PATIENCE_S = 6.0
"""Longer than it takes to turn right round on the spot."""
_PROGRESS_M = 0.1
_MOST_RECOVERIES = 4
_BACK_OFF_MPS = -0.15
_BACK_OFF_S = 2.5
_LOOK_AROUND_RADPS = 0.8
_LOOK_AROUND_S = 2.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Senses:
    """The robot's knowledge at one moment.

    Attributes:
        pose: By SLAM, in the map frame.
        speed_mps: By the wheels.
        obstacles: By the latest scan.
        map: By SLAM.
    """

    now_s: float
    pose: Pose
    speed_mps: float
    obstacles: Obstacles
    map: OccupancyGrid


class Navigator:
    """Drives to one goal at a time."""

    def __init__(self) -> None:
        self._goal: Pose | None = None
        self._follower: PathFollower | None = None
        self._planning_radius_m = _PLANNING_RADII_M[0]
        self._checked_s = -math.inf
        self._checked_map: OccupancyGrid | None = None
        self._recovery: tuple[BodyVelocity, float] | None = None
        """A motion to get free, and when it ends."""
        self._milestone: tuple[float, float] | None = None
        """Least remaining path length so far, and its time."""
        self._status = GoalStatus(state=GoalState.CANCELLED)

    @property
    def status(self) -> GoalStatus:
        """Status of the latest drive."""
        return self._status

    @property
    def is_driving(self) -> bool:
        """True while there is a goal to drive to."""
        return self._goal is not None

    def start(self, goal: Pose) -> None:
        """Take up a new goal."""
        self._goal = goal
        self._follower = None
        self._recovery = None
        self._milestone = None
        self._status = GoalStatus(state=GoalState.DRIVING)

    def give_up(self, state: GoalState, reason: str) -> None:
        """End the drive, if there is one, because something else was commanded."""
        if self.is_driving:
            self._end(state, reason)

    def steer(self, senses: Senses) -> BodyVelocity:
        """Return the velocity to drive with now."""
        if self._goal is None:
            return STANDING
        wanted = self._recover(senses) or self._follow(senses, self._goal)
        return senses.obstacles.limit(wanted)

    def _follow(self, senses: Senses, goal: Pose) -> BodyVelocity:
        if not self._has_good_path(senses):
            self._plan(senses, goal)
        follower = self._follower
        if follower is None:
            return STANDING
        if follower.has_arrived(senses.pose):
            self._end(GoalState.ARRIVED, "")
            return STANDING
        velocity = follower.steer(senses.pose, senses.speed_mps, senses.obstacles)
        self._status = replace(self._status, distance_left_m=follower.distance_left_m)
        self._watch_progress(senses.now_s, follower.distance_left_m)
        return velocity

    @property
    def path_left(self) -> tuple[Point, ...]:
        """The rest of the path that it follows; empty while it follows none."""
        if self._follower is None:
            return ()
        return tuple(Point(x, y) for x, y in self._follower.points_left.tolist())

    # --- planning ---

    def _plan(self, senses: Senses, goal: Pose) -> None:
        """Plan again; without a path try to get free, and finally give up."""
        path = self._find_path(senses, goal)
        if path is not None:
            self._follower = PathFollower(path, goal)
            self._milestone = None
            self._note_check(senses)
            return
        self._follower = None
        fault = _fault_of(senses.map, goal.point)
        if fault is not None:
            self._end(GoalState.BLOCKED, fault)
        elif self._status.distance_left_m is None:
            self._end(GoalState.BLOCKED, "No way to the goal over floor the map knows to be free.")
        else:
            self._start_recovery(senses.now_s, "The way to the goal is blocked.")

    def _find_path(self, senses: Senses, goal: Pose) -> Path | None:
        for radius in _PLANNING_RADII_M:
            path = find_path(senses.map, senses.pose.point, goal.point, radius_m=radius)
            if path is not None:
                self._planning_radius_m = radius
                return path
        # The gap it entered by may lack a cell in the next map.
        ways = distances_from(
            senses.map, senses.pose.point, radius_m=_PLANNING_RADII_M[-1], leaves_pockets=True
        )
        return ways.path_to(goal.point)

    def _has_good_path(self, senses: Senses) -> bool:
        """Check about once a second whether the map still shows the path as free."""
        if self._follower is None:
            return False
        is_early = senses.now_s - self._checked_s < _CHECK_PERIOD_S
        if is_early or senses.map is self._checked_map:
            return True
        self._note_check(senses)
        return _is_free_along(
            senses.map, self._follower.points_left, self._planning_radius_m - _SLACK_M
        )

    def _note_check(self, senses: Senses) -> None:
        self._checked_s = senses.now_s
        self._checked_map = senses.map

    # --- getting free ---

    def _watch_progress(self, now_s: float, distance_left_m: float) -> None:
        """Start a recovery when the robot has come no nearer for some seconds."""
        nearest_m, passed_s = self._milestone or (math.inf, now_s)
        if distance_left_m <= nearest_m - _PROGRESS_M:
            self._milestone = (distance_left_m, now_s)
        elif now_s - passed_s > _PATIENCE_S:
            self._follower = None
            self._start_recovery(now_s, "The robot made no progress.")

    def _start_recovery(self, now_s: float, reason: str) -> None:
        n_recoveries = self._status.n_recoveries
        if n_recoveries >= _MOST_RECOVERIES:
            self._end(GoalState.BLOCKED, f"{reason} {n_recoveries} attempts to get free failed.")
            return
        if n_recoveries % 2 == 0:
            motion, duration_s = BodyVelocity(_BACK_OFF_MPS, 0.0), _BACK_OFF_S
        else:
            motion, duration_s = BodyVelocity(0.0, _LOOK_AROUND_RADPS), _LOOK_AROUND_S
        self._recovery = (motion, now_s + duration_s)
        self._milestone = None
        self._status = replace(self._status, n_recoveries=n_recoveries + 1)

    def _recover(self, senses: Senses) -> BodyVelocity | None:
        """Return the motion of a recovery under way."""
        if self._recovery is None:
            return None
        velocity, ends_s = self._recovery
        if senses.now_s >= ends_s:
            self._recovery = None
            return None
        return velocity

    def _end(self, state: GoalState, reason: str) -> None:
        self._goal = None
        self._follower = None
        self._recovery = None
        cause = Cause(code=CauseCode.NAVIGATION_SAID, quote=reason) if reason else None
        self._status = replace(self._status, state=state, cause=cause)


def _fault_of(grid: OccupancyGrid, goal: Point) -> str | None:
    """Return why the robot cannot stand at a goal, whatever the path; None when it can."""
    cell = grid.cell_at(goal)
    if grid.is_unknown(cell):
        return "The goal lies where the map knows nothing."
    room_m = float(clearance_m(grid)[cell.row, cell.col])
    if not grid.is_free(cell) or room_m < _PLANNING_RADII_M[-1]:
        return (
            f"The goal lies {room_m:.2f} m from an obstacle, the robot's radius is"
            f" {BODY_RADIUS_M} m: it does not fit there."
        )
    return None


def _is_free_along(
    grid: OccupancyGrid, points: np.ndarray[tuple[int, int], np.dtype[np.float64]], radius_m: float
) -> bool:
    # The robot may stand where it could not plan to be; only what lies ahead of it counts.
    rows, cols = grid.cells_at(points[_UNDER_ROBOT_POINTS:])
    if not rows.size:
        return True
    rows, cols = rows.clip(0, grid.n_rows - 1), cols.clip(0, grid.n_cols - 1)
    # Obstacles farther from the path than the radius do not narrow it.
    margin = math.ceil(radius_m / grid.resolution_m) + 1
    around = grid.window(rows, cols, margin=margin)
    near = grid.crop(*around)
    is_open = near.free & (clearance_m(near) >= radius_m)
    return bool(is_open[rows - around[0].start, cols - around[1].start].all())
