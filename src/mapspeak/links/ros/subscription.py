"""A topic as we last heard it: the latest message wins, and a slow reader holds up nobody."""

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros import Listener
from mapspeak.ros.messages import Message


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
        """Calls a function with every message that comes from now on; it must not raise."""
        self._listeners.append(listener)

    def take(self, message: Message) -> None:
        """Makes a message the latest."""
        self.latest = message
        self.n_received += 1
        self.arrived_s = anyio.current_time()
        for listener in self._listeners:
            listener(message)
        news, self._news = self._news, anyio.Event()
        news.set()

    async def wait_for_more_than(self, n_received: int, *, timeout_s: float) -> Message:
        """Gives the latest message once more than so many have come.

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
