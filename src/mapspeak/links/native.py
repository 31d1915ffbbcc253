"""The common part of links that are members of the robot's own network, without a bridge.

Messages go as CDR, the encoding of DDS: each link moves bytes, and tells who reads and writes.
"""

import time
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.cdr import KnownTypes
from mapspeak.links.endpoints import (
    Decode,
    Endpoint,
    Sample,
    Take,
    full_type,
    is_hidden,
    unknown,
    whole_type,
)
from mapspeak.links.goals import ActionWire, ServiceClient
from mapspeak.ros.activity import ActionGoal, Subscription
from mapspeak.ros.link import Patience, wrong_type
from mapspeak.ros.messages.fields import (
    BULKY,
    Dialect,
    Message,
    bare_type,
    check_name,
    check_type,
)
from mapspeak.ros.port import RosConnection, RosGraph, TopicQuality

QoS = Any  # a quality of service in each link's own terms
SEND_GOAL = "/_action/send_goal"
DEPTH, BULKY_DEPTH = 200, 5
"""Queue depth of a subscription."""
LISTENER_S = 1.0
"""Longest wait for a known subscriber to connect to an advertised topic."""


class TopicReader(Protocol):
    """The reader of one topic."""

    def close(self) -> None:
        """Read no longer."""
        ...


class Writer(Protocol):
    """The writer of one topic."""

    def write(self, data: bytes) -> None:
        """Send the bytes of one message."""
        ...

    async def wait_for_reader(self, *, timeout_s: float) -> bool:
        """Wait for a reader until the time is over; return whether there is one."""
        ...

    def close(self) -> None:
        """Write no longer."""
        ...


@dataclass(slots=True, eq=False)
class Reading:
    """A topic that is being read.

    Attributes:
        reader: The link's own.
        quality: The quality of service in which it is read.
        writers: The ids of its writers when the reading began.
        decoded_s: When the last message was decoded, by the monotonic clock.
    """

    quality: object
    writers: frozenset[bytes]
    reader: TopicReader | None = None
    decoded_s: float = float("-inf")


