"""Scans of the robot's laser, and where on the robot it is mounted."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import anyio
import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError
from mapspeak.robot import SCAN_PATIENCE_S, RangeScan
from mapspeak.ros import RosConnection, Subscription
from mapspeak.ros.discovery import RobotProfile
from mapspeak.ros.messages import FrameTransform, LaserScan, Message, read_scan
from mapspeak.ros.robot.poses import PoseKeeper, RobotClock
from mapspeak.ros.subscribing import THROTTLE_MS, Lingering
from mapspeak.ros.transforms import FrameListener, TransformTree

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
        """Return directions and distances in the sensor's plane as from the robot, seen from above.

        Args:
            angles_rad: Counter-clockwise from the sensor's x axis about its z axis.
            ranges_m: From the sensor; finite.
        """
        ends = np.stack([ranges_m * np.cos(angles_rad), ranges_m * np.sin(angles_rad)])
        x, y = self.base_from_sensor[:2, :2] @ ends + self.base_from_sensor[:2, 3:]
        return np.arctan2(y, x), np.hypot(x, y)


def find_mounting(tree: TransformTree, *, base: str, sensor: str) -> Mounting:
    """Return where a sensor that looks along the floor is on the robot.

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
    """Return the matrix from the lowest frame of a way to the highest."""
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


STALE_S = 1.0
"""Of robot time: an older scan was held up on its way, or its driver's clock is not the robot's."""


class Laser:
    """Takes scans. Whatever goes wrong, there is just none: nothing depends on them.

    Args:
        connection: Connected to the robot.
        profile: Says which topic.
        frames: Knows where the laser is mounted.
        clock: Tells which scans are old.
        patience_s: How long to wait for a scan, in wall time.
    """

    def __init__(
        self,
        connection: RosConnection,
        profile: RobotProfile,
        *,
        frames: FrameListener,
        clock: RobotClock,
        patience_s: float = SCAN_PATIENCE_S,
    ) -> None:
        self._connection = connection
        self._profile = profile
        self._frames = frames
        self._clock = clock
        self._patience_s = patience_s
        self._lingering = Lingering(connection, self._subscribe)

    async def fetch(self, poses: PoseKeeper) -> RangeScan | None:
        """Return a scan that arrives after it was asked for, or None.

        Args:
            poses: Knows where the robot is when it comes.
        """
        if not self._connection.is_open:
            return None
        try:
            with self._lingering.look() as (scans,):
                message = await self._next_message(scans)
            return self._read(message, poses)
        except LinkError:
            return None

    async def close_when_idle(self) -> None:
        """End the subscription whenever nobody has looked for a while; run until cancelled."""
        await self._lingering.close_when_idle()

    def _subscribe(self) -> tuple[Subscription, ...]:
        profile = self._profile
        if profile.scan_topic is None:
            raise LinkError("The robot publishes no scans.", hint="Name scan_topic in robot.yaml.")
        type_name = profile.dialect.type_name("sensor_msgs/LaserScan")
        scans = self._connection.subscribe(
            profile.scan_topic, type_name=type_name, is_bulky=True, throttle_ms=THROTTLE_MS
        )
        return (scans,)

    async def _next_message(self, scans: Subscription) -> Message:
        silent_s = anyio.current_time() - scans.begun_s
        # One that has been silent all the time is waited for but once.
        left_s = self._patience_s - silent_s if scans.n_received == 0 else self._patience_s
        return await scans.wait_for_more_than(scans.n_received, timeout_s=max(left_s, 0.0))

    def _read(self, message: Message, poses: PoseKeeper) -> RangeScan:
        here, scan = poses.latest, read_scan(message)
        if self._clock.is_set and abs(self._clock.now_s - scan.stamp_s) > STALE_S:
            raise LinkError("The scan is old.", hint="Compare the clocks of robot and laser.")
        mounting = find_mounting(
            self._frames.tree, base=self._profile.base_frame, sensor=scan.frame_id
        )
        angles_rad, ranges_m = _as_from_base(scan, mounting)
        return RangeScan(
            angles_rad=angles_rad,
            ranges_m=ranges_m,
            reach_m=scan.largest_range_m,
            pose=here.pose,
            stamp_s=scan.stamp_s,
        )


def _as_from_base(
    scan: LaserScan, mounting: Mounting
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return directions and ranges from the robot; of a beam without a range, its direction."""
    is_met = np.isfinite(scan.ranges_m)
    far_m = np.where(is_met, scan.ranges_m, scan.largest_range_m)
    with np.errstate(over="ignore", invalid="ignore"):
        beams = np.arange(len(far_m), dtype=np.float64)
        in_sensor = scan.first_angle_rad + scan.angle_step_rad * beams
        angles_rad, ranges_m = mounting.place(in_sensor, far_m)
    if not np.isfinite(angles_rad).all():
        raise LinkError("The scan's angles are none.", hint="Look at the topic: its driver errs.")
    without = np.where(scan.is_open, np.inf, np.nan)
    return angles_rad, np.where(is_met, ranges_m, without)
