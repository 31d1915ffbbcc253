"""The simulated robot behind the port, on a virtual clock or paced to real time."""

import io
import math
import threading
from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import asynccontextmanager
from enum import StrEnum
from typing import TypeVar

import anyio
import anyio.to_thread
import numpy as np
from PIL import Image

from mapspeak.geometry import Point, Pose
from mapspeak.links.simulatedskills import build_skills
from mapspeak.robot import (
    SCAN_PATIENCE_S,
    CameraPicture,
    Detection,
    GoalState,
    GoalStatus,
    NavigationLook,
    NavigationPart,
    RangeScan,
    Robot,
    RobotDescription,
    StampedPose,
)
from mapspeak.ros.activity import News
from mapspeak.simulator import (
    BEAM_ANGLES_RAD,
    BODY_RADIUS_M,
    CAMERAS,
    HORIZONTAL_FOV_RAD,
    MAX_RANGE_M,
    TICK_S,
    Simulation,
)
from mapspeak.skill import Skill
from mapspeak.spatial import OccupancyGrid

CHUNK_S = 0.25
"""Robot time computed in one go; a command waits at most for one such chunk."""
EPSILON_S = 1e-6
LATE_S = 1.0
"""A machine that falls this far behind the wall clock is not rushed to catch up."""
JPEG_QUALITY = 85
N_CORNERS = 16
"""Of the polygon that stands for a round footprint."""

T = TypeVar("T")


class Clock(StrEnum):
    """The clock of a simulated robot."""

    REAL = "real"
    VIRTUAL = "virtual"


class SimulatedRobot:
    """A `Robot` whose world is computed here.

    Time passes only while a caller waits. One call works on the simulation at a time. Computation
    runs in a worker thread, so that the event loop stays free to answer a stop; values at hand are
    read directly.

    """

    def __init__(
        self,
        simulation: Simulation,
        *,
        has_detector: bool,
        after_step: Callable[[], None] | None = None,
    ) -> None:
        self._simulation = simulation
        self._has_detector = has_detector
        self._after_step = after_step or _do_nothing
        self._turn = anyio.Lock()
        self._working = threading.Lock()
        self._looking = anyio.Lock()
        self._moved_on = News()

    @property
    def description(self) -> RobotDescription:
        """The fixed properties of this robot."""
        return RobotDescription(
            name="simulated robot",
            radius_m=BODY_RADIUS_M,
            map_name=self._simulation.world_name,
            cameras=tuple(CAMERAS),
            has_laser=True,
            detector="simulated detector" if self._has_detector else None,
        )

    @property
    def now_s(self) -> float:
        """Robot time: seconds since the simulation began."""
        return self._simulation.time_s

    def build_skills(self, driven: Robot) -> Sequence[Skill]:
        """Return its skills besides driving, whose drives are goals to `driven`."""
        return build_skills(self, driven, self._simulation.equipment)

    async def sleep(self, duration_s: float) -> None:
        """Let that much robot time pass, as fast as it can be computed."""
        deadline_s = self.now_s + duration_s
        while self.now_s < deadline_s - EPSILON_S:
            await self.advance_to(min(deadline_s, self.now_s + CHUNK_S))

    async def fetch_map(self) -> OccupancyGrid:
        """Return the map that the simulated SLAM publishes."""
        return await self.compute(self._simulation.map)

    async def fetch_pose(self) -> StampedPose:
        """Return the pose that the simulated SLAM believes in."""
        async with self._turn:
            return StampedPose(self._simulation.pose_in_map, self._simulation.time_s)

    async def fetch_picture(self, camera: str | None = None) -> CameraPicture:
        """Render the view of a camera."""
        ahead, *_ = self.description.cameras
        name = ahead if camera is None else self.description.find_camera(camera)
        # Drawing takes long and needs only the pose: a stop must not wait for it.
        async with self._looking:
            return await anyio.to_thread.run_sync(self._take_picture, name)

    async def fetch_detections(self) -> tuple[Detection, ...]:
        """Return the simulated detector's reports; none when it is switched off."""
        if not self._has_detector:
            return ()
        async with self._looking:
            return await anyio.to_thread.run_sync(self._simulation.detect)

    async def fetch_scan(self) -> RangeScan | None:
        """Return the latest turn of the simulated LiDAR, and where SLAM took the robot to be."""
        with anyio.move_on_after(SCAN_PATIENCE_S):
            async with self._turn:
                scan = self._simulation.scan
                return RangeScan(
                    angles_rad=BEAM_ANGLES_RAD.astype(np.float64),
                    ranges_m=scan.ranges_m,
                    reach_m=MAX_RANGE_M,
                    pose=self._simulation.pose_of_scan,
                    stamp_s=scan.stamp_s,
                )
        return None

    async def fetch_navigation(self) -> tuple[NavigationLook, ...]:
        """Return the path that is driven and the round footprint; it plans on no costmap."""
        async with self._turn:
            path, here = self._simulation.planned_path, self._simulation.pose_in_map
        turns_rad = np.linspace(0.0, math.tau, N_CORNERS + 1).tolist()
        rim = Point(BODY_RADIUS_M, 0.0)
        ring = ((here @ Pose(0.0, 0.0, turn_rad)).transform(rim) for turn_rad in turns_rad)
        return (
            NavigationLook(
                part=NavigationPart.PLAN,
                age_s=0.0 if path else None,
                lines=(path,) if path else (),
            ),
            NavigationLook(part=NavigationPart.FOOTPRINT, age_s=0.0, lines=(tuple(ring),)),
        )

    async def fetch_foreign_goals(self) -> tuple[GoalState, ...]:
        """Return nothing: no other client can send this robot anywhere."""
        return ()

    async def send_goal(self, goal: Pose) -> str:
        """Start a drive in the simulated navigation."""
        async with self._turn:
            return str(self._simulation.start_goal(goal))

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        """Return how a drive stands."""
        async with self._turn:
            return self._simulation.goal_status(_number(robot_goal_id))

    async def cancel_goal(self, robot_goal_id: str) -> None:
        """End a drive."""
        await self.compute(lambda: self._simulation.cancel_goal(_number(robot_goal_id)))

    async def stop(self) -> None:
        """End every drive and commands zero velocity."""
        await self.compute(self._simulation.stop)

    async def advance_to(self, until_s: float) -> None:
        """Compute the world up to that robot time."""
        await self.compute(lambda: self._advance_to(until_s))

    async def fetch_battery(self) -> float | None:
        """Return how full its battery is, from 0 to 1."""
        return self._simulation.equipment.charge_ratio

    async def compute(self, work: Callable[[], T]) -> T:
        """Work on the simulation while no other call does."""
        async with self._turn:
            return await anyio.to_thread.run_sync(self.work_alone, work)

    def work_alone(self, work: Callable[[], T]) -> T:
        """Work on the simulation in this thread while no other does.

        When an interrupted event loop ends, what `compute` began may go on in its thread.
        """
        with self._working:
            return work()

    def _advance_to(self, until_s: float) -> None:
        while self._simulation.time_s < until_s - EPSILON_S:
            self._simulation.step()
            self._after_step()

    def _take_picture(self, camera: str) -> CameraPicture:
        # The world may go on while the picture is drawn.
        pose, stamp_s = self._simulation.pose_in_map, self._simulation.time_s
        rgb = self._simulation.take_picture(camera)
        encoded = io.BytesIO()
        Image.fromarray(rgb).save(encoded, format="JPEG", quality=JPEG_QUALITY)
        height_px, width_px = rgb.shape[:2]
        return CameraPicture(
            data=encoded.getvalue(),
            media_type="image/jpeg",
            width_px=width_px,
            height_px=height_px,
            horizontal_fov_rad=HORIZONTAL_FOV_RAD,
            pose=pose @ CAMERAS[camera],
            stamp_s=stamp_s,
        )


