"""Faults: each gives the same system with one thing out of order."""

from collections.abc import Callable
from dataclasses import replace

from mapspeak.evaluation.inspected.contents import Transforms
from mapspeak.evaluation.inspected.system import InspectedSystem, Stream

__all__ = [
    "with_cut_transform",
    "with_dead_stream",
    "with_late_stream",
    "with_late_transform",
    "with_lost_hearer",
    "with_parameter",
    "with_second_publisher",
    "without_hearers",
    "without_node",
]


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
