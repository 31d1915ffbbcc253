"""A robot with faults: a base that obeys velocities, and navigation that fails as it is told to.

What stands behind it, a scripted rosbridge or a node of ROS 2, uses the same `Faults`.
"""

import io
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import anyio
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from causes import navigation_said
from mapspeak.errors import GoalError
from mapspeak.geometry import Point, Pose, wrap_angle
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

STEP_S = 0.05
WATCHDOG_S = 0.5
REACHED_M = 0.1
REACHED_RAD = 0.05
TURN_RADPS = 1.5
TURN_GAIN = 4.0
"""In rad/s for each radian that the robot is off; more would make it weave."""
AT_REST = (0.0, 0.0)
N_BEAMS, REACH_M = 72, 10.0

Velocity = tuple[float, float]
"""Forwards in m/s, turning in rad/s."""


@dataclass(slots=True, kw_only=True)
class Faults:
    """What is wrong with a robot; a test changes it while the robot runs.

    Attributes:
        acceptance_s: How long navigation takes to accept a goal; infinite: it never does. A goal
            that is not yet accepted cannot be cancelled: navigation does not know it.
        rejects: Navigation takes no goal.
        aborts: Navigation ends each goal as soon as it has taken it.
        ignores_cancels: Navigation drives on when it is asked to end a goal.
        hangs: Navigation takes goals, drives nowhere and ends none.
        feeds_back: Navigation says how far its goals are.
        is_paused: The robot's clock stands, and all of the robot with it, as in a simulator.
        silent: Topics on which nothing comes any more, though their publishers are there.
        has_watchdog: The base stands half a second after the last velocity; without it the base
            keeps that velocity for ever.
    """

    acceptance_s: float = 0.0
    rejects: bool = False
    aborts: bool = False
    ignores_cancels: bool = False
    hangs: bool = False
    feeds_back: bool = True
    is_paused: bool = False
    silent: set[str] = field(default_factory=set)
    has_watchdog: bool = True


class Base:
    """Wheels that follow the last velocity they heard, until there is a wall.

    Attributes:
        grid: The map.
        pose: Where the robot truly is, in the map frame.
        driven_m: How far it has truly driven.
        heard: Every velocity it was given, with the robot time of each.
        velocity: What the wheels follow now.
        has_power: Whether the motors are on; without them it stands still, and nothing else.
    """

    def __init__(self, grid: OccupancyGrid, *, pose: Pose, faults: Faults) -> None:
        self.grid = grid
        self.pose = pose
        self.driven_m = 0.0
        self.heard: list[tuple[float, Velocity]] = []
        self.has_power = True
        self._faults = faults
        self.velocity = AT_REST
        self._now_s = self._heard_s = 0.0

    def hear(self, velocity: Velocity) -> None:
        self.heard.append((self._now_s, velocity))
        self.velocity, self._heard_s = velocity, self._now_s

    def move(self, step_s: float) -> bool:
        """Let time pass; say whether the way was free."""
        self._now_s += step_s
        if self._faults.has_watchdog and self._now_s - self._heard_s > WATCHDOG_S:
            self.velocity = AT_REST
        forward_mps, turn_radps = self.velocity
        return self.move_to(self.pose @ Pose(forward_mps * step_s, 0.0, turn_radps * step_s))

    def move_to(self, pose: Pose) -> bool:
        """Go to a pose nearby, unless there is a wall: then only turn."""
        if not self.has_power:
            return True
        is_free = self._is_free(pose.point)
        ahead = pose if is_free else Pose(self.pose.x, self.pose.y, pose.yaw_rad)
        self.driven_m += self.pose.point.distance_to(ahead.point)
        self.pose = ahead
        return is_free

    def paint(self, cells: NDArray[np.int8], *, row: int, col: int) -> None:
        """Replace a rectangle of the map."""
        n_rows, n_cols = cells.shape
        painted = self.grid.cells.copy()
        painted[row : row + n_rows, col : col + n_cols] = cells
        self.grid = OccupancyGrid(
            cells=painted, resolution_m=self.grid.resolution_m, origin=self.grid.origin
        )

    def scan(self, *, n_beams: int, range_m: float) -> list[float]:
        """Return the distance to the first cell that is not free, all around from behind."""
        steps_m = np.arange(0.0, range_m, self.grid.resolution_m / 4.0)
        return [
            self._first_hit_m(-math.pi + beam * math.tau / n_beams, steps_m)
            for beam in range(n_beams)
        ]

    def _is_free(self, point: Point) -> bool:
        cell = self.grid.cell_at(point)
        return self.grid.contains(cell) and bool(self.grid.free[cell.row, cell.col])

    def _first_hit_m(self, angle_rad: float, steps_m: NDArray[np.float64]) -> float:
        towards = self.pose.yaw_rad + angle_rad
        x = self.pose.x + steps_m * math.cos(towards)
        y = self.pose.y + steps_m * math.sin(towards)
        rows, cols = self.grid.cells_at(np.column_stack([x, y]))
        inside = self.grid.contains_cells(rows, cols)
        free = np.zeros(len(steps_m), dtype=bool)
        free[inside] = self.grid.free[rows[inside], cols[inside]]
        return math.inf if free.all() else float(steps_m[int(np.argmin(free))])


