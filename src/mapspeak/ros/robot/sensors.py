"""The camera and the laser, whose topics are subscribed to only while they are used.

Scans are transformed by the mounting pose of the laser.
"""

import math
from collections.abc import Callable, Generator
from contextlib import contextmanager

import anyio
import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError
from mapspeak.robot import RangeScan
from mapspeak.ros.activity import Subscription
from mapspeak.ros.discovery.profile import COMPRESSED_IMAGE, CameraTopics, RobotProfile
from mapspeak.ros.messages.fields import Message
from mapspeak.ros.messages.pictures import EncodedPicture, read_compressed_image, read_image
from mapspeak.ros.messages.scans import LaserScan, read_fov_rad, read_scan
from mapspeak.ros.port import RosConnection
from mapspeak.ros.robot.poses import PoseKeeper, RobotClock
from mapspeak.ros.transforms import FrameListener, TransformTree

LINGER_S = 10.0
"""Time from the last look to unsubscribing; a client that looks around asks again before that."""
THROTTLE_MS = 100


class IdleSubscriptions:
    """Subscribes at the first look, and unsubscribes after a while without one.

    Args:
        subscribe: Begins the subscriptions needed for a look; it may raise.

    Attributes:
        subscriptions: Those that it began; empty while idle.
    """

    def __init__(
        self, connection: RosConnection, subscribe: Callable[[], tuple[Subscription, ...]]
    ) -> None:
        self.subscriptions: tuple[Subscription, ...] = ()
        self._connection = connection
        self._subscribe = subscribe
        self._n_looking = 0
        self._looked_s = 0.0

    @contextmanager
    def look(self) -> Generator[tuple[Subscription, ...]]:
        """Keep the subscriptions during a look, and return them."""
        self._n_looking += 1
        try:
            if not self.subscriptions:
                self.subscriptions = self._subscribe()
                self._connection.start_soon(self._close_when_idle)
            yield self.subscriptions
        finally:
            self._n_looking -= 1
            self._looked_s = anyio.current_time()

    async def _close_when_idle(self) -> None:
        while (idle_s := self._measure_idle()) < LINGER_S:  # noqa: ASYNC110 - until a known time
            await anyio.sleep(LINGER_S - idle_s)
        for subscription in self.subscriptions:
            self._connection.unsubscribe(subscription)
        self.subscriptions = ()

    def _measure_idle(self) -> float:
        """Return for how long nobody has looked."""
        return 0.0 if self._n_looking else anyio.current_time() - self._looked_s


LONGEST_PATIENCE_S = 30.0
TIMES_SLOWEST = 3.0
INFO_PATIENCE_S = 1.0
CAMERA_HINT = "Check that the camera's driver runs, or name another camera_topic in robot.yaml."


def no_camera() -> LinkError:
    """Return the error for a robot without a camera."""
    return LinkError("The robot publishes no camera pictures.", hint=CAMERA_HINT)


class RosCamera:
    """Takes pictures."""

    def __init__(
        self, connection: RosConnection, profile: RobotProfile, camera: CameraTopics
    ) -> None:
        self._connection = connection
        self._profile = profile
        self._topics = camera
        self._patience_s = connection.patience.picture_s
        is_alive = camera.topic not in profile.dead_topics
        first_s = connection.patience.first_picture_s
        self._next_patience_s = first_s if is_alive else self._patience_s
        self._slowest_s = 0.0
        self._idle = IdleSubscriptions(connection, self._subscribe)

    async def fetch(self) -> EncodedPicture:
        """Return a picture that arrives after it was asked for.

        Raises:
            LinkError: No picture came, or it cannot be read.
        """
        with self._idle.look() as (pictures, *_):
            message = await self._next_message(pictures)
        is_compressed = self._topics.type_name == COMPRESSED_IMAGE
        return read_compressed_image(message) if is_compressed else read_image(message)

    async def fetch_fov_rad(self) -> float | None:
        """Return the horizontal field of view in radians; None where the camera does not say."""
        infos = self._idle.subscriptions[1:]
        if not infos:
            return None
        try:
            info = await infos[0].wait_for_more_than(0, timeout_s=INFO_PATIENCE_S)
            return read_fov_rad(info)
        except LinkError:
            return None

    def _subscribe(self) -> tuple[Subscription, ...]:
        """Begin with the pictures; the camera's measures follow where it tells them."""
        topics = self._topics
        pictures = self._connection.subscribe(
            topics.topic,
            type_name=self._profile.dialect.type_name(topics.type_name),
            throttle_ms=THROTTLE_MS,
        )
        if topics.info_topic is None:
            return (pictures,)
        infos = self._connection.subscribe(topics.info_topic, throttle_ms=THROTTLE_MS)
        return pictures, infos

    async def _next_message(self, pictures: Subscription) -> Message:
        before, asked_s = pictures.n_received, anyio.current_time()
        patience_s, self._next_patience_s = self._next_patience_s, self._patience_s
        try:
            message = await pictures.wait_for_more_than(before, timeout_s=patience_s)
        except LinkError as error:
            raise LinkError(error.message, hint=CAMERA_HINT) from error
        self._slowest_s = max(self._slowest_s, anyio.current_time() - asked_s)
        enough_s = max(self._patience_s, TIMES_SLOWEST * self._slowest_s)
        self._next_patience_s = min(enough_s, LONGEST_PATIENCE_S)
        return message


