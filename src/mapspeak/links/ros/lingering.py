"""Subscriptions to bulky topics that last only while somebody looks, and a little longer."""

from collections.abc import Callable, Generator
from contextlib import contextmanager

import anyio

from mapspeak.ros import RosConnection, Subscription

LINGER_S = 10.0
"""After the last look; one who looks around asks again before that."""
THROTTLE_MS = 100


class Lingering:
    """Subscribes when somebody looks, and unsubscribes when nobody has for a while.

    Args:
        connection: Connected to the robot.
        subscribe: Begins what is needed for a look; it may raise.

    Attributes:
        subscriptions: What it gave; empty while nobody looks.
    """

    def __init__(
        self, connection: RosConnection, subscribe: Callable[[], tuple[Subscription, ...]]
    ) -> None:
        self.subscriptions: tuple[Subscription, ...] = ()
        self._connection = connection
        self._subscribe = subscribe
        self._n_looking = 0
        self._looked_s = 0.0
        self._is_open = anyio.Event()

    @contextmanager
    def look(self) -> Generator[tuple[Subscription, ...]]:
        """Keeps the subscriptions while somebody looks, and gives them."""
        self._n_looking += 1
        try:
            if not self.subscriptions:
                self._looked_s = anyio.current_time()
                self.subscriptions = self._subscribe()
                self._is_open.set()
            yield self.subscriptions
        finally:
            self._n_looking -= 1
            self._looked_s = anyio.current_time()

    async def close_when_idle(self) -> None:
        """Ends the subscriptions whenever nobody has looked for a while; runs until cancelled."""
        while True:
            await self._is_open.wait()
            await anyio.sleep_until(self._looked_s + LINGER_S)
            if self._n_looking == 0 and anyio.current_time() >= self._looked_s + LINGER_S:
                self._close()

    def _close(self) -> None:
        for subscription in self.subscriptions:
            self._connection.unsubscribe(subscription)
        self.subscriptions = ()
        self._is_open = anyio.Event()
