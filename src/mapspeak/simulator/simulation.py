"""A world with one robot, stepped by hand: the robot's knowledge and, apart from it, the truth.

Each step is one tick of 0.05 s of robot time: navigation commands a velocity, the body moves, the
wheels report, and at every second tick the LiDAR measures and SLAM learns.
"""

import json
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import ConfigError, GoalError
from mapspeak.geometry import Point, Pose
from mapspeak.robot import Detection, GoalState, GoalStatus
from mapspeak.simulator.camera.camera import CAMERAS, FRONT, PinholeCamera, SimulatedDetector
from mapspeak.simulator.robot.controller import Obstacles
from mapspeak.simulator.robot.equipment import Equipment
from mapspeak.simulator.robot.lidar import Lidar, LidarScan
from mapspeak.simulator.robot.navigator import Navigator, Senses
from mapspeak.simulator.robot.physics import STANDING, BodyVelocity, Odometry, RobotBody
from mapspeak.simulator.robot.slam import Localiser, Mapper
from mapspeak.simulator.truth import Truth
from mapspeak.simulator.worlds.slices import slice_world
from mapspeak.simulator.worlds.world import BODY_BAND_M, World
from mapspeak.spatial import OccupancyGrid

TICK_S = 0.05
_TICKS_PER_SCAN = 2
_DETECTOR_SIZE_PX = (320, 240)
"""The detector judges by shares of the picture; half its size is as good and four times quicker."""


class Simulation:
    """One world and its robot.

    Attributes:
        truth: Hidden from the robot; for scoring alone.
        equipment: The robot's skills besides driving.

    Args:
        seed: For all noise; the same seed and commands give the same run.
        known: A finished map of the world, whose frame starts at the world's start; the robot finds
            its place in it instead of making one.
        start: The robot's first pose, in the world's own frame; None for the world's own start.
            Without a known map, the map frame starts there.
    """

    def __init__(
        self,
        world: World,
        *,
        seed: int,
        known: OccupancyGrid | None = None,
        start: Pose | None = None,
    ) -> None:
        start = world.start if start is None else start
        world = world if known is not None else replace(world, start=start)
        solids = slice_world(world, low_m=BODY_BAND_M[0], high_m=BODY_BAND_M[1])
        for_lidar, for_wheels, for_detector, for_guess = np.random.default_rng(seed).spawn(4)
        self._world = world
        self._n_ticks = 0
        self._body = RobotBody(solids, start)
        self._lidar = Lidar(solids, random=for_lidar)
        self._odometry = Odometry(random=for_wheels)
        self._detector = SimulatedDetector(random=for_detector)
        self._mapper: Mapper | Localiser = Mapper()
        if known is not None:
            pose = world.start.inverse() @ start
            self._mapper = Localiser(known, pose, random=for_guess)
        self._navigator = Navigator()
        self.equipment = Equipment(world, self._body, self._change)
        self._ended: dict[int, GoalStatus] = {}
        self._goal_id = 0
        self.truth = Truth(world, self._body, self._mapper)
        self._measure()

    # --- time ---

    @property
    def time_s(self) -> float:
        """Robot time since the start."""
        return self._n_ticks * TICK_S

    def step(self) -> None:
        """Let one tick of robot time pass."""
        step = self._body.move(self._command(), TICK_S)
        self._n_ticks += 1
        self.equipment.pass_time(TICK_S)
        self._odometry.record(step)
        self._mapper.follow_odometry(self._odometry.odom_from_base)
        if self._n_ticks % _TICKS_PER_SCAN == 0:
            self._measure()

    # --- what the robot knows ---

    @property
    def world_name(self) -> str:
        """Name of the world."""
        return self._world.name

    @property
    def pose_in_map(self) -> Pose:
        """The robot's pose by SLAM."""
        return self._mapper.map_from_base

    @property
    def odom_from_base(self) -> Pose:
        """The robot's pose by odometry alone."""
        return self._odometry.odom_from_base

    @property
    def velocity(self) -> BodyVelocity:
        """Velocity by the wheels."""
        return self._body.velocity

    @property
    def scan(self) -> LidarScan:
        """The latest turn of the LiDAR."""
        return self._scan

    @property
    def pose_of_scan(self) -> Pose:
        """The robot's pose in the map at that scan, by SLAM."""
        return self.pose_in_map @ self._now_from_scan

    def map(self) -> OccupancyGrid:
        """Return the SLAM map; the same one until it has changed."""
        return self._mapper.publish(stamp_s=self.time_s)

    def take_picture(self, camera: str = FRONT) -> NDArray[np.uint8]:
        """Take a picture with one of `CAMERAS`: 0 to 255, shape (height, width, 3)."""
        # Preparing the camera takes its time, in which a robot on the real clock drives on.
        world_from_base = self._body.world_from_base
        return self._camera.render(world_from_base @ CAMERAS[camera])

    def detect(self) -> tuple[Detection, ...]:
        """Return what the simulated detector reports of the camera's view, from left to right."""
        world_from_base, (width_px, height_px) = self._body.world_from_base, _DETECTOR_SIZE_PX
        view = self._camera.observe(world_from_base, width_px=width_px, height_px=height_px)
        return self._detector.detect(view)

    # --- driving ---

    @property
    def planned_path(self) -> tuple[Point, ...]:
        """The rest of the path that is driven, in the map; empty while none is."""
        return self._navigator.path_left

    def start_goal(self, goal: Pose) -> int:
        """Send the robot to a pose in the map and return the drive's id; an earlier drive ends."""
        self._navigator.give_up(GoalState.PREEMPTED, "A newer goal replaced it.")
        if self._goal_id > 0:
            self._ended[self._goal_id] = self._navigator.status
        self._goal_id += 1
        self._navigator.start(goal)
        return self._goal_id

    def goal_status(self, goal_id: int) -> GoalStatus:
        """Return the status of a drive, also after it has ended.

        Raises:
            GoalError: No drive has that id.
        """
        if goal_id == self._goal_id and goal_id > 0:
            return self._navigator.status
        if goal_id not in self._ended:
            raise GoalError(
                f"The robot knows no drive with the id {goal_id}.",
                hint="Use the id that starting the drive gave.",
            )
        return self._ended[goal_id]

    def cancel_goal(self, goal_id: int) -> None:
        """End a drive that still goes on; the robot stops.

        Raises:
            GoalError: No drive has that id.
        """
        if self.goal_status(goal_id).state is GoalState.DRIVING:
            self._navigator.give_up(GoalState.CANCELLED, "It was cancelled.")

    def stop(self) -> None:
        """End every drive and stop the robot."""
        self._navigator.give_up(GoalState.CANCELLED, "The robot was stopped.")

    # --- inside ---

    @cached_property
    def _camera(self) -> PinholeCamera:
        return PinholeCamera(self._world)

    def _change(self, world: World) -> None:
        """Replace the world for sensors, body and camera."""
        self._world = world
        solids = slice_world(world, low_m=BODY_BAND_M[0], high_m=BODY_BAND_M[1])
        self._lidar.stand_among(solids)
        self._body.stand_among(solids)
        self._mapper.forget_obstacles()
        self.__dict__.pop("_camera", None)
        self._measure()

    def _command(self) -> BodyVelocity:
        if self.equipment.charge_ratio <= 0:
            self._navigator.give_up(GoalState.BLOCKED, "The battery is empty.")
        if not self._navigator.is_driving:
            return STANDING
        senses = Senses(
            now_s=self.time_s,
            pose=self.pose_in_map,
            speed_mps=self._body.velocity.speed_mps,
            obstacles=Obstacles.seen_from(self._points_in_base, self._now_from_scan),
            map=self._mapper.planning_map or self.map(),
        )
        return self._navigator.steer(senses)

    @property
    def _now_from_scan(self) -> Pose:
        return self._odometry.odom_from_base.inverse() @ self._odom_at_scan

    def _measure(self) -> None:
        self._scan = self._lidar.scan(self._body.world_from_base, stamp_s=self.time_s)
        self._points_in_base = self._scan.points_in_base
        self._odom_at_scan = self._odometry.odom_from_base
        self._mapper.add_scan(self._scan)


