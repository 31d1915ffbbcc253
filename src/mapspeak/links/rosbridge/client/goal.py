"""A goal of a ROS 2 action, as rosbridge tells of it."""

from collections.abc import Callable

from mapspeak.links.rosbridge.messages import Message
from mapspeak.links.rosbridge.protocol import GoalEnded


class ActionGoal:
    """What is known of one goal. It is kept after its end.

    Attributes:
        goal_id: The id it was sent with.
        action: The action's full name.
        feedback: The latest; None before the first.
        end: How it ended; None before.
        is_lost: The connection that would have brought its end is gone; the robot may still drive.
    """

    def __init__(self, *, goal_id: str, action: str) -> None:
        self.goal_id = goal_id
        self.action = action
        self.feedback: Message | None = None
        self.end: GoalEnded | None = None
        self.is_lost = False
        self._listeners: list[Callable[[], None]] = []

    def listen(self, listener: Callable[[], None]) -> None:
        """Calls a function whenever something is said about the goal; it must not raise."""
        self._listeners.append(listener)

    def take_feedback(self, feedback: Message) -> None:
        """Keeps the latest feedback."""
        self.feedback = feedback
        self._tell()

    def take_end(self, end: GoalEnded) -> None:
        """Keeps how it ended."""
        self.end = end
        self._tell()

    def take_loss(self) -> None:
        """Notes that nothing more will be heard this way."""
        self.is_lost = True
        self._tell()

    def _tell(self) -> None:
        for listener in self._listeners:
            listener()
