"""A goal of a ROS 2 action, as a connection tells of it."""

from collections.abc import Callable

from mapspeak.ros import ActionEnd
from mapspeak.ros.messages import Message


class PursuedGoal:
    """What is known of one goal. It is kept after its end.

    Attributes:
        goal_id: The id it was sent with.
        action: The action's full name.
        ros_id: The UUID under which the action server knows it; None where that is unknown.
        is_accepted: The server is known to have taken it.
        feedback: The latest; None before the first.
        end: How it ended; None before.
        is_lost: The connection that would have brought its end is gone; the robot may still drive.
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
