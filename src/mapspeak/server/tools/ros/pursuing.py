"""What pursuing the goals of an action means, whichever ROS it is."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from mapspeak.ros.messages import Message
from mapspeak.server.tools.ros.jobs import ActionState, Job

__all__ = ["GONE", "NOT_TAKEN", "RESULT_LATE", "ActionPatience", "Pursuer"]

NOT_TAKEN = (
    "The action server gave no sign of taking the goal within {:g} s; it was cancelled. What "
    "has just started may not be found yet by all: send it again."
)
GONE = "The connection was lost meanwhile, and the action server does not know the goal any more."
RESULT_LATE = "Its result has not come."


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionPatience:
    """How long to wait, in wall time.

    Between nodes on Fast DDS, a message that was lost comes again after three seconds.

    Attributes:
        acceptance_s: For the first sign that a goal was taken.
        listing_s: For the list of the goals there are, before our own first one.
        end_s: For a goal to end that was cancelled.
        result_s: For the result of a goal whose end is known already.
        return_s: After a reconnection, for word of a goal that was under way.
    """

    acceptance_s: float = 5.0
    listing_s: float = 0.3
    end_s: float = 4.0
    result_s: float = 1.0
    return_s: float = 5.0


class Pursuer(Protocol):
    """Pursues the goals of one action."""

    async def send(self, job: Job, goal: Message) -> None:
        """Sends a job's goal, and waits until it was taken or refused."""
        ...

    async def wait_for_list(self) -> None:
        """Waits a moment for the goals that the action server knows."""
        ...

    def look_at(self, job: Job) -> None:
        """Brings a job up to date."""
        ...

    async def cancel(self, job: Job) -> None:
        """Cancels one goal and waits a moment for its end."""
        ...

    async def cancel_all(self) -> str:
        """Cancels every goal of the action, whoever sent it, and says what came of it."""
        ...

    @property
    def listed(self) -> Mapping[str, ActionState]:
        """The goals that the action server knows, ours and others', by its own ids."""
        ...

    @property
    def listed_s(self) -> float:
        """When that list came, by the event loop's clock."""
        ...

    @property
    def handles(self) -> Mapping[str, str]:
        """The handles of our own goals by the server's ids, as far as these are known."""
        ...
