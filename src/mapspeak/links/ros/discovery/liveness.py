"""Who is at the other end of a topic: names stay in the graph when nobody serves them any more."""

from collections.abc import Awaitable, Callable

from mapspeak.errors import LinkError
from mapspeak.ros import RosConnection


class Liveness:
    """Asks for the other end of topics, of each once.

    Args:
        connection: To the robot.

    Attributes:
        dead: Topics without one. A topic of which the robot does not tell is not among them.
    """

    def __init__(self, connection: RosConnection) -> None:
        self._connection = connection
        self._asked: set[str] = set()
        self.dead: frozenset[str] = frozenset()

    async def ask(self, topic: str, *, is_heard: bool) -> None:
        """Find out whether others publish a topic, or listen to it.

        Args:
            topic: Its full name.
            is_heard: It is one that we publish, so that others are to listen.
        """
        if topic in self._asked:
            return
        self._asked.add(topic)
        connection, own = self._connection, self._connection.own_ends
        fetch = connection.fetch_subscribers if is_heard else connection.fetch_publishers
        # For us and other clients rosbridge listens to all sorts of topics, and serves none.
        is_own = own.node and (is_heard or topic in own.publishes)
        found = await _ask(fetch, topic)
        if found is None:
            return
        if not [node for node in found if not (is_own and node.endswith(f"/{own.node}"))]:
            self.dead |= {topic}


async def _ask(
    fetch: Callable[[str], Awaitable[tuple[str, ...]]], topic: str
) -> tuple[str, ...] | None:
    try:
        return await fetch(topic)
    except LinkError:
        return None
