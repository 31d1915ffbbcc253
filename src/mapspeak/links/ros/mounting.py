"""Where on the robot a laser is mounted: turned, upside down, on a tilted mast, or of no use."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError
from mapspeak.links.ros.transforms import TransformTree
from mapspeak.ros.messages import FrameTransform

MOST_TILT_RAD = math.radians(10.0)
"""A laser that looks more up or down meets the floor or the ceiling within a few metres."""


@dataclass(frozen=True, slots=True, eq=False)
class Mounting:
    """Where a sensor is on the robot; compared by identity.

    Attributes:
        base_from_sensor: A matrix of shape (4, 4), from the sensor's frame to the robot's own.
    """

    base_from_sensor: NDArray[np.float64]

    def place(
        self, angles_rad: NDArray[np.float64], ranges_m: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Gives directions and distances in the sensor's plane as from the robot, seen from above.

        Args:
            angles_rad: Counter-clockwise from the sensor's x axis about its z axis.
            ranges_m: From the sensor; finite.
        """
        ends = np.stack([ranges_m * np.cos(angles_rad), ranges_m * np.sin(angles_rad)])
        x, y = self.base_from_sensor[:2, :2] @ ends + self.base_from_sensor[:2, 3:]
        return np.arctan2(y, x), np.hypot(x, y)


def find_mounting(tree: TransformTree, *, base: str, sensor: str) -> Mounting:
    """Gives where a sensor that looks along the floor is on the robot.

    Raises:
        LinkError: The frames do not say, or it looks up or down.
    """
    from_base, from_sensor = tree.find_ways(base, sensor)
    base_from_sensor = np.linalg.inv(_chain(from_base)) @ _chain(from_sensor)
    tilt_rad = math.acos(min(abs(float(base_from_sensor[2, 2])), 1.0))
    if tilt_rad > MOST_TILT_RAD:
        raise LinkError(
            f"The laser {sensor!r} is tilted by {math.degrees(tilt_rad):.0f} deg.",
            hint="Name the topic of a laser that looks along the floor: scan_topic in robot.yaml.",
        )
    return Mounting(base_from_sensor)


def _chain(way_up: Iterable[FrameTransform]) -> NDArray[np.float64]:
    """Gives the matrix from the lowest frame of a way to the highest."""
    matrix = np.eye(4)
    for transform in way_up:
        matrix = _matrix(transform) @ matrix
    return matrix


def _matrix(transform: FrameTransform) -> NDArray[np.float64]:
    pose, half_rad = transform.parent_from_child, transform.parent_from_child.yaw_rad / 2
    x, y, z, w = transform.rotation or (0.0, 0.0, math.sin(half_rad), math.cos(half_rad))
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), pose.x],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), pose.y],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), transform.height_m],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
