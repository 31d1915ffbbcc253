"""Topics as we hear them: the latest message wins; bulky ones only while somebody looks."""

from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros import Listener, RosConnection, Subscription
from mapspeak.ros.messages import Message


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
        """Return the type that a topic was advertised with; None for one that was not."""
        return self._types.get(topic)

    def advertise(self, topic: str, type_name: str) -> None:
        """Note a topic, and tell the robot of it where that is to be early."""
        if self._is_early or topic in self._told:
            # Told again, also where it is known: the robot may have been started anew.
            self._tell(topic, type_name)
            self._told.add(topic)
        self._types[topic] = type_name

    def unadvertise(self, topic: str) -> None:
        """Forget a topic."""
        if self._types.pop(topic, None) is not None and topic in self._told:
            self._told.discard(topic)
            self._take_back(topic)

    def be_late(self) -> None:
        """Tell the robot of topics that follow with the first message on each."""
        self._is_early = False

    def be_early(self) -> None:
        """Tell the robot of all topics that were noted, and at once of those that follow."""
        self._is_early = True
        for topic in self._types:
            self.use(topic)

    def use(self, topic: str) -> bool:
        """Tell the robot of a topic before a message; True when it hears of it only now."""
        type_name = self._types.get(topic)
        if type_name is None or topic in self._told:
            return False
        self._tell(topic, type_name)
        self._told.add(topic)
        return True


async def say_again(say: Callable[[], object]) -> None:
    """Say what must not be missed for another second: the robot may not listen at once."""
    for _ in range(N_AGAIN):
        await anyio.sleep(PAUSE_S)
        say()


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
        """Keep the subscriptions while somebody looks, and return them."""
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
        """End the subscriptions whenever nobody has looked for a while; run until cancelled."""
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


class TopicSubscription:
    """The latest message of one topic. Many may wait for the next one at once.

    Attributes:
        topic: Its full name.
        type_name: As asked for; None left it to the robot.
        latest: The newest message; None as long as none has come.
        n_received: Since the subscription began, over all connections.
        begun_s: Since when we have listened, by the event loop's clock.
        arrived_s: When the newest came, by the event loop's clock.
        n_users: How many have subscribed and not unsubscribed.
    """

    def __init__(self, topic: str, *, type_name: str | None) -> None:
        self.topic = topic
        self.type_name = type_name
        self.latest: Message | None = None
        self.n_received = 0
        self.begun_s = anyio.current_time()
        self.arrived_s = float("-inf")
        self.n_users = 0
        self._listeners: list[Listener] = []
        self._news = anyio.Event()

    def listen(self, listener: Listener) -> None:
        """Call a function with every message that comes from now on; it must not raise."""
        self._listeners.append(listener)

    def take(self, message: Message) -> None:
        """Make a message the latest."""
        self.latest = message
        self.n_received += 1
        self.arrived_s = anyio.current_time()
        for listener in self._listeners:
            listener(message)
        news, self._news = self._news, anyio.Event()
        news.set()

    async def wait_for_more_than(self, n_received: int, *, timeout_s: float) -> Message:
        """Return the latest message once more than so many have come.

        Args:
            n_received: How many are too few; 0 takes one that is there already.
            timeout_s: In wall time. The subscription goes on when it has passed.

        Raises:
            LinkError: None came in time.
        """
        with anyio.move_on_after(timeout_s):
            while self.n_received <= n_received:
                await self._news.wait()
        if self.n_received <= n_received or self.latest is None:
            raise LinkError(
                f"No message came on {self.topic} within {timeout_s:g} s.",
                hint=f"Check that somebody publishes it: `ros2 topic hz {self.topic}` "
                f"(ROS 1: `rostopic hz {self.topic}`). We stay subscribed: asking again may help.",
            )
        return self.latest
