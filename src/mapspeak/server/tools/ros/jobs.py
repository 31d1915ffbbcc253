"""Goals of actions as jobs: sent, asked about by a handle, waited for, kept after their end."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Any

import anyio

__all__ = ["ActionState", "Job"]


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


class Job:
    """One goal. Once over, only its result may still come.

    Attributes:
        handle: What a model calls it.
        action: The action's full name.
        type: The action's, as its ROS writes it.
        state: How it stands.
        feedback: The latest; None before the first.
        n_feedback: How many came.
        result: None as long as there is none.
        reason: Why it ended so, where somebody said.
        sent_s: When it was sent, by the event loop's clock.
        ended_s: When it ended; None before.
    """

    def __init__(self, *, handle: str, action: str, type_name: str) -> None:
        self.handle = handle
        self.action = action
        self.type = type_name
        self.state = ActionState.SENT
        self.feedback: Mapping[str, Any] | None = None
        self.n_feedback = 0
        self.result: Mapping[str, Any] | None = None
        self.reason = ""
        self.sent_s = anyio.current_time()
        self.ended_s: float | None = None
        self._news = anyio.Event()

    @property
    def is_over(self) -> bool:
        """True when nothing more will happen."""
        return self.state.is_final

    def move_on(self, state: ActionState) -> None:
        """Notes how it stands now; a goal does not go back."""
        order = list(ActionState)
        if not self.is_over and order.index(state) >= order.index(self.state):
            self.state = state
            self._tell()

    def take_feedback(self, feedback: Mapping[str, Any]) -> None:
        """Keeps the latest feedback, which says that the goal is being pursued."""
        if self.is_over:
            return
        self.feedback = feedback
        self.n_feedback += 1
        self.move_on(ActionState.RUNNING)

    def end(
        self, state: ActionState, *, reason: str = "", result: Mapping[str, Any] | None = None
    ) -> None:
        """Notes how it ended; the first word counts, and a result may follow it."""
        if self.result is None:
            self.result = result
        if self.is_over:
            return
        said = " ".join(reason.split())[:300].rstrip(". ")
        self.state, self.reason = state, f"{said}." if said else ""
        self.ended_s = anyio.current_time()
        self._tell()

    async def wait_until_taken(self, *, within_s: float) -> bool:
        """Returns at the first sign that the goal was taken, or after so long; True with a sign."""
        with anyio.move_on_after(within_s):
            while self.state is ActionState.SENT:
                await self._news.wait()
        return self.state is not ActionState.SENT

    async def wait_until_over(self, *, within_s: float) -> bool:
        """Returns at its end, or after so long; True at its end."""
        with anyio.move_on_after(within_s):
            while not self.is_over:
                await self._news.wait()
        return self.is_over

    def _tell(self) -> None:
        news, self._news = self._news, anyio.Event()
        news.set()