class PacedRobot(SimulatedRobot):
    """The same robot, whose time passes as the wall clock's does while `keep_pace` runs."""

    async def sleep(self, duration_s: float) -> None:
        """Return when that much robot time has passed."""
        deadline_s = self.now_s + duration_s
        while self.now_s < deadline_s - EPSILON_S:
            await self._moved_on.wait()

    async def keep_pace(self) -> None:
        """Let robot time pass as the wall clock does, until cancelled."""
        wall_s, robot_s = anyio.current_time(), self.now_s
        while True:
            due_s = robot_s + anyio.current_time() - wall_s
            await self.advance_to(min(due_s, self.now_s + CHUNK_S))
            self._moved_on.tell()
            if due_s - self.now_s > LATE_S:
                wall_s, robot_s = anyio.current_time(), self.now_s
            await anyio.sleep(TICK_S)


class SoloRobot(SimulatedRobot):
    """The same robot for a single caller that does nothing else while it waits.

    Waking a thread for each step costs as much as the step, and here nothing else needs the event
    loop.
    """

    async def compute(self, work: Callable[[], T]) -> T:
        """Work on the simulation while no other call does."""
        async with self._turn:
            return work()


@asynccontextmanager
async def open_simulated_robot(
    simulation: Simulation,
    *,
    clock: Clock,
    has_detector: bool,
    after_step: Callable[[], None] | None = None,
) -> AsyncGenerator[SimulatedRobot]:
    """Offer a simulation as a robot while the context lasts.

    Args:
        simulation: The world and the robot in it.
        clock: Its clock.
        has_detector: Offers the simulated detector's reports.
        after_step: Called after each step of the simulation, in its thread.
    """
    if clock is Clock.VIRTUAL:
        yield SimulatedRobot(simulation, has_detector=has_detector, after_step=after_step)
        return
    robot = PacedRobot(simulation, has_detector=has_detector, after_step=after_step)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(robot.keep_pace)
        yield robot
        tasks.cancel_scope.cancel()


def _number(robot_goal_id: str) -> int:
    """Return the simulation's own id; an id of another robot is not one of its ids."""
    return int(robot_goal_id) if robot_goal_id.isdecimal() else 0


def _do_nothing() -> None:
    """Stand in for an observer."""
