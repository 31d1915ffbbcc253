"""One goal of an action, from its sending to its end and beyond, and how it may stand."""

from collections.abc import Callable
from enum import StrEnum

import anyio

from mapspeak.ros.activity import ActionGoal
from mapspeak.ros.messages.fields import Message
from mapspeak.ros.port import RosConnection

LONGEST_REASON = 300


class ActionState(StrEnum):
    """How a goal stands."""

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
        return self in FINAL


FINAL = frozenset(
    {
        ActionState.SUCCEEDED,
        ActionState.ABORTED,
        ActionState.CANCELLED,
        ActionState.REJECTED,
        ActionState.LOST,
    }
)
ORDER = list(ActionState)


class SentGoal:
    """A goal of ours. Once over its state stays, and only its result may still come.

    Attributes:
        wire: What the connection tells of it; on ROS 1, where topics do, only its ids.
        through: The connection it was sent over, which may be guarded.
        n_seen: How many goals the server had listed before.
        owner: The client with whom it ends; None where somebody else sees to that.
        server_id: What the action server calls it; None where that is unknown.
        silent_s: Robot time since the latest, as far as somebody looked.
        reason: Why it ended so, where that was said.
        afterwards: What became of a withdrawn goal that the server took after all.
        is_withdrawn: We said that it was over before the server did: should the server take it,
            or still have it, it is cancelled.
        is_settled: The server has ended a withdrawn goal, or never had it.
        sent_s: When it was sent, by the event loop's clock, as are the others.
        heard_s: When the connection last told of it.
        listed_end_s: When the list of all goals first told its end; None before.
        taken_feedback: Of what the connection has told, the latest that was taken in.
        n_lists_at_loss: How many lists had come when the connection lost it; None before.
        n_lists_at_end: How many had come when it was withdrawn.
    """

    def __init__(
        self,
        wire: ActionGoal,
        *,
        type_name: str,
        through: RosConnection,
        sent_s: float,
        n_seen: int = 0,
    ) -> None:
        self.wire = wire
        self.id = wire.goal_id
        self.action = wire.action
        self.type = type_name
        self.through = through
        self.n_seen = n_seen
        self.owner: str | None = None
        self.server_id = wire.ros_id
        self.state = ActionState.SENT
        self.feedback: Message | None = None
        self.n_feedback = 0
        self.silent_s = 0.0
        self.result: Message | None = None
        self.reason = ""
        self.afterwards = ""
        self.is_withdrawn = False
        self.is_settled = False
        self.sent_s = sent_s
        self.heard_s = anyio.current_time()
        self.ended_s: float | None = None
        self.listed_end_s: float | None = None
        self.taken_feedback: Message | None = None
        self.n_lists_at_loss: int | None = None
        self.n_lists_at_end = 0
        self._news = anyio.Event()

    @property
    def is_over(self) -> bool:
        """True when nothing more will happen."""
        return self.state.is_final

    def move_on(self, state: ActionState) -> None:
        """Note how it stands now; a goal does not go back."""
        if not self.is_over and ORDER.index(state) > ORDER.index(self.state):
            self.state = state
            self.tell()

    def take_feedback(self, feedback: Message) -> None:
        """Keep the latest feedback, which says that the goal is being pursued."""
        if not self.is_over:
            self.feedback = feedback
            self.n_feedback += 1
            self.silent_s = 0.0
            self.move_on(ActionState.RUNNING)

    def end(self, state: ActionState, *, reason: str = "", result: Message | None = None) -> None:
        """Note how it ended; the first word counts, and a result may follow it."""
        if self.result is None:
            self.result = result
        if not self.is_over:
            self.state, self.reason = state, " ".join(reason.split())[:LONGEST_REASON]
            self.ended_s = anyio.current_time()
            self.tell()

    def withdraw(self, state: ActionState, *, reason: str) -> None:
        """Note that it is over for us, whatever the server does with it."""
        self.is_withdrawn = True
        self.end(state, reason=reason)

    def settle(self) -> None:
        """Note that the server has ended a withdrawn goal."""
        self.is_settled = True
        self.tell()

    def tell(self) -> None:
        """Wake those who wait for news."""
        news, self._news = self._news, anyio.Event()
        news.set()

    async def wait_until_over(self, *, within_s: float) -> bool:
        """Return at its end, or after so long; True at its end."""
        return await self.wait_until(lambda: self.is_over, within_s=within_s)

    async def wait_until(self, is_so: Callable[[], bool], *, within_s: float) -> bool:
        """Return when something has come true of it, or after so long; True when it has."""
        with anyio.move_on_after(within_s):
            while not is_so():
                await self._news.wait()
        return is_so()