def steer(here: Pose, goal: Pose, *, speed_mps: float) -> Velocity | None:
    """The velocity that leads straight to a goal; None when it is reached."""
    left_m = here.point.distance_to(goal.point)
    if left_m > REACHED_M:
        off_rad = wrap_angle(here.point.bearing_to(goal.point) - here.yaw_rad)
        forward_mps = min(speed_mps, left_m / STEP_S) * max(math.cos(off_rad), 0.0)
        return forward_mps, max(-TURN_RADPS, min(TURN_GAIN * off_rad, TURN_RADPS))
    off_rad = wrap_angle(goal.yaw_rad - here.yaw_rad)
    if abs(off_rad) < REACHED_RAD:
        return None
    return 0.0, max(-TURN_RADPS, min(TURN_GAIN * off_rad, TURN_RADPS))


@dataclass(slots=True)
class _Goal:
    """A goal that navigation has accepted."""

    pose: Pose
    status: GoalStatus


class FaultyRobot:
    """The port over a base and navigation that fail as told; its time passes while `run` runs.

    `stop` is a zero velocity and nothing else: navigation under way commands the next one, as on a
    real robot.

    Attributes:
        faults: What is wrong now.
        base: The wheels, which know the truth.
        is_navigation_alive: False: goals under way are forgotten, the wheels keep their velocity.
        publish_velocity: Takes what navigation commands; the wheels, unless a topic lies between.
        sent: Each goal that came, with the robot time at which navigation accepted it.
        cancelled: The ids of goals that navigation was asked to end.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        *,
        pose: Pose,
        speed_mps: float = 0.5,
        rate: float = 1.0,
        faults: Faults | None = None,
    ) -> None:
        self.faults = faults or Faults()
        self.base = Base(grid, pose=pose, faults=self.faults)
        self.is_navigation_alive = True
        self.publish_velocity: Callable[[Velocity], None] = self.hear_velocity
        self.sent: list[tuple[float, Pose]] = []
        self.cancelled: list[str] = []
        self._speed_mps = speed_mps
        self._rate = rate
        self._now_s = 100.0
        self._goals: dict[str, _Goal] = {}
        self._current: str | None = None
        self._stepped = anyio.Event()

    # --- time

    async def run(self) -> None:
        """Let time pass, so many times as fast as the wall clock; a busy machine slows it."""
        while True:
            await anyio.sleep(STEP_S / self._rate)
            if not self.faults.is_paused:
                self.step()

    def step(self) -> None:
        """Let one step of time pass."""
        self._now_s += STEP_S
        if self.is_navigation_alive:
            self._navigate()
        self.base.move(STEP_S)
        self._wake()

    def jump_to(self, now_s: float) -> None:
        """Set the robot's clock, as a simulation that starts again does."""
        self._now_s = now_s
        self._wake()

    @property
    def now_s(self) -> float:
        return self._now_s

    async def sleep(self, duration_s: float) -> None:
        left_s, before_s = duration_s, self._now_s
        while left_s > 1e-6:
            await self._stepped.wait()
            # A clock that jumps is no time that passes.
            left_s -= STEP_S if 0.0 <= self._now_s - before_s <= 2.0 * STEP_S else 0.0
            before_s = self._now_s

    def _wake(self) -> None:
        stepped, self._stepped = self._stepped, anyio.Event()
        stepped.set()

    # --- navigation

    def kill_navigation(self) -> None:
        """Let navigation die in what it does: goals are forgotten, wheels are told nothing."""
        self.is_navigation_alive = False
        self._current = None

    def restart_navigation(self) -> None:
        self.is_navigation_alive = True
        self._goals.clear()

    async def accept(self) -> None:
        """Wait as long as navigation takes to accept a goal.

        Raises:
            GoalError: It does not.
        """
        if not self.is_navigation_alive:
            await anyio.sleep_forever()
        waited_s = 0.0
        while waited_s < self.faults.acceptance_s - 1e-6:
            await self.sleep(STEP_S)
            waited_s += STEP_S
        if self.faults.rejects:
            raise GoalError("Navigation rejects the goal.", hint="It rejects all.")

    async def send_goal(self, goal: Pose) -> str:
        """Take a goal; `accept` has waited for it."""
        self.sent.append((self._now_s, goal))
        if self._current is not None:
            self._end(GoalState.PREEMPTED)
        goal_id = f"goal-{len(self.sent)}"
        self._goals[goal_id] = _Goal(goal, GoalStatus(state=GoalState.DRIVING))
        self._current = goal_id
        if self.faults.aborts:
            self._end(GoalState.BLOCKED, "Navigation was told to abort.")
        return goal_id

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        if robot_goal_id not in self._goals:
            raise GoalError("Navigation does not know that goal.", hint="It was restarted.")
        return self._goals[robot_goal_id].status

    async def fetch_navigation(self) -> tuple[NavigationLook, ...]:
        return ()

    async def fetch_foreign_goals(self) -> tuple[GoalState, ...]:
        return ()

    async def cancel_goal(self, robot_goal_id: str) -> None:
        self.cancelled.append(robot_goal_id)
        if robot_goal_id == self._current and not self.faults.ignores_cancels:
            self._end(GoalState.CANCELLED)

    async def stop(self) -> None:
        self.hear_velocity(AT_REST)

    def hear_velocity(self, velocity: Velocity) -> None:
        self.base.hear(velocity)

    def _navigate(self) -> None:
        if self._current is None or self.faults.hangs:
            return
        goal = self._goals[self._current]
        velocity = steer(self.base.pose, goal.pose, speed_mps=self._speed_mps)
        if velocity is None:
            self._end(GoalState.ARRIVED)
            return
        left_m = self.base.pose.point.distance_to(goal.pose.point)
        goal.status = GoalStatus(state=GoalState.DRIVING, distance_left_m=left_m)
        self.publish_velocity(velocity)

    def _end(self, state: GoalState, reason: str = "") -> None:
        if self._current is not None:
            self._goals[self._current].status = GoalStatus(
                state=state, cause=navigation_said(reason)
            )
            self._current = None
            self.publish_velocity(AT_REST)

    # --- what it offers and sees

    @property
    def description(self) -> RobotDescription:
        return RobotDescription(
            name="faulty robot",
            radius_m=0.22,
            map_name="faulty",
            cameras=("front",),
            has_laser=True,
            detector=None,
        )

    async def fetch_map(self) -> OccupancyGrid:
        return self.base.grid

    async def fetch_pose(self) -> StampedPose:
        return StampedPose(self.base.pose, self._now_s)

    async def fetch_picture(self, camera: str | None = None) -> CameraPicture:
        del camera
        encoded = io.BytesIO()
        Image.new("RGB", (64, 48), "grey").save(encoded, format="JPEG")
        return CameraPicture(
            data=encoded.getvalue(),
            media_type="image/jpeg",
            width_px=64,
            height_px=48,
            horizontal_fov_rad=math.radians(90),
            pose=self.base.pose,
            stamp_s=self._now_s,
        )

    async def fetch_detections(self) -> tuple[Detection, ...]:
        return ()

    async def fetch_scan(self) -> RangeScan | None:
        return RangeScan(
            angles_rad=np.linspace(-math.pi, math.pi, N_BEAMS, endpoint=False, dtype=np.float64),
            ranges_m=np.array(self.base.scan(n_beams=N_BEAMS, range_m=REACH_M)),
            reach_m=REACH_M,
            pose=self.base.pose,
            stamp_s=self._now_s,
        )
