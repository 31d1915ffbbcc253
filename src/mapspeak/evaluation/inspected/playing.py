"""A ROS system as a description, with something out of order, and on the wire, as a rosbridge."""

from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import anyio

from mapspeak.evaluation.inspected.contents import Content, Transforms
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server import (
    Hub,
    Interfaces,
    Parameters,
    RosSystem,
    Service,
    Topic,
    add_parameter_services,
    add_rosapi,
    serve_system,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Stream:
    """What one node publishes on one topic.

    Attributes:
        node: Its full name.
        topic: Likewise.
        type: Of the messages, as "package/Type".
        content: What they say.
        rate_hz: Messages in a second of the wall clock; 0 for a stream that has died, None for one
            message, which is kept for all who come later.
        lag_s: How far its stamps lie behind the robot's clock.
    """

    node: str
    topic: str
    type: str
    content: Content
    rate_hz: float | None
    lag_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Hearing:
    """One node that listens to one topic.

    Attributes:
        node: Its full name.
        topic: Likewise.
        type: Of the messages that it expects, as "package/Type".
    """

    node: str
    topic: str
    type: str


@dataclass(frozen=True, slots=True, kw_only=True)
class OfferedService:
    """One service; whoever calls it gets an empty answer.

    Attributes:
        node: Which offers it.
        service: Its full name.
        type: As "package/Type".
    """

    node: str
    service: str
    type: str


@dataclass(frozen=True, slots=True, kw_only=True)
class InspectedSystem:
    """All that the robot's ROS consists of.

    Attributes:
        dialect: Which ROS it is.
        started_s: The robot's clock in the beginning, in seconds.
        streams: What is published.
        hearings: What is heard.
        services: What is offered, besides what every ROS offers.
        parameters: Values by nodes and their own names; each node is named here.
        types: The texts of types that no ROS comes with, by "package/Type".
    """

    dialect: Dialect
    started_s: float
    streams: tuple[Stream, ...]
    hearings: tuple[Hearing, ...]
    services: tuple[OfferedService, ...] = ()
    parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    types: Mapping[str, str] = field(default_factory=dict)

    @property
    def nodes(self) -> tuple[str, ...]:
        """All nodes by name."""
        named = {each.node for group in (self.streams, self.hearings) for each in group}
        return tuple(sorted(named | set(self.parameters) | {each.node for each in self.services}))

    @property
    def topics(self) -> tuple[str, ...]:
        """All topics that somebody publishes or hears, by name."""
        return tuple(sorted(self._types()))

    def publishers_of(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that publish a topic, by name."""
        return tuple(sorted({each.node for each in self.streams if each.topic == topic}))

    def hearers_of(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that hear a topic, by name."""
        return tuple(sorted({each.node for each in self.hearings if each.topic == topic}))

    def stream_on(self, topic: str) -> Stream:
        """Return the stream on a topic that has one."""
        return next(each for each in self.streams if each.topic == topic)

    def type_of(self, topic: str) -> str:
        """Return the type of a topic that is there."""
        return self._types()[topic]

    def _types(self) -> dict[str, str]:
        heard = {each.topic: each.type for each in self.hearings}
        return heard | {each.topic: each.type for each in self.streams}


ROSOUT = "/rosout"
LOG = "rosgraph_msgs/Log"


@asynccontextmanager
async def play(system: InspectedSystem) -> AsyncGenerator[str]:
    """Play a system, in real time, while the context lasts; return the address of its rosbridge."""
    begun_s = anyio.current_time()

    def clock() -> float:
        return system.started_s + anyio.current_time() - begun_s

    played = _build(system, clock)
    for stream in system.streams:
        if stream.rate_hz is None:
            _publish(played, stream, clock())
    async with anyio.create_task_group() as tasks:
        for stream in system.streams:
            if stream.rate_hz:
                tasks.start_soon(_keep_publishing, played, stream, stream.rate_hz, clock)
        async with serve_system(played) as server:
            yield server.url
        tasks.cancel_scope.cancel()


def _build(system: InspectedSystem, clock: Callable[[], float]) -> RosSystem:
    interfaces = Interfaces(system.dialect, more=system.types)
    played = RosSystem(Hub(_topics_of(system)), interfaces, dialect=system.dialect)
    for each in system.services:
        played.services.add(_offer(each, interfaces))
    parameters = Parameters(
        system.dialect, {node: dict(values) for node, values in system.parameters.items()}
    )
    _use_own_clock(system, parameters)
    if system.dialect is Dialect.ROS2:
        add_parameter_services(played.services, parameters, interfaces)
    add_rosapi(played, parameters, clock)
    return played


def _use_own_clock(system: InspectedSystem, parameters: Parameters) -> None:
    """Say of all nodes that they do not run by /clock, which is not there."""
    if system.dialect is Dialect.ROS1:
        parameters.put("/use_sim_time", value=False)
    else:
        for node in system.parameters:
            parameters.put(f"{node}:use_sim_time", value=False)


def _topics_of(system: InspectedSystem) -> list[Topic]:
    topics = [
        Topic(
            name=name,
            type=system.type_of(name),
            is_latched=any(each.topic == name and each.rate_hz is None for each in system.streams),
            publishers=system.publishers_of(name),
            subscribers=system.hearers_of(name),
        )
        for name in system.topics
    ]
    if system.dialect is Dialect.ROS1:
        # The node of that name, which keeps the log, runs beside every master.
        nodes = system.nodes
        topics.append(Topic(name=ROSOUT, type=LOG, publishers=nodes, subscribers=(ROSOUT,)))
    return topics


def _offer(offered: OfferedService, interfaces: Interfaces) -> Service:
    async def answer(_request: dict[str, Any]) -> dict[str, Any]:
        return interfaces.fill(f"{offered.type}_Response", {})

    request = f"{offered.type}_Request"
    return Service(
        name=offered.service,
        type=offered.type,
        node=offered.node,
        answer=interfaces.filled(request, answer),
    )


async def _keep_publishing(
    played: RosSystem, stream: Stream, rate_hz: float, clock: Callable[[], float]
) -> None:
    """Publish in step with the clock: what a busy machine has held up comes all the same."""
    due_s = anyio.current_time()
    while True:
        await anyio.sleep_until(due_s)
        due_s += 1.0 / rate_hz
        if played.hub.is_wanted(stream.topic):
            _publish(played, stream, clock())


def _publish(played: RosSystem, stream: Stream, now_s: float) -> None:
    message = stream.content.write(now_s - stream.lag_s, played.dialect)
    played.hub.publish(stream.topic, played.interfaces.fill(stream.type, message))


def with_dead_stream(system: InspectedSystem, topic: str) -> InspectedSystem:
    """Let a topic fall silent; its node still says that it publishes it."""
    return _with_streams(
        system, lambda each: replace(each, rate_hz=0.0) if each.topic == topic else each
    )


def with_late_stream(system: InspectedSystem, topic: str, lag_s: float) -> InspectedSystem:
    """Set back the clock by which a topic's messages are stamped, by some seconds."""
    return _with_streams(
        system, lambda each: replace(each, lag_s=lag_s) if each.topic == topic else each
    )


def with_late_transform(system: InspectedSystem, child: str, lag_s: float) -> InspectedSystem:
    """Set back the stamps of the transform to a frame, by some seconds."""
    return _with_streams(
        system, lambda each: replace(each, lag_s=lag_s) if _tells_of(each, child) else each
    )


def with_cut_transform(system: InspectedSystem, child: str) -> InspectedSystem:
    """End the transform to a frame, and leave those that are told together with it."""
    return _with_streams(system, lambda each: _cut(each, child) if _tells_of(each, child) else each)


def with_second_publisher(system: InspectedSystem, topic: str, node: str) -> InspectedSystem:
    """Let one more node publish what a topic carries."""
    second = replace(system.stream_on(topic), node=node)
    return replace(system, streams=(*system.streams, second))


def with_lost_hearer(
    system: InspectedSystem, node: str, topic: str, instead: str
) -> InspectedSystem:
    """Let a node listen to another topic instead of the right one, which nobody publishes."""
    hearings = tuple(
        replace(each, topic=instead) if (each.node, each.topic) == (node, topic) else each
        for each in system.hearings
    )
    return replace(system, hearings=hearings)


def with_parameter(system: InspectedSystem, node: str, name: str, value: float) -> InspectedSystem:
    """Set a node's parameter to another value."""
    changed = {**system.parameters[node], name: value}
    return replace(system, parameters={**system.parameters, node: changed})


def without_hearers(system: InspectedSystem, topic: str) -> InspectedSystem:
    """Take away all who hear a topic."""
    return replace(system, hearings=tuple(each for each in system.hearings if each.topic != topic))


def without_node(system: InspectedSystem, node: str) -> InspectedSystem:
    """Take away a node with all that it does."""
    return replace(
        system,
        streams=tuple(each for each in system.streams if each.node != node),
        hearings=tuple(each for each in system.hearings if each.node != node),
        services=tuple(each for each in system.services if each.node != node),
        parameters={name: each for name, each in system.parameters.items() if name != node},
    )


def _with_streams(system: InspectedSystem, change: Callable[[Stream], Stream]) -> InspectedSystem:
    return replace(system, streams=tuple(change(each) for each in system.streams))


def _tells_of(stream: Stream, child: str) -> bool:
    content = stream.content
    return isinstance(content, Transforms) and any(each.child == child for each in content.all)


def _cut(stream: Stream, child: str) -> Stream:
    told = stream.content.all if isinstance(stream.content, Transforms) else ()
    left = tuple(each for each in told if each.child != child)
    return replace(stream, content=Transforms(left)) if left else replace(stream, rate_hz=0.0)
