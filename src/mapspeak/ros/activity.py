"""The activity over a connection: subscriptions, goals, and everything that a stop has to end."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Protocol

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Message

Listener = Callable[[Message], None]


class News:
    """Wakes all who wait, each time that something is told."""

    def __init__(self) -> None:
        self._told = anyio.Event()

    def tell(self) -> None:
        """Wake all who wait."""
        told, self._told = self._told, anyio.Event()
        told.set()

    async def wait(self) -> None:
        """Return when something is told the next time."""
        await self._told.wait()

    async def wait_until(self, is_so: Callable[[], bool], *, within_s: float) -> bool:
        """Wait until a condition is true or the time is over; return whether it is true."""
        with anyio.move_on_after(within_s):
            while not is_so():
                await self.wait()
        return is_so()


class Subscription:
    """The latest message of one topic. Many may wait for the next one at once.

    Attributes:
        type_name: As asked for; None left it to the robot.
        latest: The newest message; None as long as none has come.
        n_received: Since the subscription began, over all connections.
        begun_s: Since when we have listened, by the event loop's clock.
        arrived_s: When the newest came, by the event loop's clock.
        n_users: Who share it; the last one to leave ends it.
        n_renewals: How often it was begun anew.
        reader: The link's own; None while the topic is not read.
    """

    def __init__(self, topic: str, *, type_name: str | None, throttle_ms: int = 0) -> None:
        self.topic = topic
        self.type_name = type_name
        self.throttle_ms = throttle_ms
        self.latest: Message | None = None
        self.n_received = 0
        self.begun_s = anyio.current_time()
        self.arrived_s = float("-inf")
        self.n_users = self.n_renewals = 0
        self.reader: Any = None
        self._listeners: list[Listener] = []
        self._news = News()

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
        self._news.tell()

    async def wait_for_more_than(self, n_received: int, *, timeout_s: float) -> Message:
        """Return the latest message once more than a number have come; wait in wall time.

        Raises:
            LinkError: None came in time. The subscription goes on.
        """
        has_more = await self._news.wait_until(
            lambda: self.n_received > n_received, within_s=timeout_s
        )
        if not has_more or self.latest is None:
            raise LinkError(
                f"No message came on {self.topic} within {timeout_s:g} s.",
                hint=f"Check that somebody publishes it: `ros2 topic hz {self.topic}` "
                f"(ROS 1: `rostopic hz {self.topic}`). We stay subscribed: asking again may help.",
            )
        return self.latest


class ActionState(StrEnum):
    """The state of a goal of an action."""

    SENT = "sent"
    ACCEPTED = "accepted"
    RUNNING = "running"
    CANCELLING = "cancelling"
    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELLED = "cancelled"
    REJECTED = "rejected"
    LOST = "lost"

    @property
    def is_final(self) -> bool:
        """True when nothing more will happen."""
        return ORDER.index(self) >= ORDER.index(ActionState.SUCCEEDED)


ORDER = list(ActionState)
LONGEST_REASON = 300


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionEnd:
    """The end of a goal, as a connection tells it.

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
    """A goal of ours: the connection's news of it, and its state by all news.

    Once over its state stays, and only its result may still come.

    Attributes:
        id: The one it was sent with.
        ros_id: The id by which the connection knows it at the action server, 32 hex digits of a
            UUID on ROS 2; None where it does not, as over rosbridge.
        is_accepted: The connection says that the server has taken it; rosbridge does not tell.
        is_lost: The connection or server that would report its end is gone; the robot may still
            drive.
        end: As the connection has told it.
        feedback: The latest.
        type: Of the action.
        through: The connection it was sent over, and is cancelled over; it may be guarded.
        n_seen: How many goals the server had listed before.
        owner: The client with whom it ends; None where the caller ends it.
        server_id: The action server's id of it; None where unknown.
        silent_s: Robot time since the latest feedback, as far as somebody looked.
        reason: Why it ended so, where known.
        afterwards: The end of a withdrawn goal that the server took after all.
        is_withdrawn: We reported it as over before the server did: should the server take it, or
            still have it, it is cancelled.
        is_settled: The server has ended a withdrawn goal, or never had it.
        sent_s: When it was sent, by the event loop's clock, as are the others.
        heard_s: When the connection last told of it.
        listed_end_s: When the list of all goals first told its end; None before.
        taken_feedback: The latest feedback that was taken in.
        n_lists_at_loss: How many lists had come when the connection lost it; None before.
        n_lists_at_end: How many had come when it was withdrawn.
    """

    def __init__(self, *, goal_id: str, action: str, ros_id: str | None = None) -> None:
        self.id = goal_id
        self.action = action
        self.ros_id = self.server_id = ros_id
        self.is_accepted = self.is_lost = False
        self.end: ActionEnd | None = None
        self.feedback: Message | None = None
        self.type = ""
        self.through: Any = None
        self.n_seen = 0
        self.owner: str | None = None
        self.state = ActionState.SENT
        self.n_feedback = 0
        self.silent_s = 0.0
        self.result: Message | None = None
        self.reason = self.afterwards = ""
        self.is_withdrawn = self.is_settled = False
        self.sent_s = self.heard_s = anyio.current_time()
        self.ended_s: float | None = None
        self.listed_end_s: float | None = None
        self.taken_feedback: Message | None = None
        self.n_lists_at_loss: int | None = None
        self.n_lists_at_end = 0
        self._listeners: list[Callable[[], None]] = []
        self._news = News()

    # --- news from the connection

    def listen(self, listener: Callable[[], None]) -> None:
        """Call a function whenever the connection tells of the goal; it must not raise."""
        self._listeners.append(listener)

    def take_acceptance(self) -> None:
        """Note that the server has taken it."""
        self.is_accepted = True
        self._hear()

    def take_feedback(self, feedback: Message) -> None:
        """Keep the latest feedback."""
        self.feedback = feedback
        self._hear()

    def take_end(self, end: ActionEnd) -> None:
        """Keep how it ended."""
        self.end = end
        self._hear()

    def take_loss(self) -> None:
        """Note that nothing more will be heard this way."""
        self.is_lost = True
        self._hear()

    def _hear(self) -> None:
        for listener in self._listeners:
            listener()

    # --- how it stands

    @property
    def is_over(self) -> bool:
        """True when nothing more will happen."""
        return self.state.is_final

    def move_on(self, state: ActionState) -> None:
        """Note how it stands now; a goal does not go back."""
        if not self.is_over and ORDER.index(state) > ORDER.index(self.state):
            self.state = state
            self._news.tell()

    def count_feedback(self) -> None:
        """Note that the latest feedback is new, and says that the goal is being pursued."""
        self.taken_feedback = self.feedback
        if not self.is_over:
            self.n_feedback += 1
            self.silent_s = 0.0
            self.move_on(ActionState.RUNNING)

    def finish(
        self, state: ActionState, *, reason: str = "", result: Message | None = None
    ) -> None:
        """Note how it ended; the first word counts, and a result may follow it."""
        if self.result is None:
            self.result = result
        if not self.is_over:
            self.state, self.reason = state, " ".join(reason.split())[:LONGEST_REASON]
            self.ended_s = anyio.current_time()
            self._news.tell()

    def settle(self) -> None:
        """Note that the server has ended a withdrawn goal."""
        self.is_settled = True
        self._news.tell()

    async def wait_until_over(self, *, within_s: float) -> bool:
        """Wait for its end until the time is over; return True at its end."""
        return await self.wait_until(lambda: self.is_over, within_s=within_s)

    async def wait_until(self, is_so: Callable[[], bool], *, within_s: float) -> bool:
        """Wait until a condition is true of it or the time is over; return whether it is true."""
        return await self._news.wait_until(is_so, within_s=within_s)


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

        Returns whether a server was there to be told; False also if nothing was under way.

        Raises:
            LinkError: Names the goals that could not be ended.
        """


class Started:
    """Everything that was started over one connection.

    Attributes:
        actions: By name, each with our goals.
        velocities: The zero velocity of each topic on which a velocity was published.
        n_begun: How often a motion was begun; a new one ends the repetition of zero velocity.
        n_stops: Grows with every stop; a request from before a stop is not begun after it.
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