LEAST_LEVEL_RATIO = 0.3
"""A camera whose axis is steeper looks at the floor or the ceiling, and to no side."""


def find_camera_yaw_rad(tree: TransformTree, *, base: str, camera: str) -> float:
    """Return to which side of the robot a camera looks, left positive.

    Pictures are in an optical frame, whose z axis points ahead (REP 103); many drivers name the
    camera's body instead, whose x axis does, and whose z axis points up.

    Raises:
        LinkError: The frames do not say.
    """
    base_from_camera = tree.find_matrix(base, camera)
    for axis in (2, 0):
        x, y, _ = base_from_camera[:3, axis]
        if math.hypot(x, y) >= LEAST_LEVEL_RATIO:
            return math.atan2(y, x)
    raise LinkError("The camera looks up or down.", hint="Its picture shows no side of the robot.")


MOST_TILT_RAD = math.radians(10.0)
"""A laser that looks more up or down meets the floor or the ceiling within a few metres."""


def find_mounting(tree: TransformTree, *, base: str, sensor: str) -> NDArray[np.float64]:
    """Return where a sensor that looks along the floor is on the robot: base_from_sensor, 4x4.

    Raises:
        LinkError: The frames do not say, or it looks up or down.
    """
    base_from_sensor = tree.find_matrix(base, sensor)
    tilt_rad = math.acos(min(abs(float(base_from_sensor[2, 2])), 1.0))
    if tilt_rad > MOST_TILT_RAD:
        raise LinkError(
            f"The laser {sensor!r} is tilted by {math.degrees(tilt_rad):.0f} deg.",
            hint="Name the topic of a laser that looks along the floor: scan_topic in robot.yaml.",
        )
    return base_from_sensor


def place_beams(
    base_from_sensor: NDArray[np.float64],
    angles_rad: NDArray[np.float64],
    ranges_m: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return finite beams of the sensor's plane as directions and distances from the robot."""
    ends = np.stack([ranges_m * np.cos(angles_rad), ranges_m * np.sin(angles_rad)])
    x, y = base_from_sensor[:2, :2] @ ends + base_from_sensor[:2, 3:]
    return np.arctan2(y, x), np.hypot(x, y)


STALE_S = 1.0
"""Of robot time: an older scan was held up on its way, or its driver's clock is not the robot's."""


class Laser:
    """Takes scans. Whatever goes wrong, there is just none: nothing depends on them."""

    def __init__(
        self,
        connection: RosConnection,
        profile: RobotProfile,
        *,
        frames: FrameListener,
        clock: RobotClock,
    ) -> None:
        self._connection = connection
        self._profile = profile
        self._frames = frames
        self._clock = clock
        self._patience_s = connection.patience.scan_s
        self._idle = IdleSubscriptions(connection, self._subscribe)

    async def fetch(self, poses: PoseKeeper) -> RangeScan | None:
        """Return a scan that arrives after it was asked for, or None."""
        if not self._connection.is_open:
            return None
        try:
            with self._idle.look() as (scans,):
                message = await self._next_message(scans)
            return self._read(message, poses)
        except LinkError:
            return None

    def _subscribe(self) -> tuple[Subscription, ...]:
        profile = self._profile
        if profile.scan_topic is None:
            raise LinkError("The robot publishes no scans.", hint="Name scan_topic in robot.yaml.")
        type_name = profile.dialect.type_name("sensor_msgs/LaserScan")
        scans = self._connection.subscribe(
            profile.scan_topic, type_name=type_name, throttle_ms=THROTTLE_MS
        )
        return (scans,)

    async def _next_message(self, scans: Subscription) -> Message:
        silent_s = anyio.current_time() - scans.begun_s
        # One that has been silent all the time is waited for but once.
        left_s = self._patience_s - silent_s if scans.n_received == 0 else self._patience_s
        return await scans.wait_for_more_than(scans.n_received, timeout_s=max(left_s, 0.0))

    def _read(self, message: Message, poses: PoseKeeper) -> RangeScan:
        scan = read_scan(message)
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
            pose=poses.find_at(scan.stamp_s),
            stamp_s=scan.stamp_s,
        )


def _as_from_base(
    scan: LaserScan, base_from_sensor: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return directions and ranges from the robot; of a beam without a range, its direction."""
    is_met = np.isfinite(scan.ranges_m)
    far_m = np.where(is_met, scan.ranges_m, scan.largest_range_m)
    with np.errstate(over="ignore", invalid="ignore"):
        beams = np.arange(len(far_m), dtype=np.float64)
        in_sensor = scan.first_angle_rad + scan.angle_step_rad * beams
        angles_rad, ranges_m = place_beams(base_from_sensor, in_sensor, far_m)
    if not np.isfinite(angles_rad).all():
        raise LinkError("The scan's angles are none.", hint="Look at the topic: its driver errs.")
    without = np.where(scan.is_open, np.inf, np.nan)
    return angles_rad, np.where(is_met, ranges_m, without)
