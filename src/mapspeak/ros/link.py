"""The common parts of links: limits of waiting, advertised topics, names, errors as raised."""

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import anyio

from mapspeak.errors import LinkError
from mapspeak.robot import SCAN_PATIENCE_S
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """The limits of one connection, in wall time; a test shortens them.

    Between nodes on Fast DDS, a lost message comes again after three seconds: a shorter wait would
    take a lost message for a silent robot.

    Attributes:
        settling_s: After connecting, without anything new, until all that is there is found.
        frames_s: For the robot's frames to lead from the map to its base; static ones come at once,
            moving ones many times a second.
        first_map_s: For the first map, which is asked for anew after each of these waits: a
            subscription made before the robot's side knew the publisher never gets the latched
            map. Empty stands for what is usual over the connection.
        later_map_s: For a map that nobody publishes, or that was waited for in vain before.
        clock_s: Between two questions for the robot's time.
        standstill_s: Without a tick, after which a simulation's clock stands still.
        pose_silence_s: Without anything new of the pose, after which it is too old.
        first_picture_s: For the first picture of a camera that is published and has said nothing
            yet: some give one in ten seconds.
        picture_s: For a later picture; longer for a slow camera.
        scan_s: For a scan.
        acceptance_s: For the first sign that a goal was taken.
        listing_s: For the list of the goals there are, before our own first one.
        end_s: For a goal to end that was cancelled or replaced.
        result_s: For the result of a goal whose end is known already.
        return_s: After a reconnection, for word of a goal that was under way.
        connect_s: For a socket of rosbridge to open.
        answer_s: For a service's answer, where the caller says nothing else.
        attempt_s: For a connection that has been gone for longer than that: one more attempt.
        first_pause_s: Before the first attempt to reconnect; doubled after each failure.
        longest_pause_s: Between two attempts to reconnect.
        ping_s: Between two pings over a socket.
        silence_s: Without a single byte, pongs included, after which a socket counts as dead.
        linger_s: From the last publication to closing, so that the robot still gets it.
        goodbye_s: For the other end to agree to closing.
        retired_s: How long a replaced socket may still answer what it was asked.
    """

    settling_s: float = 5.0
    frames_s: float = 2.0
    first_map_s: tuple[float, ...] = ()
    later_map_s: float = 2.0
    clock_s: float = 60.0
    standstill_s: float = 5.0
    pose_silence_s: float = 10.0
    first_picture_s: float = 15.0
    picture_s: float = 5.0
    scan_s: float = SCAN_PATIENCE_S
    acceptance_s: float = 5.0
    listing_s: float = 0.3
    end_s: float = 4.0
    result_s: float = 1.0
    return_s: float = 5.0
    connect_s: float = 5.0
    answer_s: float = 5.0
    attempt_s: float = 0.5
    first_pause_s: float = 0.1
    longest_pause_s: float = 1.0
    ping_s: float = 5.0
    silence_s: float = 20.0
    linger_s: float = 0.15
    goodbye_s: float = 0.5
    retired_s: float = 30.0


USUAL_PATIENCE = Patience()
