"""Pictures of the front camera, subscribed to only while somebody looks."""

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros import RosConnection, Subscription
from mapspeak.ros.discovery import RobotProfile
from mapspeak.ros.discovery.parts import CAMERA
from mapspeak.ros.discovery.profile import COMPRESSED_IMAGE, RAW_IMAGE
from mapspeak.ros.messages import (
    EncodedPicture,
    Message,
    read_camera_info,
    read_compressed_image,
    read_image,
)
from mapspeak.ros.subscribing import THROTTLE_MS, Lingering

PATIENCE_S, LONGEST_PATIENCE_S = 5.0, 30.0
FIRST_PATIENCE_S = 15.0
"""For a camera that is published and has said nothing yet: some give a picture in ten seconds."""
TIMES_SLOWEST = 3.0
INFO_PATIENCE_S = 1.0
CAMERA_HINT = "Check that the camera's driver runs, or name another camera_topic in robot.yaml."


class RosCamera:
    """Takes pictures.

    Args:
        connection: Connected to the robot.
        profile: Says which topic.
        patience_s: How long to wait for a picture, in wall time; longer for a slow camera.
        first_patience_s: How long to wait for the first.
    """

    def __init__(
        self,
        connection: RosConnection,
        profile: RobotProfile,
        *,
        patience_s: float = PATIENCE_S,
        first_patience_s: float = FIRST_PATIENCE_S,
    ) -> None:
        self._connection = connection
        self._profile = profile
        self._patience_s = patience_s
        is_alive = CAMERA.is_alive(profile)
        self._next_patience_s = first_patience_s if is_alive else patience_s
        self._slowest_s = 0.0
        self._lingering = Lingering(connection, self._subscribe)

    async def fetch(self) -> EncodedPicture:
        """Return a picture that arrives after it was asked for.

        Raises:
            LinkError: There is no camera, no picture came, or it cannot be read.
        """
        with self._lingering.look() as (pictures, *_):
            message = await self._next_message(pictures)
        return self._read(message)

    async def fetch_fov_rad(self) -> float | None:
        """Return the horizontal field of view in radians; None where the camera does not say."""
        infos = self._lingering.subscriptions[1:]
        if not infos:
            return None
        try:
            info = await infos[0].wait_for_more_than(0, timeout_s=INFO_PATIENCE_S)
            return read_camera_info(info).horizontal_fov_rad
        except LinkError:
            return None

    async def close_when_idle(self) -> None:
        """End the subscription whenever nobody has looked for a while; run until cancelled."""
        await self._lingering.close_when_idle()

    def _subscribe(self) -> tuple[Subscription, ...]:
        """Begin with the pictures; the camera's measures follow where it tells them."""
        profile = self._profile
        if profile.camera_topic is None:
            raise LinkError("The robot publishes no camera pictures.", hint=CAMERA_HINT)
        type_name = profile.dialect.type_name(profile.camera_type or RAW_IMAGE)
        pictures = self._connection.subscribe(
            profile.camera_topic, type_name=type_name, is_bulky=True, throttle_ms=THROTTLE_MS
        )
        if profile.camera_info_topic is None:
            return (pictures,)
        infos = self._connection.subscribe(profile.camera_info_topic, throttle_ms=THROTTLE_MS)
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

    def _read(self, message: Message) -> EncodedPicture:
        if self._profile.camera_type == COMPRESSED_IMAGE:
            return read_compressed_image(message)
        return read_image(message)
