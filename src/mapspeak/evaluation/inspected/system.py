"""A ROS system as a description: who publishes what how often, who hears it, who serves what."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mapspeak.evaluation.inspected.contents import Content
from mapspeak.ros.messages import Dialect

__all__ = ["Hearing", "InspectedSystem", "OfferedService", "Stream"]


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
