"""Topics that we would publish: a robot that is only watched does not hear of them."""

from collections.abc import Callable

import anyio

NOTICE_S = 0.3
"""From a topic's first announcement until the robot's nodes listen, in wall time."""
N_AGAIN = 10
PAUSE_S = 0.1


class Announcements:
    """What we have said, or would say, that we publish.

    What was told is never taken back for being late: rosbridge shows a publisher for ten seconds
    more, so that a robot that is not to hear of it must not be told in the first place.

    Args:
        tell: Tells the robot of a topic and its type.
        take_back: Takes that back.
    """

    def __init__(self, tell: Callable[[str, str], None], take_back: Callable[[str], None]) -> None:
        self._tell = tell
        self._take_back = take_back
        self._types: dict[str, str] = {}
        self._told: set[str] = set()
        self._is_early = True

    @property
    def told(self) -> frozenset[str]:
        """The topics that the robot knows us to publish."""
        return frozenset(self._told)

    def type_of(self, topic: str) -> str | None:
        """Gives the type that a topic was advertised with; None for one that was not."""
        return self._types.get(topic)

    def advertise(self, topic: str, type_name: str) -> None:
        """Notes a topic, and tells the robot of it where that is to be early."""
        if self._is_early or topic in self._told:
            # Told again, also where it is known: the robot may have been started anew.
            self._tell(topic, type_name)
            self._told.add(topic)
        self._types[topic] = type_name

    def unadvertise(self, topic: str) -> None:
        """Forgets a topic."""
        if self._types.pop(topic, None) is not None and topic in self._told:
            self._told.discard(topic)
            self._take_back(topic)

    def be_late(self) -> None:
        """Tells the robot of topics that follow with the first message on each."""
        self._is_early = False

    def be_early(self) -> None:
        """Tells the robot of all topics that were noted, and at once of those that follow."""
        self._is_early = True
        for topic in self._types:
            self.use(topic)

    def use(self, topic: str) -> bool:
        """Tells the robot of a topic before a message; True when it hears of it only now."""
        type_name = self._types.get(topic)
        if type_name is None or topic in self._told:
            return False
        self._tell(topic, type_name)
        self._told.add(topic)
        return True


async def say_again(say: Callable[[], object]) -> None:
    """Says what must not be missed for another second: the robot may not listen at once."""
    for _ in range(N_AGAIN):
        await anyio.sleep(PAUSE_S)
        say()
