"""One goal of an action, from its sending to its end and beyond, and the states servers tell."""

import base64
import binascii
from collections.abc import Callable, Iterator
from enum import StrEnum

import anyio

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
        id: Ours, used nowhere else.
        through: The connection it was sent over, which may be guarded.
        owner: The client with whom it ends; None where somebody else sees to that.
        server_id: What the action server calls it; None where that is unknown.
        silent_s: Robot time since the latest, as far as somebody looked.
        reason: Why it ended so, where that was said.
        afterwards: What became of a withdrawn goal that the server took after all.
        is_withdrawn: We said that it was over before the server did: should the server take it,
            or still have it, it is cancelled.
        is_settled: The server has ended a withdrawn goal, or never had it.
        sent_s: When it was sent, by the event loop's clock.
        listed_end_s: When the list of all goals first told its end; None before.
    """

    def __init__(
        self,
        goal_id: str,
        *,
        action: str,
        type_name: str,
        through: RosConnection,
        sent_s: float,
        server_id: str | None = None,
    ) -> None:
        self.id = goal_id
        self.action = action
        self.type = type_name
        self.through = through
        self.owner: str | None = None
        self.server_id = server_id
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
        self.ended_s: float | None = None
        self.listed_end_s: float | None = None
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

    async def wait_until_taken(self, *, within_s: float) -> bool:
        """Return at the first sign that the goal was taken, or after so long; True with a sign."""
        return await self._wait_until(lambda: self.state is not ActionState.SENT, within_s)

    async def wait_until_over(self, *, within_s: float) -> bool:
        """Return at its end, or after so long; True at its end."""
        return await self._wait_until(lambda: self.is_over, within_s)

    async def wait_until_settled(self, *, within_s: float) -> bool:
        """Return when the server has ended a withdrawn goal, or after so long; True when it has."""
        return await self._wait_until(lambda: self.is_settled, within_s)

    async def _wait_until(self, is_so: Callable[[], bool], within_s: float) -> bool:
        with anyio.move_on_after(within_s):
            while not is_so():
                await self._news.wait()
        return is_so()


STATES = {
    1: ActionState.ACCEPTED,
    2: ActionState.RUNNING,
    3: ActionState.CANCELLING,
    4: ActionState.SUCCEEDED,
    5: ActionState.CANCELLED,
    6: ActionState.ABORTED,
}
"""action_msgs/GoalStatus."""


def read_statuses(message: Message) -> Iterator[tuple[str, ActionState]]:
    """Yield id and state of each goal of a list; leave out what is none."""
    entries = message.get("status_list")
    for entry in entries if isinstance(entries, list) else []:
        try:
            # The 16 bytes of an id come as a list, as base64 or as bytes.
            uuid = entry["goal_info"]["goal_id"]["uuid"]
            raw = base64.b64decode(uuid, validate=True) if isinstance(uuid, str) else bytes(uuid)
            yield raw.hex(), STATES[entry["status"]]
        except (KeyError, TypeError, ValueError, binascii.Error):
            continue
