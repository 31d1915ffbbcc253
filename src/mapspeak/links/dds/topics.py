"""The topics that we read and write: each in the quality that fits the others there."""

import logging
from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass
from functools import partial
from typing import Any

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.dds.discovery import Discovery, Endpoint
from mapspeak.links.dds.endpoints import Inlet, Outlet, Quality, Sample, dds_topic, full_type
from mapspeak.links.dds.participant import DdsParticipant
from mapspeak.links.dds.types import Types
from mapspeak.ros import TYPE
from mapspeak.ros.messages import Message, bare_type
from mapspeak.ros.native import NativeTopics, check_name, wrong_type
from mapspeak.ros.subscribing import TopicSubscription

logger = logging.getLogger(__name__)

DEPTH, BULKY_DEPTH = 200, 5
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 30.0
"""Before a node that did not tell a type is asked for it again."""
LISTENER_S = 1.0
"""For a known listener to be connected to what we advertised."""

StartSoon = Callable[[Callable[[], Coroutine[Any, Any, None]]], None]
AskType = Callable[[Endpoint], Awaitable[None]]


@dataclass(slots=True, eq=False)
class _Request:
    """How a topic was asked for.

    Attributes:
        subscription: Of the topic.
        is_bulky: Fewer messages are kept for a slow reader.
        throttle_s: The least time between two messages.
        quality: In which it is read now; None while it is not.
        inlet: What reads it.
        writers: The ids of those who wrote it when the reading began.
        taken_s: When the last message was taken, by the event loop's clock.
        has_learned: Its type was asked for already.
    """

    subscription: TopicSubscription
    is_bulky: bool
    throttle_s: float
    quality: Quality | None = None
    inlet: Inlet | None = None
    writers: frozenset[bytes] = frozenset()
    taken_s: float = float("-inf")
    has_learned: bool = False


@dataclass(frozen=True, slots=True)
class _Advertised:
    type_name: str
    outlet: Outlet


