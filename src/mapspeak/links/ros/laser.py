"""Scans of the robot's laser, subscribed to only while somebody wants them."""

import anyio
import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError
from mapspeak.links.ros.clock import RobotClock
from mapspeak.links.ros.discovery import RobotProfile
from mapspeak.links.ros.frames import FrameListener
from mapspeak.links.ros.mounting import Mounting, find_mounting
from mapspeak.links.ros.poses import PoseKeeper
from mapspeak.robot import SCAN_PATIENCE_S, RangeScan
from mapspeak.ros import RosConnection, Subscription
from mapspeak.ros.messages import LaserScan, Message, read_scan

LINGER_S = 10.0
"""After the last scan; one who looks around asks again before that."""
THROTTLE_MS = 100
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
        self._scans: Subscription | None = None
        self._n_looking = 0
        self._looked_s = 0.0
        self._is_open = anyio.Event()

    async def fetch(self, poses: PoseKeeper) -> RangeScan | None:
        """Gives a scan that arrives after it was asked for, or None.

        Args:
            poses: Knows where the robot is when it comes.
        """
        if self._profile.scan_topic is None or not self._connection.is_open:
            return None
        self._n_looking += 1
        try:
            message = await self._next_message(self._subscribe(self._profile.scan_topic))
            return self._read(message, poses)
        except LinkError:
            return None
        finally:
            self._n_looking -= 1
            self._looked_s = anyio.current_time()

    async def close_when_idle(self) -> None:
        """Ends the subscription whenever nobody has looked for a while; runs until cancelled."""
        while True:
            await self._is_open.wait()
            await anyio.sleep_until(self._looked_s + LINGER_S)
            if self._n_looking == 0 and anyio.current_time() >= self._looked_s + LINGER_S:
                self._unsubscribe()

    def _subscribe(self, topic: str) -> Subscription:
        if self._scans is None:
            self._looked_s = anyio.current_time()
            self._scans = self._connection.subscribe(
                topic,
                type_name=self._profile.dialect.type_name("sensor_msgs/LaserScan"),
                is_bulky=True,
                throttle_ms=THROTTLE_MS,
            )
            self._is_open.set()
        return self._scans

    def _unsubscribe(self) -> None:
        if self._scans is not None:
            self._connection.unsubscribe(self._scans)
        self._scans = None
        self._is_open = anyio.Event()

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
    """Gives directions and ranges from the robot; of a beam without a range, its direction."""
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
