"""A robot for tests: it drives in straight lines on a map drawn as text, on a clock of its own."""

import io
import math

import anyio
import numpy as np
from PIL import Image

from drawing import grid_from_text
from mapspeak.errors import GoalError, LinkError
from mapspeak.geometry import Point, Pose
from mapspeak.robot import (
    CameraPicture,
    Detection,
    GoalState,
    GoalStatus,
    NavigationLook,
    RangeScan,
    RobotDescription,
    StampedPose,
)
from mapspeak.spatial import OccupancyGrid

SPEED_MPS = 1.0
START = Pose(1.5, 1.4, 0.0)

TWO_ROOMS = """
##############################
#............#...............#
#............#...............#
#............#...............#
#............................#
#............................#
#............................#
#............#...............#
#............#...............#
#............#...............#
##############################
"""


def two_rooms() -> OccupancyGrid:
    """Two rooms side by side, joined by a door 0.75 m wide, in cells of 0.25 m."""
    return grid_from_text(TWO_ROOMS, resolution_m=0.25)


def scan_of(grid: OccupancyGrid, pose: Pose, *, reach_m: float = 20.0) -> RangeScan:
    """What a laser would meet of a map: to the first obstacle in every two degrees."""
    angles_rad = np.radians(np.arange(-180.0, 180.0, 2.0))
    return RangeScan(
        angles_rad=angles_rad,
        ranges_m=np.array([_free_m(grid, pose, angle, reach_m) for angle in angles_rad]),
        reach_m=reach_m,
        pose=pose,
        stamp_s=0.0,
    )


def _free_m(grid: OccupancyGrid, pose: Pose, angle_rad: float, reach_m: float) -> float:
    beam = pose @ Pose(0.0, 0.0, angle_rad)
    for far_m in np.arange(0.0, reach_m, grid.resolution_m / 5).tolist():
        cell = grid.cell_at(beam.transform(Point(far_m, 0.0)))
        if not grid.contains(cell) or grid.occupied[cell.row, cell.col]:
            return float(far_m)
    return math.inf


class FakeRobot:
    """Implements the port with a straight-line drive; every answer can be changed by a test."""

    def __init__(
        self,
        grid: OccupancyGrid | None = None,
        *,
        pose: Pose = START,
        has_camera: bool = True,
    ) -> None:
        self.grid = grid
        self.pose = pose
        self.cameras: tuple[str, ...] = ("front",) if has_camera else ()
        self.picture_size = (64, 48)
        self.is_radius_assumed = False
        self.detections: tuple[Detection, ...] = ()
        self.scan: RangeScan | None = None
        self.n_stops = 0
        self.foreign_goals: tuple[GoalState, ...] = ()
        self.navigation: tuple[NavigationLook, ...] = ()
        self.goals: dict[str, Pose] = {}
        self.ended: dict[str, GoalStatus] = {}
        self.map_was_asked_for = anyio.Event()
        self.may_give_map = anyio.Event()
        self.may_give_map.set()
        self._now_s = 0.0
        self._current: str | None = None

    @property
    def description(self) -> RobotDescription:
        return RobotDescription(
            name="fake robot",
            radius_m=0.2,
            map_name="two-rooms",
            cameras=self.cameras,
            has_laser=self.scan is not None,
            detector="fake detector" if self.detections else None,
            is_radius_assumed=self.is_radius_assumed,
        )

    @property
    def now_s(self) -> float:
        return self._now_s

    def set_clock(self, now_s: float) -> None:
        """Sets robot time, as a simulation does that is begun anew."""
        self._now_s = now_s

    async def sleep(self, duration_s: float) -> None:
        self._now_s += duration_s
        self._advance(duration_s)

    async def fetch_map(self) -> OccupancyGrid:
        self.map_was_asked_for.set()
        await self.may_give_map.wait()
        if self.grid is None:
            raise LinkError("No map has arrived yet.", hint="Start SLAM or a map server.")
        return self.grid

    async def fetch_pose(self) -> StampedPose:
        return StampedPose(self.pose, self._now_s)

    async def fetch_picture(self, camera: str | None = None) -> CameraPicture:
        if not self.cameras:
            raise LinkError("This robot has no camera.", hint="Use look_at_map instead.")
        is_ahead = camera is None or self.description.find_camera(camera) == self.cameras[0]
        encoded = io.BytesIO()
        Image.new("RGB", self.picture_size, "grey").save(encoded, format="JPEG")
        return CameraPicture(
            data=encoded.getvalue(),
            media_type="image/jpeg",
            width_px=self.picture_size[0],
            height_px=self.picture_size[1],
            horizontal_fov_rad=math.radians(90 if is_ahead else 60),
            pose=self.pose if is_ahead else self.pose @ Pose(0.0, 0.0, math.pi),
            stamp_s=self._now_s,
        )

    async def fetch_detections(self) -> tuple[Detection, ...]:
        return self.detections

    async def fetch_scan(self) -> RangeScan | None:
        return self.scan

    async def fetch_navigation(self) -> tuple[NavigationLook, ...]:
        return self.navigation

    async def fetch_foreign_goals(self) -> tuple[GoalState, ...]:
        return self.foreign_goals

    async def send_goal(self, goal: Pose) -> str:
        if self._current is not None:
            self._end(GoalState.PREEMPTED)
        goal_id = f"fake-{len(self.goals) + 1}"
        self.goals[goal_id] = goal
        self._current = goal_id
        return goal_id

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        if robot_goal_id not in self.goals:
            raise GoalError("No such goal.", hint="Send one.")
        if robot_goal_id in self.ended:
            return self.ended[robot_goal_id]
        left_m = self.pose.point.distance_to(self.goals[robot_goal_id].point)
        return GoalStatus(state=GoalState.DRIVING, distance_left_m=left_m)

    async def cancel_goal(self, robot_goal_id: str) -> None:
        if robot_goal_id == self._current:
            self._end(GoalState.CANCELLED)

    async def stop(self) -> None:
        self.n_stops += 1
        if self._current is not None:
            self._end(GoalState.CANCELLED)

    def end_goal(self, state: GoalState, *, pose: Pose | None = None) -> None:
        """Lets the navigation end the goal it follows, with the robot at some pose."""
        self.pose = pose or self.pose
        self._end(state)

    def _end(self, state: GoalState) -> None:
        assert self._current is not None
        self.ended[self._current] = GoalStatus(state=state, distance_left_m=0.0)
        self._current = None

    def _advance(self, duration_s: float) -> None:
        if self._current is None:
            return
        goal = self.goals[self._current]
        left_m = self.pose.point.distance_to(goal.point)
        step_m = SPEED_MPS * duration_s
        if left_m <= step_m:
            self.pose = goal
            self._end(GoalState.ARRIVED)
            return
        share = step_m / left_m
        here = Point(
            self.pose.x + share * (goal.x - self.pose.x),
            self.pose.y + share * (goal.y - self.pose.y),
        )
        self.pose = Pose(here.x, here.y, self.pose.point.bearing_to(goal.point))
