"""What goes on over a connection: topics as heard, goals as told of, and what a stop has to end."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Message

Listener = Callable[[Message], None]


class Subscription:
    """The latest message of one topic. Many may wait for the next one at once.

    Attributes:
        type_name: As asked for; None left it to the robot.
        latest: The newest message; None as long as none has come.
        n_received: Since the subscription began, over all connections.
        begun_s: Since when we have listened, by the event loop's clock.
        arrived_s: When the newest came, by the event loop's clock.
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
        """Return the latest message once more than so many have come; wait in wall time.

        Raises:
            LinkError: None came in time. The subscription goes on.
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


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionEnd:
    """The end of a goal.

    Attributes:
        status: As in action_msgs/GoalStatus: 4 succeeded, 5 cancelled, 6 aborted; None if unsaid.
        is_result: False when the goal was refused; says nothing about success.
        values: The result message; a text with the reason where it was refused.
    """

    status: int | None
    is_result: bool
    values: Any


REFUSED = ActionEnd(status=None, is_result=False, values="")
"""The end of a goal that its server refused without a word."""


class ActionGoal:
    """What a connection tells of one goal of a ROS 2 action. It is kept after its end.

    Attributes:
        goal_id: The id it was sent with.
        ros_id: The UUID under which the action server knows it, 32 hex digits; None where unknown.
        is_accepted: The server is known to have taken it; rosbridge does not tell.
        is_lost: What would have brought its end is gone; the robot may still drive.
    """

    def __init__(self, *, goal_id: str, action: str, ros_id: str | None = None) -> None:
        self.goal_id = goal_id
        self.action = action
        self.ros_id = ros_id
        self.is_accepted = False
        self.feedback: Message | None = None
        self.end: ActionEnd | None = None
        self.is_lost = False
        self._listeners: list[Callable[[], None]] = []

    def listen(self, listener: Callable[[], None]) -> None:
        """Call a function whenever something is said about the goal; it must not raise."""
        self._listeners.append(listener)

    def take_acceptance(self) -> None:
        """Note that the server has taken it."""
        self.is_accepted = True
        self._tell()

    def take_feedback(self, feedback: Message) -> None:
        """Keep the latest feedback."""
        self.feedback = feedback
        self._tell()

    def take_end(self, end: ActionEnd) -> None:
        """Keep how it ended."""
        self.end = end
        self._tell()

    def take_loss(self) -> None:
        """Note that nothing more will be heard this way."""
        self.is_lost = True
        self._tell()

    def _tell(self) -> None:
        for listener in self._listeners:
            listener()


class Startable(Protocol):
    """An action on which goals of ours may be under way."""

    @property
    def is_busy(self) -> bool:
        """True while a goal of ours is under way, or may be."""

    @property
    def owners(self) -> frozenset[str]:
        """The clients with whom goals end that are under way."""

    async def end(self) -> bool:
        """End every goal of ours, also one that the robot takes only later.

        Returns whether somebody was there to be told; False also where nothing was under way.

        Raises:
            LinkError: Says what could not be ended.
        """


class Started:
    """Everything that was started over one connection.

    Attributes:
        actions: By name, each with our goals.
        velocities: The zero velocity of each topic on which a velocity was published.
        n_begun: How often something was begun; zero velocity is not repeated beyond that.
        n_stops: Grows with every stop; what was wanted before a stop is not begun after it.
    """

    def __init__(self) -> None:
        self.actions: dict[str, Startable] = {}
        self.velocities: dict[str, Message] = {}
        self.n_begun = 0
        self.n_stops = 0

    @property
    def is_busy(self) -> bool:
        """True while a goal of ours is under way, or may be."""
        return any(action.is_busy for action in self.actions.values())

    @property
    def owners(self) -> frozenset[str]:
        """The clients with whom goals end that are under way."""
        return frozenset().union(*(action.owners for action in self.actions.values()))

    def note_velocity(self, topic: str, *, zero: Message) -> None:
        """Note that a velocity is about to be published on a topic."""
        self.velocities[topic] = zero
        self.n_begun += 1
