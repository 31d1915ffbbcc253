"""Listening to the robot's coordinate frames."""

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.ros.transforms import TransformTree
from mapspeak.ros import RosConnection, Subscription
from mapspeak.ros.messages import Dialect, Message, read_transforms


class FrameListener:
    """Keeps a tree of frames up to date from /tf and /tf_static.

    Neither is throttled: that would drop whole transforms, not repetitions of one.

    Args:
        connection: Connected to the robot.
    """

    def __init__(self, connection: RosConnection) -> None:
        self.tree = TransformTree()
        self.arrived_s: float | None = None
        """When something new was told of one that moves, by the event loop's clock; None before."""
        self.n_refused = 0
        """Messages that were no transforms."""
        self._connection = connection
        self._subscriptions: dict[str, Subscription] = {}
        self._news = anyio.Event()

    def listen(self, moving_topic: str, static_topic: str, *, dialect: Dialect) -> None:
        """Subscribe to both topics, also before anybody publishes them, and to no others."""
        wanted = {moving_topic: self._take_moving, static_topic: self._take_static}
        for topic in self._subscriptions.keys() - wanted.keys():
            self._connection.unsubscribe(self._subscriptions.pop(topic))
        type_name = dialect.type_name("tf2_msgs/TFMessage")
        for topic, take in wanted.items():
            if topic not in self._subscriptions:
                subscription = self._connection.subscribe(topic, type_name=type_name)
                subscription.listen(take)
                self._subscriptions[topic] = subscription

    def has_way(self, *, outer: str, inner: str) -> bool:
        """True when the tree leads from one frame to the other."""
        try:
            self.tree.find(outer=outer, inner=inner)
        except LinkError:
            return False
        return True

    async def wait_for_news(self) -> None:
        """Returns after the next message."""
        await self._news.wait()

    def _take_moving(self, message: Message) -> None:
        self._take(message, is_static=False)

    def _take_static(self, message: Message) -> None:
        self._take(message, is_static=True)

    def _take(self, message: Message, *, is_static: bool) -> None:
        try:
            transforms = read_transforms(message)
        except LinkError:
            self.n_refused += 1
            return
        if self.tree.take(transforms, is_static=is_static) and not is_static:
            self.arrived_s = anyio.current_time()
        news, self._news = self._news, anyio.Event()
        news.set()