class NativeLink(RosConnection):
    """Reads and writes topics, calls services, and pursues goals.

    A topic is read only once it has a writer, because the reader's QoS depends on the writer's: a
    reader that asks for more than a writer offers is not served, and one that asks for less misses
    the latched map.

    Attributes:
        reads_anew: A topic gets a new reader for each new writer.
        server_s: Longest wait for a server to be found: right after opening, not all are known.
    """

    reads_anew = False
    server_s = 2.0

    def __init__(self, types: KnownTypes, patience: Patience) -> None:
        super().__init__(patience)
        self._types = types
        self._found_s: float | None = None
        self._advertised: dict[str, tuple[str, Any]] = {}
        self._actions: dict[str, ActionWire] = {}

    @property
    def connected_for_s(self) -> float | None:
        """Since when nodes have been there, in wall time; None while none is."""
        return None if self._found_s is None else anyio.current_time() - self._found_s

    # --- implemented by each link

    @abstractmethod
    def _writers_of(self, topic: str) -> Sequence[Endpoint]:
        """Return the writers of a topic."""

    @abstractmethod
    def _readers_of(self, topic: str) -> Sequence[Endpoint]:
        """Return the readers of a topic, without us."""

    @abstractmethod
    def _quality(self, *, is_reliable: bool, is_latched: bool, depth: int) -> QoS:
        """Return a quality of service."""

    @abstractmethod
    def _read(
        self, topic: str, type_name: str, quality: QoS, decode: Decode, take: Take
    ) -> TopicReader:
        """Begin to read; `decode` is called in another thread, `take` in the event loop."""

    @abstractmethod
    def _write_to(self, topic: str, type_name: str, quality: QoS) -> Writer:
        """Begin to write."""

    @abstractmethod
    def _learn(self, subscription: Subscription) -> None:
        """Find out a type that is unknown, or known in another version; it may raise."""

    @abstractmethod
    async def ask_type(self, endpoint: Any) -> None:  # noqa: ANN401 - the link's own
        """Find out the type of a reader or writer now."""

    @abstractmethod
    async def _service(self, service: str, *, within_s: float) -> ServiceClient:
        """Return the client of a service that has a server."""

    @abstractmethod
    def _topic_types(self) -> dict[str, str]:
        """Return the types of all topics that others read or write, as "package/Type"."""

    @abstractmethod
    def _service_types(self) -> Mapping[str, str]:
        """Return the types of all services that have a server, the parts of actions too."""

    @property
    @abstractmethod
    def distro(self) -> str:
        """Such as "jazzy"; empty where that is unknown."""

    def find_quality(self, topic: str) -> TopicQuality:
        """Return the quality of service at a topic's ends."""
        writers, readers = self._writers_of(topic), self._readers_of(topic)
        return TopicQuality(publishers=tuple(writers), subscribers=tuple(readers))

    # --- reading

    def _begin(self, subscription: Subscription) -> None:
        """Read it in the best quality that all of its writers offer."""
        topic, reading = subscription.topic, subscription.reader
        writers = self._writers_of(topic)
        if not writers:
            return
        type_name = subscription.type_name or writers[0].type_name
        if not self._types.knows(type_name):
            self._learn(subscription)
            return
        quality = self._quality(
            is_reliable=all(each.is_reliable for each in writers),
            is_latched=all(each.is_latched for each in writers),
            depth=BULKY_DEPTH if bare_type(type_name) in BULKY else DEPTH,
        )
        keys = frozenset(each.key for each in writers)
        is_known = not self.reads_anew or (reading is not None and keys <= reading.writers)
        if reading is not None and reading.quality == quality and is_known:
            return
        self._end(subscription)
        reading = subscription.reader = Reading(quality, keys)
        decode = partial(self._decode, reading, subscription.throttle_ms / 1e3, type_name)
        take = partial(self._take, subscription)
        reading.reader = self._read(topic, type_name, quality, decode, take)

    def _end(self, subscription: Subscription) -> None:
        reading, subscription.reader = subscription.reader, None
        if reading is not None and reading.reader is not None:
            reading.reader.close()

    def _decode(
        self, reading: Reading, throttle_s: float, type_name: str, data: bytes
    ) -> Message | None:
        now_s = time.monotonic()
        if now_s - reading.decoded_s < throttle_s:
            return None
        reading.decoded_s = now_s
        return self._types.decode(type_name, data)

    def _take(self, subscription: Subscription, sample: Sample) -> None:
        if sample.refusal is not None:
            self._learn(subscription)
        elif sample.content is not None:
            subscription.take(sample.content)

    # --- writing

    def _announce(self, topic: str, type_name: str, is_latched: bool) -> None:  # noqa: FBT001
        full = full_type(type_name)
        known, _ = self._advertised.get(topic, (full, None))
        if known != full:
            raise wrong_type(topic, known, type_name)
        if topic not in self._advertised:
            is_latched = is_latched or any(each.is_latched for each in self._readers_of(topic))
            quality = self._quality(is_reliable=True, is_latched=is_latched, depth=DEPTH)
            self._advertised[topic] = full, self._write_to(topic, full, quality)

    def _take_back(self, topic: str) -> None:
        if topic in self._advertised:
            self._advertised.pop(topic)[1].close()

    async def publish(self, topic: str, message: Message) -> None:
        """Publish once the known subscribers are connected."""
        self._tell_first(topic)
        type_name, writer = self._wanted(topic)
        listeners = self._readers_of(topic)
        if listeners and not self._types.knows(type_name):
            await self.ask_type(listeners[0])
        data = self._types.encode(type_name, message)
        if listeners:
            await writer.wait_for_reader(timeout_s=LISTENER_S)
        writer.write(data)

    def _prepare(self, topic: str, message: Message) -> Callable[[], int]:
        data = self._types.encode(self._wanted(topic)[0], message)

        def send() -> int:
            self._wanted(topic)[1].write(data)
            return 1

        return send

    def _wanted(self, topic: str) -> tuple[str, Writer]:
        if topic not in self._advertised:
            raise LinkError(f"{topic[:80]} was not advertised.", hint="Advertise it first.")
        return self._advertised[topic]

    def _check(self, topic: str, type_name: str | None) -> None:
        check_name(topic, is_full=True)
        if type_name is None:
            return
        self._check_type(type_name)
        ends = (*self._writers_of(topic), *self._readers_of(topic))
        found = {bare_type(each.type_name) for each in ends}
        if found and bare_type(type_name) not in found:
            raise wrong_type(topic, min(found), type_name)

    def _check_type(self, type_name: str) -> None:
        """Raise `LinkError` for an invalid type."""
        check_type(type_name)

    # --- services and actions

    async def call_service(
        self,
        service: str,
        arguments: Mapping[str, Any] | None = None,
        *,
        type_name: str | None = None,
        timeout_s: float | None = None,
    ) -> dict[str, Any]:
        """Return the answer of a service."""
        limit_s = self.patience.answer_s if timeout_s is None else timeout_s
        answer = await self._call(service, arguments or {}, type_name=type_name, timeout_s=limit_s)
        content: dict[str, Any] = answer.content
        return content

    async def _call(
        self,
        service: str,
        arguments: Mapping[str, Any],
        *,
        type_name: str | None = None,
        timeout_s: float,
    ) -> Sample:
        check_name(service, is_full=True)
        client = await self._service(service, within_s=min(self.server_s, timeout_s))
        if type_name is not None and bare_type(type_name) != bare_type(client.type_name):
            raise wrong_type(service, client.type_name, type_name)
        return await client.call(client.encode(arguments), timeout_s=timeout_s)

    async def send_goal(self, action: str, arguments: Message, *, type_name: str) -> ActionGoal:
        """Send a goal to an action and return the goal, updated as its state changes."""
        check_name(action, is_full=True)
        found = self._action_types().get(action)
        if found not in (None, bare_type(type_name)):
            raise wrong_type(action, str(found), type_name)
        if action not in self._actions:
            await self._open_action(action)
        return await self._actions[action].send_goal(
            action, arguments, timeout_s=self.patience.answer_s
        )

    def cancel_goal(self, goal: ActionGoal) -> None:
        """Ask for the end of a goal; its `end` tells whether that worked."""
        if goal.action in self._actions:
            self._actions[goal.action].cancel_goal(goal.id)

    async def _open_action(self, action: str) -> None:
        send, result, cancel = [
            await self._service(f"{action}/_action/{part}", within_s=self.server_s)
            for part in ("send_goal", "get_result", "cancel_goal")
        ]
        if action in self._actions:
            return
        wire = ActionWire(send=send, result=result, cancel=cancel, start_soon=self.start_soon)
        self._actions[action] = wire
        self._note_servers(action)
        for part, take in (("status", wire.take_statuses), ("feedback", wire.take_feedback)):
            subscription = self.subscribe(f"{action}/_action/{part}")
            subscription.listen(take)
            if part == "status" and subscription.latest is not None:
                take(subscription.latest)

    @abstractmethod
    def _note_servers(self, action: str) -> None:
        """Tell an action client its present server."""

    # --- participants

    async def fetch_graph(self) -> RosGraph:
        """Return the topics and actions there are."""
        return RosGraph(
            dialect=Dialect.ROS2,
            distro=self.distro,
            types=self._topic_types(),
            actions=tuple(sorted(self._action_types())),
        )

    async def fetch_topics(self) -> Mapping[str, str]:
        """Return the type of each topic."""
        return (await self.fetch_graph()).types

    async def fetch_services(self) -> tuple[str, ...]:
        """Return the full names of all services but the parts of actions."""
        return tuple(sorted(name for name in self._service_types() if not is_hidden(name)))

    async def fetch_service_type(self, service: str) -> str:
        """Return a service's type."""
        return _look_up(self._service_types(), service)

    async def fetch_action_type(self, action: str) -> str:
        """Return an action's type."""
        return _look_up(self._action_types(), action)

    def _action_types(self) -> dict[str, str]:
        return {
            service.removesuffix(SEND_GOAL): bare_type(whole_type(type_name))
            for service, type_name in self._service_types().items()
            if service.endswith(SEND_GOAL)
        }


def _look_up(types: Mapping[str, str], name: str) -> str:
    if name not in types:
        raise unknown(name)
    return bare_type(types[name])
