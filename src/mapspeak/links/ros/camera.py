"""Pictures of the front camera, subscribed to only while somebody looks."""

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.ros.discovery import RobotProfile
from mapspeak.links.ros.discovery.profile import COMPRESSED_IMAGE, RAW_IMAGE
from mapspeak.ros import RosConnection, Subscription
from mapspeak.ros.messages import (
    EncodedPicture,
    Message,
    read_camera_info,
    read_compressed_image,
    read_image,
)

PATIENCE_S = 5.0
INFO_PATIENCE_S = 1.0
LINGER_S = 10.0
"""After the last picture; one who looks around asks again before that."""
THROTTLE_MS = 100
CAMERA_HINT = "Check that the camera's driver runs, or name another camera_topic in robot.yaml."


class Camera:
    """Takes pictures.

    Args:
        connection: Connected to the robot.
        profile: Says which topic.
        patience_s: How long to wait for a picture, in wall time.
    """

    def __init__(
        self, connection: RosConnection, profile: RobotProfile, *, patience_s: float = PATIENCE_S
    ) -> None:
        self._connection = connection
        self._profile = profile
        self._patience_s = patience_s
        self._pictures: Subscription | None = None
        self._infos: Subscription | None = None
        self._n_looking = 0
        self._looked_s = 0.0
        self._is_open = anyio.Event()

    async def fetch(self) -> EncodedPicture:
        """Gives a picture that arrives after it was asked for.

        Raises:
            LinkError: There is no camera, no picture came, or it cannot be read.
        """
        self._n_looking += 1
        try:
            message = await self._next_message(self._subscribe())
        finally:
            self._n_looking -= 1
            self._looked_s = anyio.current_time()
        return self._read(message)

    async def fetch_fov_rad(self) -> float | None:
        """Gives the horizontal field of view in radians; None where the camera does not say."""
        if self._infos is None:
            return None
        try:
            info = await self._infos.wait_for_more_than(0, timeout_s=INFO_PATIENCE_S)
            return read_camera_info(info).horizontal_fov_rad
        except LinkError:
            return None

    async def close_when_idle(self) -> None:
        """Ends the subscription whenever nobody has looked for a while; runs until cancelled."""
        while True:
            await self._is_open.wait()
            await anyio.sleep_until(self._looked_s + LINGER_S)
            if self._n_looking == 0 and anyio.current_time() >= self._looked_s + LINGER_S:
                self._unsubscribe()

    def _subscribe(self) -> Subscription:
        if self._pictures is None:
            if self._profile.camera_topic is None:
                raise LinkError("The robot publishes no camera pictures.", hint=CAMERA_HINT)
            self._looked_s = anyio.current_time()
            self._pictures = self._connection.subscribe(
                self._profile.camera_topic,
                type_name=self._profile.dialect.type_name(self._profile.camera_type or RAW_IMAGE),
                is_bulky=True,
                throttle_ms=THROTTLE_MS,
            )
            if self._profile.camera_info_topic is not None:
                self._infos = self._connection.subscribe(
                    self._profile.camera_info_topic, throttle_ms=THROTTLE_MS
                )
            self._is_open.set()
        return self._pictures

    def _unsubscribe(self) -> None:
        for subscription in (self._pictures, self._infos):
            if subscription is not None:
                self._connection.unsubscribe(subscription)
        self._pictures = self._infos = None
        self._is_open = anyio.Event()

    async def _next_message(self, pictures: Subscription) -> Message:
        before = pictures.n_received
        try:
            return await pictures.wait_for_more_than(before, timeout_s=self._patience_s)
        except LinkError as error:
            raise LinkError(error.message, hint=CAMERA_HINT) from error

    def _read(self, message: Message) -> EncodedPicture:
        if self._profile.camera_type == COMPRESSED_IMAGE:
            return read_compressed_image(message)
        return read_image(message)
