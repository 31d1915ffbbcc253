"""The topics that we read and write: each in the quality of service that fits the others there."""

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import anyio
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from mapspeak.errors import LinkError
from mapspeak.links.rclpy.participant import RclpyParticipant, errors_of_ros, wait_until
from mapspeak.links.rclpy.types import find_message, read_message, write_message
from mapspeak.ros.link import NativeLink, TopicRequest, check_name, wrong_type
from mapspeak.ros.messages.fields import Message, bare_type

DEPTH, BULKY_DEPTH = 200, 5
"""How many messages ROS keeps until we take them."""
LISTENER_S = 1.0
"""For a known listener to be connected to what we advertised."""
YOUNG_S = 0.5
"""A listener that we know of may hear of us that much later, and miss what was published before."""
ARRIVAL_S = 0.5
"""For what was published last to arrive, before we leave."""


@dataclass(slots=True, eq=False)
class RclpyTopicRequest(TopicRequest):
    """How a topic was asked for, and is read.

    Attributes:
        quality: In which it is read now; None while it is not.
        n_readers: How many there have been; what an earlier one still brings is dropped.
    """

    quality: QoSProfile | None = None
    reader: Any = None
    n_readers: int = 0
    taken_s: float = float("-inf")


@dataclass(frozen=True, slots=True)
class _Advertised:
    message_class: Any
    publisher: Any
    made_s: float


class RclpyTopics(NativeLink[RclpyTopicRequest]):
    """Reads and writes topics of ROS.

    A topic is read only once somebody writes it, because how it can be read depends on who does: a
    reader that asks for more than a writer offers is not served, and one that asks for less misses
    the latched map.
    """

    def __init__(self, participant: RclpyParticipant) -> None:
        super().__init__(RclpyTopicRequest)
        self._participant = participant
        self._advertised: dict[str, _Advertised] = {}

    # --- reading

    def _refresh_topics(self) -> None:
        """Take in that others have begun or ended to write topics that we read."""
        for request in list(self.requests.values()):
            # What cannot be read stays silent; who waits for it is told so.
            with suppress(LinkError):
                self._begin(request)

    def _begin(self, request: RclpyTopicRequest) -> None:
        """Read it in the best quality that all of its writers offer."""
        topic = request.subscription.topic
        node = self._participant.node
        writers = node.get_publishers_info_by_topic(topic)
        if not writers:
            return
        profiles = [writer.qos_profile for writer in writers]
        is_reliable = all(each.reliability != ReliabilityPolicy.BEST_EFFORT for each in profiles)
        is_latched = all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in profiles)
        quality = _quality(
            is_reliable=is_reliable,
            is_latched=is_latched,
            depth=BULKY_DEPTH if request.is_bulky else DEPTH,
        )
        if request.quality == quality:
            return
        message_class = find_message(request.subscription.type_name or writers[0].topic_type)
        self._end(request)
        with errors_of_ros(f"{topic} cannot be read"):
            request.reader = node.create_subscription(
                message_class, topic, partial(self._take, request, request.n_readers), quality
            )
        request.quality = quality

    def _end(self, request: RclpyTopicRequest) -> None:
        if request.reader is not None:
            self._participant.node.destroy_subscription(request.reader)
        request.reader = request.quality = None
        request.n_readers += 1

    def _take(self, request: RclpyTopicRequest, number: int, message: Any) -> None:  # noqa: ANN401 - rclpy has no types
        """Take a message, in the thread of rclpy, and read it there."""
        now_s = time.monotonic()
        if now_s - request.taken_s < request.throttle_ms / 1e3:
            return
        request.taken_s = now_s
        self._participant.hand_over(self._give, request, number, read_message(message))

    def _give(self, request: RclpyTopicRequest, number: int, message: Message) -> None:
        if request.n_readers == number:
            request.subscription.take(message)

    # --- writing

    def _announce(self, topic: str, type_name: str) -> None:
        self._check(topic, type_name)
        message_class = find_message(type_name)
        known = self._advertised.get(topic)
        if known is not None:
            if known.message_class is not message_class:
                raise LinkError(
                    f"{topic} was advertised with another type than {bare_type(type_name)}.",
                    hint="A topic has one type: look it up on the robot.",
                )
            return
        node = self._participant.node
        readers = [each.qos_profile for each in node.get_subscriptions_info_by_topic(topic)]
        is_latched = any(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in readers)
        quality = _quality(is_reliable=True, is_latched=is_latched, depth=DEPTH)
        with errors_of_ros(f"{topic} cannot be written"):
            publisher = node.create_publisher(message_class, topic, quality)
        self._advertised[topic] = _Advertised(message_class, publisher, anyio.current_time())

    def _take_back(self, topic: str) -> None:
        known = self._advertised.pop(topic, None)
        if known is not None:
            self._participant.node.destroy_publisher(known.publisher)

    async def publish(self, topic: str, message: Message) -> None:
        """Publish, once those who are known to listen are connected."""
        self.announcements.use(topic)
        known = self._wanted(topic)
        written = write_message(known.message_class, message)
        if self._has_listeners(topic):
            count = known.publisher.get_subscription_count
            await wait_until(lambda: bool(count()), within_s=LISTENER_S)
            await anyio.sleep_until(known.made_s + YOUNG_S)
        self._write(topic, written)

    def _prepare(self, topic: str, message: Message) -> Callable[[], int]:
        written = write_message(self._wanted(topic).message_class, message)

        def send() -> int:
            self._write(topic, written)
            return 1

        return send

    async def _flush(self) -> None:
        """Return when all that was published has arrived, or after a short while."""
        publishers = [each.publisher for each in self._advertised.values()]
        await anyio.to_thread.run_sync(_wait_for_arrival, publishers)

    def _write(self, topic: str, written: Any) -> None:  # noqa: ANN401 - rclpy has no types
        known = self._wanted(topic)
        with errors_of_ros(f"Nothing can be published on {topic}"):
            known.publisher.publish(written)

    def _has_listeners(self, topic: str) -> bool:
        infos = self._participant.node.get_subscriptions_info_by_topic(topic)
        return any(each.node_name != self._participant.name for each in infos)

    def _wanted(self, topic: str) -> _Advertised:
        known = self._advertised.get(topic)
        if known is None:
            raise LinkError(f"{topic[:80]} was not advertised.", hint="Advertise it first.")
        return known

    def _check(self, topic: str, type_name: str | None) -> None:
        check_name(topic)
        if type_name is None:
            return
        find_message(type_name)
        node = self._participant.node
        infos = [
            *node.get_publishers_info_by_topic(topic),
            *node.get_subscriptions_info_by_topic(topic),
        ]
        found = {bare_type(each.topic_type) for each in infos}
        if found and bare_type(type_name) not in found:
            raise wrong_type(topic, min(found), type_name)


def _quality(*, is_reliable: bool, is_latched: bool, depth: int) -> QoSProfile:
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE,
    )


def _wait_for_arrival(publishers: list[Any]) -> None:
    for publisher in publishers:
        publisher.wait_for_all_acked(Duration(seconds=ARRIVAL_S))
