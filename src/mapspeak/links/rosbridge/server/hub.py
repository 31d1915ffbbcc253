"""The topics of the robot and of its clients, and who hears them."""

from collections.abc import Callable
from dataclasses import dataclass, field

from mapspeak.links.rosbridge.server.publication import Publication
from mapspeak.ros.messages import Message, bare_type

Listener = Callable[[Publication], None]
ROSBRIDGE_NODE = "/rosbridge_websocket"


@dataclass(slots=True, kw_only=True)
class Topic:
    """One topic.

    Attributes:
        name: With its leading slash.
        type: Of its messages, as "package/Type".
        is_latched: Who subscribes later gets the last message at once.
        depth: How many messages wait for a client that is slow; the newest stay.
        publishers: Nodes that publish it.
        subscribers: Nodes that hear it.
    """

    name: str
    type: str
    is_latched: bool = False
    depth: int = 50
    publishers: tuple[str, ...] = ()
    subscribers: tuple[str, ...] = ()
    last: Publication | None = None
    n_advertisers: int = 0
    listeners: list[Listener] = field(default_factory=list)
    takers: list[Listener] = field(default_factory=list)


class Hub:
    """All topics there are; listeners are clients, takers are the robot's own nodes."""

    def __init__(self, topics: list[Topic]) -> None:
        self._topics = {topic.name: topic for topic in topics}
        self._own = frozenset(self._topics)

    @property
    def topics(self) -> list[Topic]:
        """The topics that somebody publishes or hears, by name."""
        return sorted(self._topics.values(), key=lambda topic: topic.name)

    def find(self, name: str) -> Topic | None:
        """Finds a topic."""
        return self._topics.get(name)

    def is_wanted(self, name: str) -> bool:
        """True when a client listens."""
        return name in self._topics and bool(self._topics[name].listeners)

    def publish(self, name: str, message: Message) -> None:
        """Hands a message to all who hear the topic."""
        topic = self._topics[name]
        publication = Publication(name, topic.type, message)
        if topic.is_latched:
            topic.last = publication
        for hear in [*topic.takers, *topic.listeners]:
            hear(publication)

    def take(self, name: str, taker: Listener) -> None:
        """Lets one of the robot's own nodes hear a topic."""
        self._topics[name].takers.append(taker)

    def subscribe(self, name: str, message_type: str, listener: Listener) -> None:
        """Lets a client hear a topic, and gives it the last message of a latched one."""
        topic = self._topics.setdefault(name, Topic(name=name, type=bare_type(message_type)))
        if listener not in topic.listeners:
            topic.listeners.append(listener)
        if topic.last is not None:
            listener(topic.last)

    def unsubscribe(self, name: str, listener: Listener) -> None:
        """Ends a client's hearing."""
        topic = self._topics.get(name)
        if topic is not None and listener in topic.listeners:
            topic.listeners.remove(listener)
            self._forget_unused(topic)

    def advertise(self, name: str, message_type: str, *, is_latched: bool) -> None:
        """Notes that a client publishes a topic."""
        topic = self._topics.setdefault(name, Topic(name=name, type=bare_type(message_type)))
        topic.n_advertisers += 1
        topic.is_latched = topic.is_latched or (is_latched and name not in self._own)

    def unadvertise(self, name: str) -> None:
        """Notes that a client publishes a topic no more."""
        topic = self._topics.get(name)
        if topic is not None:
            topic.n_advertisers -= 1
            self._forget_unused(topic)

    def publishers_of(self, topic: Topic) -> list[str]:
        """Gives the nodes that publish a topic; clients do so through rosbridge."""
        return [*topic.publishers, *([ROSBRIDGE_NODE] if topic.n_advertisers else [])]

    def subscribers_of(self, topic: Topic) -> list[str]:
        """Gives the nodes that hear a topic."""
        return [*topic.subscribers, *([ROSBRIDGE_NODE] if topic.listeners else [])]

    def _forget_unused(self, topic: Topic) -> None:
        is_used = topic.name in self._own or topic.listeners or topic.n_advertisers > 0
        if not is_used:
            del self._topics[topic.name]
