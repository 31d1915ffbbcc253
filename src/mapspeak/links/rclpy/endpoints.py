"""Readers, writers and service clients over rclpy, all of them in bytes."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import anyio
from rclpy.duration import Duration
from rclpy.serialization import deserialize_message, serialize_message

from mapspeak.links.endpoints import (
    ARRIVAL_S,
    Decode,
    Sample,
    Take,
    no_answer,
    nobody_serves,
    understand,
)
from mapspeak.links.goals import Answer
from mapspeak.links.rclpy.participant import RclpyParticipant, errors_of_ros, wait_until
from mapspeak.links.rclpy.types import RclpyTypes, find_message

YOUNG_S = 0.5
"""A known subscriber may discover us this much later, and miss earlier messages."""


class RclpyReader:
    """Reads one topic: decodes in the thread of rclpy, and takes in the event loop."""

    def __init__(
        self,
        participant: RclpyParticipant,
        topic: str,
        type_name: str,
        quality: Any,  # noqa: ANN401 - rclpy has no types
        decode: Decode,
        take: Take,
    ) -> None:
        self._participant = participant
        self._decode = decode
        self._take = take
        self._is_open = True
        with errors_of_ros(f"{topic} cannot be read"):
            self._subscription = participant.node.create_subscription(
                find_message(type_name), topic, self._hear, quality, raw=True
            )

    def close(self) -> None:
        """Stop reading; drop later messages from rclpy."""
        self._is_open = False
        self._participant.node.destroy_subscription(self._subscription)

    def _hear(self, data: bytes) -> None:
        self._participant.hand_over(self._give, understand(data, self._decode))

    def _give(self, sample: Sample) -> None:
        if self._is_open:
            self._take(sample)


class RclpyWriter:
    """Writes on one topic."""

    def __init__(
        self,
        participant: RclpyParticipant,
        topic: str,
        type_name: str,
        quality: Any,  # noqa: ANN401 - rclpy has no types
    ) -> None:
        self._participant = participant
        self._topic = topic
        self._made_s = anyio.current_time()
        with errors_of_ros(f"{topic} cannot be written"):
            self._publisher = participant.node.create_publisher(
                find_message(type_name), topic, quality
            )

    def write(self, data: bytes) -> None:
        """Send the bytes of one message."""
        with errors_of_ros(f"Nothing can be published on {self._topic}"):
            self._publisher.publish(data)

    async def wait_for_reader(self, *, timeout_s: float) -> bool:
        """Wait for a reader until the time is over; return whether there is one."""
        count = self._publisher.get_subscription_count
        is_read = await wait_until(lambda: bool(count()), within_s=timeout_s)
        await anyio.sleep_until(self._made_s + YOUNG_S)
        return is_read

    def flush(self) -> None:
        """Return when all has arrived, or after a short while."""
        self._publisher.wait_for_all_acked(Duration(seconds=ARRIVAL_S))

    def close(self) -> None:
        """Write no longer."""
        self._participant.node.destroy_publisher(self._publisher)


class RclpyService:
    """Asks one service; see `ServiceClient`."""

    tells_whom = True

    def __init__(
        self, participant: RclpyParticipant, service: str, type_name: str, *, types: RclpyTypes
    ) -> None:
        self.service = service
        self.type_name = type_name
        self.on_answer: Callable[[int, Answer], None] | None = None
        self._participant = participant
        self._types = types
        self._class = find_message(type_name, "srv")
        self._n_posted = 0
        with errors_of_ros(f"{service} cannot be called"):
            self._client = participant.node.create_client(self._class, service)

    @property
    def is_served(self) -> bool:
        """True while the service has a server."""
        return bool(self._client.service_is_ready())

    async def wait_for_server(self, *, timeout_s: float) -> None:
        """Return when the service has a server."""
        if not await wait_until(lambda: self.is_served, within_s=timeout_s):
            raise nobody_serves(self.service)

    def encode(self, arguments: Mapping[str, Any]) -> bytes:
        """Return a request."""
        return self._types.encode(f"{self.type_name}_Request", arguments)

    async def call(self, request: bytes, *, timeout_s: float) -> Sample:
        """Return the service's answer; forget a call that is not answered in time."""
        future = self._send(request)
        try:
            with anyio.move_on_after(timeout_s):
                await self._participant.wait_for(future)
                return Sample(content=self._read(future))
        finally:
            self._client.remove_pending_request(future)
        raise no_answer(self.service, timeout_s)

    def post(self, request: bytes) -> int:
        """Send a request without waiting for the answer, and return its number."""
        self._n_posted += 1
        self._send(request).add_done_callback(partial(self._hear, self._n_posted))
        return self._n_posted

    def _send(self, request: bytes) -> Any:  # noqa: ANN401 - rclpy has no types
        with errors_of_ros("The request cannot be sent"):
            return self._client.call_async(deserialize_message(request, self._class.Request))

    def _hear(self, number: int, future: Any) -> None:  # noqa: ANN401 - likewise
        if self.on_answer is not None:
            self._participant.hand_over(self.on_answer, number, self._read(future))

    def _read(self, future: Any) -> Answer:  # noqa: ANN401 - likewise
        with errors_of_ros("The answer"):
            data = serialize_message(future.result())
        return self._types.decode(f"{self.type_name}_Response", data)
