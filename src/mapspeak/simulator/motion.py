"""The drive and the wheels: a differential drive with limits, and odometry that drifts."""

import math
from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Pose, wrap_angle

__all__ = [
    "BODY_BAND_M",
    "BODY_RADIUS_M",
    "MAX_ACCELERATION_MPS2",
    "MAX_SPEED_MPS",
    "MAX_TURN_ACCELERATION_RADPS2",
    "MAX_TURN_RADPS",
    "STANDING",
    "DifferentialDrive",
    "Odometry",
    "Velocity",
    "move_along_arc",
]

BODY_RADIUS_M = 0.28
BODY_BAND_M = (0.02, 1.2)
"""The heights between which the robot's body, camera mast included, bumps into things."""

MAX_SPEED_MPS = 1.0
MAX_TURN_RADPS = 1.5
MAX_ACCELERATION_MPS2 = 1.0
MAX_TURN_ACCELERATION_RADPS2 = 3.0


@dataclass(frozen=True, slots=True)
class Velocity:
    """How fast a differential drive moves: ahead, and turning left."""

    speed_mps: float = 0.0
    turn_radps: float = 0.0


STANDING = Velocity()
_LEAST = float(np.finfo(np.float64).eps)


def move_along_arc(pose: Pose, velocity: Velocity, duration_s: float) -> Pose:
    """Gives the pose after driving with a constant velocity: a piece of a circle."""
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
    def velocity(self) -> Velocity:
        """How the robot moves now."""
        return self._velocity

    def follow(self, command: Velocity, duration_s: float) -> Velocity:
        """Changes the velocity towards the command, within the limits, and gives it."""
        speed = _clamp(command.speed_mps, MAX_SPEED_MPS)
        turn = _clamp(command.turn_radps, MAX_TURN_RADPS)
        self._velocity = Velocity(
            _approach(self._velocity.speed_mps, speed, MAX_ACCELERATION_MPS2 * duration_s),
            _approach(self._velocity.turn_radps, turn, MAX_TURN_ACCELERATION_RADPS2 * duration_s),
        )
        return self._velocity

    def halt(self) -> None:
        """Stands still at once, as against a wall."""
        self._velocity = STANDING


class Odometry:
    """Where the wheels say the robot is; it drifts with every metre and every turn.

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
        """Adds one true step of the robot as the wheels felt it."""
        driven = math.copysign(
            math.hypot(before_from_after.x, before_from_after.y), before_from_after.x
        )
        felt = Velocity(self._felt_distance(driven), self._felt_turn(before_from_after, driven))
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
    """Gives the chord of an arc as a share of its length, exact for straight lines too.

    It is numpy's sinc to the last bit, without what that costs for a single number.
    """
    half = math.pi * turns or _LEAST
    return float(np.sin(half)) / half


def _approach(value: float, target: float, most: float) -> float:
    return value + _clamp(target - value, most)


def _clamp(value: float, most: float) -> float:
    return min(max(value, -most), most)
