"""The topics that we read and write: each in the quality that fits the others there."""

import logging
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.dds.discovery import Discovery, Endpoint
from mapspeak.links.dds.endpoints import Quality, RawReader, RawWriter, Sample, dds_topic, full_type
from mapspeak.links.dds.participant import DdsParticipant
from mapspeak.links.dds.types import Types
from mapspeak.ros.link import NativeLink, TopicRequest, check_name, wrong_type
from mapspeak.ros.messages.fields import TYPE, Message, bare_type

logger = logging.getLogger(__name__)

DEPTH, BULKY_DEPTH = 200, 5
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 30.0
"""Before a node that did not tell a type is asked for it again."""
LISTENER_S = 1.0
"""For a known listener to be connected to what we advertised."""


@dataclass(slots=True, eq=False)
class DdsTopicRequest(TopicRequest):
    """How a topic was asked for, and is read.

    Attributes:
        quality: In which it is read now; None while it is not.
        writers: The ids of those who wrote it when the reading began.
        taken_s: When the last message was taken, by the event loop's clock.
        has_learned: Its type was asked for already.
    """

    quality: Quality | None = None
    raw_reader: RawReader | None = None
    writers: frozenset[bytes] = frozenset()
    taken_s: float = float("-inf")
    has_learned: bool = False


@dataclass(frozen=True, slots=True)
class _Advertised:
    type_name: str
    raw_writer: RawWriter


class DdsTopics(NativeLink[DdsTopicRequest]):
    """Reads and writes topics of ROS.

    A topic is read only once somebody writes it, because how it can be read depends on who does: a
    reader that asks for more than a writer offers is not served, and one that asks for less misses
    the latched map.
    """

    def __init__(self, participant: DdsParticipant, discovery: Discovery, types: Types) -> None:
        super().__init__(DdsTopicRequest)
        self.discovery = discovery
        self.types = types
        self._participant = participant
        self._advertised: dict[str, _Advertised] = {}

    @abstractmethod
    async def ask_type(self, endpoint: Endpoint) -> None:
        """Ask the node behind a reader or writer for its type; raise `LinkError` if it fails."""

    # --- reading

    def _note_topic(self, dds_name: str) -> None:
        """Take in that others have begun or ended to read or write a topic."""
        for request in self.requests.values():
            if dds_topic(request.subscription.topic) == dds_name:
                self._begin(request)

    def _begin(self, request: DdsTopicRequest) -> None:
        """Read it in the best quality that all of its writers offer.

        It is read anew when somebody new writes: Fast DDS serves at once a reader that comes after
        its writer, and may take three seconds to serve one that was there before.
        """
        name = dds_topic(request.subscription.topic)
        writers = self.discovery.writers_of(name)
        if not writers:
            return
        if not self.types.knows(writers[0].type_name):
            self._learn(request)
            return
        quality = Quality(
            is_reliable=all(each.is_reliable for each in writers),
            is_latched=all(each.is_latched for each in writers),
            depth=BULKY_DEPTH if request.is_bulky else DEPTH,
        )
        keys = frozenset(each.key for each in writers)
        if request.quality == quality and keys <= request.writers:
            return
        self._end(request)
        request.quality, request.writers = quality, keys
        request.raw_reader = self._participant.read(
            name,
            writers[0].type_name,
            quality=quality,
            decode=partial(self.types.decode, writers[0].type_name),
            take=partial(self._take, request),
        )

    def _learn(self, request: DdsTopicRequest) -> None:
        """Ask for a type that we do not know, or know in another version, until it is told once."""
        if not request.has_learned:
            request.has_learned = True
            self.start_soon(partial(self._learn_and_renew, request))

    async def _learn_and_renew(self, request: DdsTopicRequest) -> None:
        # A node's services may be found after its topics, and a busy node may answer too late.
        topic = request.subscription.topic
        pause_s = FIRST_PAUSE_S
        while self.requests.get(topic) is request:
            try:
                # Whoever writes now: the node that was asked before may have gone.
                for writer in self.discovery.writers_of(dds_topic(topic))[:1]:
                    await self.ask_type(writer)
                    self.renew(request.subscription)
                    return
            except LinkError as error:
                if pause_s == FIRST_PAUSE_S:
                    logger.warning("%s cannot be read: %s", topic, error)
            await anyio.sleep(pause_s)
            pause_s = min(2 * pause_s, LONGEST_PAUSE_S)

    def _end(self, request: DdsTopicRequest) -> None:
        if request.raw_reader is not None:
            self._participant.end_reading(request.raw_reader)
        request.raw_reader = request.quality = None

    def _take(self, request: DdsTopicRequest, sample: Sample) -> None:
        if sample.refusal is not None:
            self._learn(request)
            return
        now_s = anyio.current_time()
        if now_s - request.taken_s < request.throttle_ms / 1e3:
            return
        request.taken_s = now_s
        request.subscription.take(sample.content)

    # --- writing

    def _announce(self, topic: str, type_name: str) -> None:
        self._check(topic, type_name)
        full = full_type(type_name)
        known = self._advertised.get(topic)
        if known is not None:
            if known.type_name != full:
                raise wrong_type(topic, known.type_name, type_name)
            return
        name = dds_topic(topic)
        is_latched = any(each.is_latched for each in self.discovery.readers_of(name))
        quality = Quality(is_reliable=True, is_latched=is_latched, depth=DEPTH)
        raw_writer = self._participant.write_to(name, full, quality=quality)
        self._advertised[topic] = _Advertised(full, raw_writer)

    def _take_back(self, topic: str) -> None:
        known = self._advertised.pop(topic, None)
        if known is not None:
            self._participant.end_writing(known.raw_writer)

    async def publish(self, topic: str, message: Message) -> None:
        """Publish, once those who are known to listen are connected."""
        self.announcements.use(topic)
        known = self._wanted(topic)
        listeners = self.discovery.readers_of(dds_topic(topic))
        if listeners and not self.types.knows(known.type_name):
            await self.ask_type(listeners[0])
        data = self.types.encode(known.type_name, message)
        if listeners:
            await known.raw_writer.wait_for_reader(timeout_s=LISTENER_S)
        known.raw_writer.write(data)

    def _prepare(self, topic: str, message: Message) -> Callable[[], int]:
        data = self.types.encode(self._wanted(topic).type_name, message)

        def send() -> int:
            self._wanted(topic).raw_writer.write(data)
            return 1

        return send

    def _wanted(self, topic: str) -> _Advertised:
        known = self._advertised.get(topic)
        if known is None:
            raise LinkError(f"{topic[:80]} was not advertised.", hint="Advertise it first.")
        return known

    def _check(self, topic: str, type_name: str | None) -> None:
        check_name(topic)
        if type_name is None:
            return
        if not TYPE.fullmatch(type_name):
            raise LinkError(
                f"{type_name[:80]!r} is no type.", hint='Types are written "package/msg/Type".'
            )
        found = self.discovery.type_of(dds_topic(topic))
        if found is not None and bare_type(found) != bare_type(type_name):
            raise wrong_type(topic, found, type_name)
