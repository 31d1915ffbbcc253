"""The common parts of links: advertised topics, names, and errors as they were raised."""

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import bare_type

NOTICE_S = 0.3
"""From a topic's first announcement until the robot's nodes listen, in wall time."""
N_AGAIN = 10
PAUSE_S = 0.1


class Advertising(ABC):
    """The part of the port about topics that we publish.

    Late mode does not take back earlier advertisements: rosbridge shows a publisher for ten seconds
    more, so a robot that shall not see us as one must not be told at all.
    """

    def __init__(self) -> None:
        self._noted: dict[str, tuple[str, bool]] = {}
        self._told: set[str] = set()
        self._is_early = True

    def advertise(self, topic: str, *, type_name: str, is_latched: bool = False) -> None:
        """Say that we will publish; the robot needs a moment until it listens.

        A late subscriber of a latched topic ("transient local") gets the last message.
        """
        self._check(topic, type_name)
        if self._is_early or topic in self._told:
            # Told again, also where it is known: the robot may have been started anew.
            self._announce(topic, type_name, is_latched)
            self._told.add(topic)
        self._noted[topic] = type_name, is_latched

    def unadvertise(self, topic: str) -> None:
        """Take back an advertisement; do nothing for a topic that was not advertised."""
        if self._noted.pop(topic, None) is not None and topic in self._told:
            self._told.discard(topic)
            self._take_back(topic)

    def advertise_late(self) -> None:
        """Tell the robot of each topic advertised from now on only with its first message.

        For a robot that is only watched: it should not look as if we drove it. Zero velocity is
        then repeated for a second, until the robot has discovered our publisher.
        """
        self._is_early = False

    def advertise_early(self) -> None:
        """Tell the robot at once of all advertised topics, now and from now on.

        For clients that may move it, so that a stop is received at once. This is the default.
        """
        self._is_early = True
        for topic in self._noted:
            self._tell_first(topic)

    def _tell_first(self, topic: str) -> bool:
        """Tell the robot of a topic before a message; return True if it was not told before."""
        if topic not in self._noted or topic in self._told:
            return False
        self._announce(topic, *self._noted[topic])
        self._told.add(topic)
        return True

    @abstractmethod
    def _check(self, topic: str, type_name: str | None) -> None:
        """Raise `LinkError` where a name or a type is invalid, or the two contradict each other."""

    @abstractmethod
    def _announce(self, topic: str, type_name: str, is_latched: bool) -> None:  # noqa: FBT001
        """Tell the robot that we will publish."""

    @abstractmethod
    def _take_back(self, topic: str) -> None:
        """Tell the robot that we will not publish any more."""


async def say_again(say: Callable[[], object]) -> None:
    """Repeat an important message for another second: the robot may not listen at once."""
    for _ in range(N_AGAIN):
        await anyio.sleep(PAUSE_S)
        with suppress(LinkError):
            say()


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