STATE_PERIOD_S = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class StateRecord:
    """True state of a simulation at one moment.

    Attributes:
        x: Metres, in a map without errors.
        slam_error_m: Error of the robot's own pose.
        deeds: Actions of its skills so far, in order.
    """

    time_s: float
    x: float
    y: float
    yaw_rad: float
    slam_error_m: float
    driven_m: float
    n_collisions: int
    battery_ratio: float = 1.0
    deeds: tuple[str, ...] = ()

    @property
    def pose(self) -> Pose:
        """The robot's true pose."""
        return Pose(self.x, self.y, self.yaw_rad)

    @classmethod
    def of(cls, simulation: Simulation) -> Self:
        """Return the present true state of a simulation."""
        truth = simulation.truth
        pose = truth.pose
        return cls(
            time_s=round(simulation.time_s, 3),
            x=pose.x,
            y=pose.y,
            yaw_rad=pose.yaw_rad,
            slam_error_m=truth.slam_error_m,
            driven_m=truth.driven_m,
            n_collisions=truth.n_collisions,
            battery_ratio=round(simulation.equipment.charge_ratio, 4),
            deeds=tuple(map(str, simulation.equipment.deeds)),
        )

    @classmethod
    def read(cls, line: str | bytes) -> Self:
        """Read a line of a state log."""
        told = json.loads(line)
        return cls(**{**told, "deeds": tuple(told.get("deeds", ()))})


class StateLog:
    """Writes a record at most five times per second of robot time."""

    def __init__(self, simulation: Simulation, path: Path) -> None:
        self._simulation = simulation
        self._last_s = float("-inf")
        try:
            self._file = path.open("w", encoding="utf-8")
            self.note()
        except OSError as error:
            raise ConfigError(
                f"The state log {path} cannot be written: {error.strerror}.",
                hint="Choose another file with --state-log.",
            ) from error

    def note(self) -> None:
        """Write a record when the last one is old enough."""
        now_s = self._simulation.time_s
        if now_s - self._last_s < STATE_PERIOD_S:
            return
        self._last_s = now_s
        record = StateRecord.of(self._simulation)
        self._file.write(json.dumps(asdict(record)) + "\n")
        self._file.flush()

    def close(self) -> None:
        """Write the last record and close the file."""
        self._last_s = float("-inf")
        self.note()
        self._file.close()


def read_state_log(path: Path) -> tuple[StateRecord, ...]:
    """Read every whole line of a state log, which may still be growing."""
    whole_lines = path.read_text(encoding="utf-8").rpartition("\n")[0].splitlines()
    return tuple(map(StateRecord.read, whole_lines))
