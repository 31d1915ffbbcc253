"""The drive, the wheels and the body: speed limits, drifting odometry, and collisions."""

import math
from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.simulator.worlds.slices import Slice
from mapspeak.simulator.worlds.world import BODY_RADIUS_M

MAX_SPEED_MPS = 1.0
MAX_TURN_RADPS = 1.5
MAX_ACCELERATION_MPS2 = 1.0
MAX_TURN_ACCELERATION_RADPS2 = 3.0


@dataclass(frozen=True, slots=True)
class BodyVelocity:
    """Velocity of a differential drive: forward, and turning left."""

    speed_mps: float = 0.0
    turn_radps: float = 0.0


STANDING = BodyVelocity()
_LEAST = float(np.finfo(np.float64).eps)


def move_along_arc(pose: Pose, velocity: BodyVelocity, duration_s: float) -> Pose:
    """Return the pose after driving with a constant velocity: a piece of a circle."""
    turned = velocity.turn_radps * duration_s
    driven = velocity.speed_mps * duration_s
    chord = driven * _sinc(turned / math.tau)
    heading = pose.yaw_rad + turned / 2
    return Pose(
        pose.x + chord * math.cos(heading),
        pose.y + chord * math.sin(heading),
        wrap_angle(pose.yaw_rad + turned),
    )


class DifferentialDrive:
    """Two wheels that follow a commanded velocity as fast as they can."""

    def __init__(self) -> None:
        self._velocity = STANDING

    @property
    def velocity(self) -> BodyVelocity:
        """How the robot moves now."""
        return self._velocity

    def follow(self, command: BodyVelocity, duration_s: float) -> BodyVelocity:
        """Change the velocity towards the command, within the limits, and return it."""
        speed = _clamp(command.speed_mps, MAX_SPEED_MPS)
        turn = _clamp(command.turn_radps, MAX_TURN_RADPS)
        self._velocity = BodyVelocity(
            _approach(self._velocity.speed_mps, speed, MAX_ACCELERATION_MPS2 * duration_s),
            _approach(self._velocity.turn_radps, turn, MAX_TURN_ACCELERATION_RADPS2 * duration_s),
        )
        return self._velocity

    def halt(self) -> None:
        """Stand still at once, as against a wall."""
        self._velocity = STANDING


class Odometry:
    """Wheel odometry; it drifts with every metre and every turn.

    Two errors add up, as in Borenstein and Feng, "Measurement and correction of systematic
    odometry errors in mobile robots" (1996): a systematic one that stays the same for a run (wheel
    sizes, wheel base), and a random one that grows with the root of the distance.
    """

    _SCALE_SPREAD = 0.01
    _TURN_SCALE_SPREAD = 0.01
    _VEER_SPREAD_RAD_PER_M = 0.005
    _NOISE_M_PER_ROOT_M = 0.01
    _NOISE_RAD_PER_ROOT_M = 0.01
    _NOISE_RAD_PER_ROOT_RAD = 0.01

    def __init__(self, *, random: np.random.Generator) -> None:
        self._random = random
        self._scale = 1.0 + random.normal(0.0, self._SCALE_SPREAD)
        self._turn_scale = 1.0 + random.normal(0.0, self._TURN_SCALE_SPREAD)
        self._veer_rad_per_m = random.normal(0.0, self._VEER_SPREAD_RAD_PER_M)
        self._odom_from_base = Pose(0.0, 0.0, 0.0)

    @property
    def odom_from_base(self) -> Pose:
        """The estimate, from where the robot first stood."""
        return self._odom_from_base

    def record(self, before_from_after: Pose) -> None:
        """Add one true step of the robot as the wheels felt it."""
        driven = math.copysign(
            math.hypot(before_from_after.x, before_from_after.y), before_from_after.x
        )
        felt = BodyVelocity(self._felt_distance(driven), self._felt_turn(before_from_after, driven))
        self._odom_from_base = move_along_arc(self._odom_from_base, felt, 1.0)

    def _felt_distance(self, driven_m: float) -> float:
        noise = self._NOISE_M_PER_ROOT_M * math.sqrt(abs(driven_m))
        return driven_m * self._scale + self._random.normal(0.0, noise)

    def _felt_turn(self, step: Pose, driven_m: float) -> float:
        noise = math.hypot(
            self._NOISE_RAD_PER_ROOT_M * math.sqrt(abs(driven_m)),
            self._NOISE_RAD_PER_ROOT_RAD * math.sqrt(abs(step.yaw_rad)),
        )
        veered = self._veer_rad_per_m * driven_m
        return step.yaw_rad * self._turn_scale + veered + self._random.normal(0.0, noise)


def _sinc(turns: float) -> float:
    """Return the chord of an arc as a share of its length, exact for straight lines too.

    It equals numpy's sinc to the last bit, and is faster for a single number.
    """
    half = math.pi * turns or _LEAST
    return float(np.sin(half)) / half


def _approach(value: float, target: float, most: float) -> float:
    return value + _clamp(target - value, most)


def _clamp(value: float, most: float) -> float:
    return min(max(value, -most), most)


_APART_M = 0.05
"""Before the robot is this far from a thing again, pushing at it is no new collision."""
_NEAR_M = 1.0
"""Obstacles farther away than this cannot touch the body in the next steps."""


class RobotBody:
    """A round body on two driven wheels.

    Attributes:
        world_from_base: Its true pose.
        driven_m: Distance that its centre has moved.
    """

    def __init__(self, solids: Slice, start: Pose) -> None:
        self.world_from_base = start
        self.n_collisions = 0
        self.driven_m = 0.0
        self.stand_among(solids)
        self._drive = DifferentialDrive()
        self._is_touching = False

    @property
    def velocity(self) -> BodyVelocity:
        """How it moves now."""
        return self._drive.velocity

    def stand_among(self, solids: Slice) -> None:
        """Collide with these solids from now on."""
        self._solids = solids
        self._near_from = self.world_from_base.point
        self._near = solids.near(self._near_from, reach_m=2 * _NEAR_M)

    def move(self, command: BodyVelocity, duration_s: float) -> Pose:
        """Move for a moment and return the step it took, in its frame before the step."""
        before = self.world_from_base
        velocity = self._drive.follow(command, duration_s)
        wanted = move_along_arc(before, velocity, duration_s)
        room_m = self._room_m_at(wanted.point)
        if velocity.speed_mps and room_m < 0:
            self._bump()
            wanted = Pose(before.x, before.y, wanted.yaw_rad)
        elif room_m > _APART_M:
            self._is_touching = False
        self.world_from_base = wanted
        self.driven_m += before.point.distance_to(wanted.point)
        return before.inverse() @ wanted

    def _room_m_at(self, point: Point) -> float:
        """Return the distance of the body's edge to near obstacles; a larger value without any.

        Most of a world is far away, and is not checked in every step.
        """
        if point.distance_to(self._near_from) > _NEAR_M:
            self._near = self._solids.near(point, reach_m=2 * _NEAR_M)
            self._near_from = point
        return self._near.distance_to(point) - BODY_RADIUS_M

    def _bump(self) -> None:
        """Stop; a robot that keeps pushing against the same thing has bumped once."""
        if not self._is_touching:
            self.n_collisions += 1
        self._is_touching = True
        self._drive.halt()
