"""Variables of the environment, for libraries that take their settings nowhere else."""

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Coroutine, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

from mapspeak.errors import LinkError
from mapspeak.ros import NAME, ActionGoal, OwnEnds, Started, Subscription
from mapspeak.ros.messages import Message, bare_type
from mapspeak.ros.subscribing import Announcements, TopicSubscription, say_again


@contextmanager
def environment_with(variables: Mapping[str, str]) -> Iterator[None]:
    """Let some variables have these values while the context lasts."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


class TopicRequest(Protocol):
    """How a topic was asked for."""

    @property
    def subscription(self) -> TopicSubscription:
        """What everybody who asked for it shares."""
        ...


Request = TypeVar("Request", bound=TopicRequest)


class NativeTopics(ABC, Generic[Request]):
    """Keeps what was asked for; how a topic is read and written is each network's own matter."""

    def __init__(self) -> None:
        self.requests: dict[str, Request] = {}
        self.announcements = Announcements(self._announce, self.unadvertise)

    def _announce(self, topic: str, type_name: str) -> None:
        self.advertise(topic, type_name=type_name)

    def subscribe(
        self, topic: str, *, type_name: str | None, is_bulky: bool, throttle_ms: int
    ) -> TopicSubscription:
        """Return the subscription to a topic; the first subscriber decides how often it is heard.

        Raises:
            LinkError: The name or the type is none, or the topic has another type.
        """
        request = self.requests.get(topic)
        if request is None:
            self.check(topic, type_name)
            subscription = TopicSubscription(topic, type_name=type_name)
            request = self.request(subscription, is_bulky=is_bulky, throttle_s=throttle_ms / 1e3)
            self.arrange(request)
            self.requests[topic] = request
        request.subscription.n_users += 1
        return request.subscription

    def unsubscribe(self, topic: str, subscription: object) -> None:
        """End one use of a subscription, and with the last one the reading."""
        request = self.requests.get(topic)
        if request is None or request.subscription is not subscription:
            return
        request.subscription.n_users -= 1
        if request.subscription.n_users == 0:
            del self.requests[topic]
            self.end(request)

    def renew(self, topic: str) -> None:
        """Read a topic anew: latched messages come again."""
        request = self.requests.get(topic)
        if request is not None:
            self.end(request)
            self.arrange(request)

    @abstractmethod
    def check(self, topic: str, type_name: str | None) -> None:
        """Raise `LinkError` where a name or a type is none, or do not go with the other."""

    @abstractmethod
    def request(
        self, subscription: TopicSubscription, *, is_bulky: bool, throttle_s: float
    ) -> Request:
        """Return a request that nothing has been done for yet."""

    @abstractmethod
    def arrange(self, request: Request) -> None:
        """Read a topic in the best quality that all of its writers offer."""

    @abstractmethod
    def end(self, request: Request) -> None:
        """Read a topic no longer."""

    @abstractmethod
    def advertise(self, topic: str, *, type_name: str) -> None:
        """Say that we will publish."""

    @abstractmethod
    def unadvertise(self, topic: str) -> None:
        """Take back what `advertise` said."""

    @abstractmethod
    async def publish(self, topic: str, message: Message) -> None:
        """Publish, once those who are known to listen are connected."""

    @abstractmethod
    def publish_at_once(self, topic: str, message: Message) -> None:
        """Publish to those who are connected already."""


class NativeConnection(ABC):
    """The part of the port that is about topics, and what needs no network at all.

    Attributes:
        started: Everything that was started over this connection.
    """

    def __init__(self) -> None:
        self.started = Started()

    @property
    def lost_for_s(self) -> float | None:
        """None: in the robot's own network nothing stands between us and its nodes."""
        return None

    @property
    @abstractmethod
    def topics(self) -> NativeTopics[Any]:
        """What is read and written."""

    def subscribe(
        self,
        topic: str,
        *,
        type_name: str | None = None,
        is_bulky: bool = False,
        throttle_ms: int = 0,
    ) -> TopicSubscription:
        """Return the subscription to a topic; it is read as soon as somebody writes it."""
        return self.topics.subscribe(
            topic, type_name=type_name, is_bulky=is_bulky, throttle_ms=throttle_ms
        )

    def unsubscribe(self, subscription: Subscription) -> None:
        """End one use of a subscription; the last one ends the reading too."""
        self.topics.unsubscribe(subscription.topic, subscription)

    def renew(self, subscription: Subscription) -> None:
        """Read a topic anew: latched messages come again."""
        self.topics.renew(subscription.topic)

    @property
    def own_ends(self) -> OwnEnds:
        """Nothing: what such a connection tells of the system leaves our own node out."""
        return OwnEnds()

    @abstractmethod
    def start_soon(self, work: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Run something in the background until the connection is closed."""

    def advertise(self, topic: str, *, type_name: str) -> None:
        """Say that we will publish."""
        self.topics.check(topic, type_name)
        self.topics.announcements.advertise(topic, type_name)

    def unadvertise(self, topic: str) -> None:
        """Take back what `advertise` said."""
        self.topics.announcements.unadvertise(topic)

    def advertise_late(self) -> None:
        """Tell the robot of what is advertised from now on only with the first message there."""
        self.topics.announcements.be_late()

    def advertise_early(self) -> None:
        """Tell the robot at once of all that is advertised, now and from now on."""
        self.topics.announcements.be_early()

    async def publish(self, topic: str, message: Message) -> None:
        """Publish on an advertised topic, once known listeners are connected to it."""
        self.topics.announcements.use(topic)
        await self.topics.publish(topic, message)

    def publish_everywhere(self, topic: str, message: Message) -> int:
        """Publish at once, for a stop; there is one way, so it gives 1."""
        say = partial(self.topics.publish_at_once, topic, message)
        if self.topics.announcements.use(topic):
            self.start_soon(partial(say_again, say))
        say()
        return 1

    def clear_the_way(self) -> None:  # noqa: B027 - nothing is to be done, by anybody
        """Do nothing: in ROS 2 itself, nothing is held up by what was sent before."""

    def give_up_goal(self, goal: ActionGoal) -> None:  # noqa: B027 - as above
        """Do nothing: in ROS 2 itself, a goal holds up nothing."""


def check_name(name: str) -> None:
    """Do nothing for the full name of a topic, a service or an action.

    Raises:
        LinkError: It is none.
    """
    if not (name.startswith("/") and NAME.fullmatch(name)):
        raise LinkError(f"{name[:80]!r} is no full name in ROS.", hint="Such as /robot/map.")


def wrong_type(name: str, found: str, given: str) -> LinkError:
    """Return the error for a topic, service or action that is of another type than given."""
    return LinkError(
        f"{name} is a {bare_type(found)}, not a {bare_type(given)}.",
        hint="Use the type that the robot uses.",
    )
