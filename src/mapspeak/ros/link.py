"""The common part of all connections: callers share the subscription to a topic."""

import os
from abc import abstractmethod
from collections.abc import Callable, Coroutine, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, TypeVar

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.activity import Started, Subscription
from mapspeak.ros.messages.fields import NAME, Message, bare_type
from mapspeak.ros.parameters import ParameterServices
from mapspeak.ros.patience import Patience

NOTICE_S = 0.3
"""From a topic's first announcement until the robot's nodes listen, in wall time."""
N_AGAIN = 10
PAUSE_S = 0.1


class Announcements:
    """The topics that we have advertised, or would advertise.

    Late mode does not take back earlier advertisements: rosbridge shows a publisher for ten seconds
    more, so a robot that shall not see us as one must not be told at all.
    """

    def __init__(
        self, tell: Callable[[str, str, bool], None], take_back: Callable[[str], None]
    ) -> None:
        self._tell = tell
        self._take_back = take_back
        self._noted: dict[str, tuple[str, bool]] = {}
        self._told: set[str] = set()
        self._is_early = True

    @property
    def told(self) -> frozenset[str]:
        """The topics that the robot knows us to publish."""
        return frozenset(self._told)

    def type_of(self, topic: str) -> str | None:
        """Return the type that a topic was advertised with; None for one that was not."""
        return self._noted[topic][0] if topic in self._noted else None

    def advertise(self, topic: str, type_name: str, *, is_latched: bool = False) -> None:
        """Note a topic, and tell the robot of it where that is to be early."""
        if self._is_early or topic in self._told:
            # Told again, also where it is known: the robot may have been started anew.
            self._tell(topic, type_name, is_latched)
            self._told.add(topic)
        self._noted[topic] = type_name, is_latched

    def unadvertise(self, topic: str) -> None:
        """Forget a topic."""
        if self._noted.pop(topic, None) is not None and topic in self._told:
            self._told.discard(topic)
            self._take_back(topic)

    def be_late(self) -> None:
        """Tell the robot of topics that follow with the first message on each."""
        self._is_early = False

    def be_early(self) -> None:
        """Tell the robot of all topics that were noted, and at once of those that follow."""
        self._is_early = True
        for topic in self._noted:
            self.use(topic)

    def use(self, topic: str) -> bool:
        """Tell the robot of a topic before a message; return True if it was not told before."""
        if topic not in self._noted or topic in self._told:
            return False
        self._tell(topic, *self._noted[topic])
        self._told.add(topic)
        return True


async def say_again(say: Callable[[], object]) -> None:
    """Repeat an important message for another second: the robot may not listen at once."""
    for _ in range(N_AGAIN):
        await anyio.sleep(PAUSE_S)
        with suppress(LinkError):
            say()


@dataclass(slots=True, eq=False)
class TopicRequest:
    """The request for a topic; each link adds its reader."""

    subscription: Subscription
    throttle_ms: int
    n_renewals: int = 0


Request = TypeVar("Request", bound=TopicRequest)


class RosLink(ParameterServices, Generic[Request]):
    """The common part of the port over every connection; it raises the errors of the port."""

    def __init__(self, request_type: type[Request], patience: Patience) -> None:
        self.patience = patience
        self._request_type = request_type
        self.started = Started()
        self.requests: dict[str, Request] = {}
        self.announcements = Announcements(self._announce, self._take_back)

    def subscribe(
        self, topic: str, *, type_name: str | None = None, throttle_ms: int = 0
    ) -> Subscription:
        """Return the subscription to a topic; its first request sets the throttling."""
        request = self.requests.get(topic)
        if request is None:
            self._check(topic, type_name)
            subscription = Subscription(topic, type_name=type_name)
            request = self._request_type(subscription, throttle_ms)
            self._begin(request)
            self.requests[topic] = request
        request.subscription.n_users += 1
        return request.subscription

    def unsubscribe(self, subscription: Subscription) -> None:
        """End one use of a subscription; the last one ends the reading too."""
        request = self.requests.get(subscription.topic)
        if request is None or request.subscription is not subscription:
            return
        subscription.n_users -= 1
        if subscription.n_users == 0:
            del self.requests[subscription.topic]
            self._end(request)

    def renew(self, subscription: Subscription) -> None:
        """Subscribe again: a latched message may have been missed, or cannot be written so."""
        request = self.requests.get(subscription.topic)
        if request is not None:
            self._end(request)
            request.n_renewals += 1
            self._begin(request)

    def advertise(self, topic: str, *, type_name: str, is_latched: bool = False) -> None:
        """Say that we will publish."""
        self._check(topic, type_name)
        self.announcements.advertise(topic, type_name, is_latched=is_latched)

    def unadvertise(self, topic: str) -> None:
        """Take back an advertisement."""
        self.announcements.unadvertise(topic)

    def advertise_late(self) -> None:
        """Tell the robot of each topic advertised from now on only with its first message."""
        self.announcements.be_late()

    def advertise_early(self) -> None:
        """Tell the robot at once of all that is advertised, now and from now on."""
        self.announcements.be_early()

    def publish_everywhere(self, topic: str, message: Message) -> int:
        """Publish at once by every way that is open, and return how many: for a stop."""
        is_first = self.announcements.use(topic)
        send = self._prepare(topic, message)
        if is_first:
            self.start_soon(partial(say_again, send))
        return send()

    @abstractmethod
    def start_soon(self, work: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Run something in the background until the connection is closed."""

    def _check(self, topic: str, type_name: str | None) -> None:
        """Raise `LinkError` where a name or a type is invalid, or the two contradict each other."""

    @abstractmethod
    def _begin(self, request: Request) -> None:
        """Read a topic, or see to it that it is read once that can be done."""

    @abstractmethod
    def _end(self, request: Request) -> None:
        """Read a topic no longer."""

    @abstractmethod
    def _announce(self, topic: str, type_name: str, is_latched: bool) -> None:  # noqa: FBT001
        """Tell the robot that we will publish."""

    @abstractmethod
    def _take_back(self, topic: str) -> None:
        """Tell the robot that we will not publish any more."""

    @abstractmethod
    def _prepare(self, topic: str, message: Message) -> Callable[[], int]:
        """Return a function that publishes over each open connection and returns their number."""


def check_name(name: str) -> None:
    """Do nothing for the full name of a topic, a service or an action."""
    if not (name.startswith("/") and NAME.fullmatch(name)):
        raise LinkError(f"{name[:80]!r} is no full name in ROS.", hint="Such as /robot/map.")


def wrong_type(name: str, found: str, given: str) -> LinkError:
    """Return the error for a topic, service or action that is of another type than given."""
    return LinkError(
        f"{name} is a {bare_type(found)}, not a {bare_type(given)}.",
        hint="Use the type that the robot uses.",
    )


@contextmanager
def plain_errors() -> Iterator[None]:
    """Let an error pass as it was raised, out of the group that a task group makes of it."""
    try:
        yield
    except BaseExceptionGroup as group:
        error: BaseException = group
        while isinstance(error, BaseExceptionGroup) and len(error.exceptions) == 1:
            error = error.exceptions[0]
        raise error from error.__cause__


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
