"""A ROS system as a description, with something out of order, and on the wire, as a rosbridge."""

from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import anyio

from mapspeak.ros.messages.fields import Dialect, Message, write_header
from mapspeak.ros.messages.poses import FrameTransform, write_transforms
from mapspeak.rosbridge_server import (
    Hub,
    Interfaces,
    Parameters,
    RosSystem,
    Topic,
    add_parameter_services,
    add_rosapi,
    serve_system,
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stream:
    """A publisher of one node on one topic; types are written as "package/Type".

    Attributes:
        values: The fields of each message that differ from their defaults.
        frame_id: Of the header with each stamp; None for a message without a header.
        transforms: Content of tf messages, in place of `values`; each has its own stamp.
        rate_hz: Messages per second of the wall clock; 0 for a dead stream, None for one latched
            message.
        lag_s: Lag of its stamps behind the robot's clock.
    """

    node: str
    topic: str
    type: str
    values: Message = field(default_factory=dict)
    frame_id: str | None = None
    transforms: tuple[FrameTransform, ...] = ()
    rate_hz: float | None
    lag_s: float = 0.0

    def message(self, stamp_s: float, dialect: Dialect) -> Message:
        """Return the message of a time by the robot's clock."""
        if self.transforms:
            stamped = [replace(each, stamp_s=stamp_s) for each in self.transforms]
            return write_transforms(stamped, dialect=dialect)
        if self.frame_id is None:
            return self.values
        return {"header": write_header(self.frame_id, stamp_s, dialect=dialect), **self.values}


@dataclass(frozen=True, slots=True, kw_only=True)
class OfferedService:
    """One service of a node; its answer is always empty.

    Attributes:
        deed: What it is for, in a question's words.
    """

    node: str
    service: str
    type: str
    deed: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class InspectedSystem:
    """The whole ROS graph of the robot.

    Attributes:
        started_s: The robot's clock at the beginning.
        subscriptions: The topics that each node subscribes to, with the types that it expects.
        services: Offered services, besides those of every ROS.
        parameters: Values by nodes and their own names; each node is named here.
        types: The definitions of custom types, by "package/Type".
    """

    dialect: Dialect
    started_s: float
    streams: tuple[Stream, ...]
    subscriptions: Mapping[str, Mapping[str, str]]
    services: tuple[OfferedService, ...] = ()
    parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    types: Mapping[str, str] = field(default_factory=dict)

    @property
    def nodes(self) -> tuple[str, ...]:
        """All nodes by name."""
        offering = {each.node for each in self.streams} | {each.node for each in self.services}
        return tuple(sorted(offering | {*self.subscriptions} | {*self.parameters}))

    @property
    def topics(self) -> dict[str, str]:
        """The types of all topics that are published or subscribed to, in the order of names."""
        types: dict[str, str] = {}
        for wanted in self.subscriptions.values():
            types.update(wanted)
        types.update((each.topic, each.type) for each in self.streams)
        return dict(sorted(types.items()))

    def publishers_of(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that publish a topic, by name."""
        return tuple(sorted({each.node for each in self.streams if each.topic == topic}))

    def subscribers_of(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that subscribe to a topic, by name."""
        return tuple(sorted(node for node, wanted in self.subscriptions.items() if topic in wanted))

    def stream_on(self, topic: str) -> Stream:
        """Return the stream on a topic that has one."""
        return next(each for each in self.streams if each.topic == topic)

    def stream_to(self, child: str) -> Stream:
        """Return the stream that carries the transform to a frame."""
        return next(
            stream
            for stream in self.streams
            if any(each.child == child for each in stream.transforms)
        )

    def with_stream(self, stream: Stream, **changes: Any) -> "InspectedSystem":  # noqa: ANN401 - fields of Stream
        """Return the system with one of its streams changed."""
        changed = (replace(each, **changes) if each is stream else each for each in self.streams)
        return replace(self, streams=tuple(changed))

    def without_node(self, node: str) -> "InspectedSystem":
        """Return the system without a node and all that it does."""
        return replace(
            self,
            streams=tuple(each for each in self.streams if each.node != node),
            subscriptions={each: told for each, told in self.subscriptions.items() if each != node},
            services=tuple(each for each in self.services if each.node != node),
            parameters={each: told for each, told in self.parameters.items() if each != node},
        )


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
        played.offer_typed(
            each.service,
            each.type,
            node=each.node,
            answer=partial(_answer_emptily, interfaces, f"{each.type}_Response"),
        )
    parameters = Parameters(
        system.dialect, {node: dict(values) for node, values in system.parameters.items()}
    )
    # No node runs by /clock, which is not there; ROS 1 says that once for all.
    is_ros2 = system.dialect is Dialect.ROS2
    for prefix in [f"{node}:" for node in system.parameters] if is_ros2 else ["/"]:
        parameters.put(f"{prefix}use_sim_time", value=False)
    if is_ros2:
        add_parameter_services(played, parameters)
    add_rosapi(played, parameters, clock)
    return played


def _topics_of(system: InspectedSystem) -> list[Topic]:
    topics = [
        Topic(
            name=name,
            type=kind,
            is_latched=any(each.topic == name and each.rate_hz is None for each in system.streams),
            publishers=system.publishers_of(name),
            subscribers=system.subscribers_of(name),
        )
        for name, kind in system.topics.items()
    ]
    if system.dialect is Dialect.ROS1:
        # The node of that name, which keeps the log, runs beside every master.
        nodes = system.nodes
        topics.append(Topic(name=ROSOUT, type=LOG, publishers=nodes, subscribers=(ROSOUT,)))
    return topics


def _answer_emptily(
    interfaces: Interfaces, response: str, _request: dict[str, Any]
) -> dict[str, Any]:
    return interfaces.fill(response, {})


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
    message = stream.message(now_s - stream.lag_s, played.dialect)
    played.hub.publish(stream.topic, played.interfaces.fill(stream.type, message))