class DdsTopics(NativeTopics[_Request]):
    """Reads and writes topics of ROS.

    A topic is read only once somebody writes it, because how it can be read depends on who does: a
    reader that asks for more than a writer offers is not served, and one that asks for less misses
    the latched map.

    Args:
        participant: Ours.
        discovery: Says who reads and writes what.
        types: Encodes and decodes.
        ask_type: Makes the type of an endpoint known by asking its node; raises `LinkError`.
        start_soon: Runs something in the background.
    """

    def __init__(
        self,
        participant: DdsParticipant,
        discovery: Discovery,
        types: Types,
        *,
        ask_type: AskType,
        start_soon: StartSoon,
    ) -> None:
        super().__init__()
        self._participant = participant
        self._discovery = discovery
        self._types = types
        self._ask_type = ask_type
        self._start_soon = start_soon
        self._advertised: dict[str, _Advertised] = {}

    # --- reading

    def request(
        self, subscription: TopicSubscription, *, is_bulky: bool, throttle_s: float
    ) -> _Request:
        """Return a request that nothing has been done for yet."""
        return _Request(subscription, is_bulky, throttle_s)

    def note_change(self, dds_name: str) -> None:
        """Take in that others have begun or ended to read or write a topic."""
        for request in self.requests.values():
            if dds_topic(request.subscription.topic) == dds_name:
                self.arrange(request)

    def arrange(self, request: _Request) -> None:
        """Read a topic in the best quality that all of its writers offer.

        It is read anew when somebody new writes: Fast DDS serves at once a reader that comes after
        its writer, and may take three seconds to serve one that was there before.
        """
        name = dds_topic(request.subscription.topic)
        writers = self._discovery.writers_of(name)
        if not writers:
            return
        if not self._types.knows(writers[0].type_name):
            self._learn(request, writers[0])
            return
        quality = Quality(
            is_reliable=all(each.is_reliable for each in writers),
            is_latched=all(each.is_latched for each in writers),
            depth=BULKY_DEPTH if request.is_bulky else DEPTH,
        )
        keys = frozenset(each.key for each in writers)
        if request.quality == quality and keys <= request.writers:
            return
        self.end(request)
        request.quality, request.writers = quality, keys
        request.inlet = self._participant.read(
            name,
            writers[0].type_name,
            quality=quality,
            decode=partial(self._types.decode, writers[0].type_name),
            take=partial(self._take, request),
        )

    def _learn(self, request: _Request, writer: Endpoint) -> None:
        """Ask for a type that we do not know, or know in another version, until it is told once."""
        if not request.has_learned:
            request.has_learned = True
            self._start_soon(partial(self._learn_and_arrange, request, writer))

    async def _learn_and_arrange(self, request: _Request, writer: Endpoint) -> None:
        # A node's services may be found after its topics, and a busy node may answer too late.
        topic = request.subscription.topic
        pause_s = FIRST_PAUSE_S
        while self.requests.get(topic) is request:
            try:
                await self._ask_type(writer)
            except LinkError as error:
                if pause_s == FIRST_PAUSE_S:
                    logger.warning("%s cannot be read: %s", topic, error)
                await anyio.sleep(pause_s)
                pause_s = min(2 * pause_s, LONGEST_PAUSE_S)
            else:
                self.renew(topic)
                return

    def end(self, request: _Request) -> None:
        """Read a topic no longer."""
        if request.inlet is not None:
            self._participant.end_reading(request.inlet)
        request.inlet = request.quality = None

    def _take(self, request: _Request, sample: Sample) -> None:
        if sample.refusal is not None:
            for writer in self._discovery.writers_of(dds_topic(request.subscription.topic))[:1]:
                self._learn(request, writer)
            return
        now_s = anyio.current_time()
        if now_s - request.taken_s < request.throttle_s:
            return
        request.taken_s = now_s
        request.subscription.take(sample.content)

    # --- writing

    @property
    def has_advertised(self) -> bool:
        """True when something may have been published."""
        return bool(self._advertised)

    def advertise(self, topic: str, *, type_name: str) -> None:
        """Say that we will publish.

        Raises:
            LinkError: The name or the type is none, or the topic has another type.
        """
        self.check(topic, type_name)
        full = full_type(type_name)
        known = self._advertised.get(topic)
        if known is not None:
            if known.type_name != full:
                raise wrong_type(topic, known.type_name, type_name)
            return
        name = dds_topic(topic)
        is_latched = any(each.is_latched for each in self._discovery.readers_of(name))
        quality = Quality(is_reliable=True, is_latched=is_latched, depth=DEPTH)
        outlet = self._participant.write_to(name, full, quality=quality)
        self._advertised[topic] = _Advertised(full, outlet)

    def unadvertise(self, topic: str) -> None:
        """Take back what `advertise` said."""
        known = self._advertised.pop(topic, None)
        if known is not None:
            self._participant.end_writing(known.outlet)

    async def publish(self, topic: str, message: Message) -> None:
        """Publish, once those who are known to listen are connected.

        Raises:
            LinkError: The topic was not advertised, or the message does not fit its type.
        """
        known = self._wanted(topic)
        listeners = self._discovery.readers_of(dds_topic(topic))
        if listeners and not self._types.knows(known.type_name):
            await self._ask_type(listeners[0])
        data = self._types.encode(known.type_name, message)
        if listeners:
            await known.outlet.wait_for_reader(timeout_s=LISTENER_S)
        known.outlet.write(data)

    def publish_at_once(self, topic: str, message: Message) -> None:
        """Publish to those who are connected already.

        Raises:
            LinkError: The topic was not advertised, or the message does not fit its type.
        """
        known = self._wanted(topic)
        known.outlet.write(self._types.encode(known.type_name, message))

    def _wanted(self, topic: str) -> _Advertised:
        known = self._advertised.get(topic)
        if known is None:
            raise LinkError(f"{topic[:80]} was not advertised.", hint="Advertise it first.")
        return known

    def check(self, topic: str, type_name: str | None) -> None:
        """Raise `LinkError` where a name or a type is none, or do not go with the other."""
        check_name(topic)
        if type_name is None:
            return
        if not TYPE.fullmatch(type_name):
            raise LinkError(
                f"{type_name[:80]!r} is no type.", hint='Types are written "package/msg/Type".'
            )
        found = self._discovery.type_of(dds_topic(topic))
        if found is not None and bare_type(found) != bare_type(type_name):
            raise wrong_type(topic, found, type_name)
