"""What all ways of sending goals have in common."""

from dataclasses import dataclass
from typing import Protocol

from mapspeak.geometry import Pose
from mapspeak.robot import GoalState
from mapspeak.ros.actions import ActionPatience
from mapspeak.ros.driving.record import GoalRecord

LATEST_S = 0.0
"""A stamp that ROS takes for "as it is now"; our idea of robot time may be off."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivingPatience(ActionPatience):
    """How long to wait for the robot's navigation, in wall time; a test shortens it.

    Attributes:
        settling_s: After connecting, without anything new, until all that is there is found.
    """

    settling_s: float = 5.0


class Driver(Protocol):
    """One way of sending goals."""

    @property
    def foreign_goals(self) -> tuple[GoalState, ...]:
        """How goals stand that others have sent and that are under way, as last heard."""
        ...

    async def send(self, goal: Pose) -> GoalRecord:
        """Send a goal in the map frame; return the record of what becomes of it.

        Raises:
            LinkError: It could not be sent.
        """
        ...

    async def look_at(self, record: GoalRecord) -> None:
        """Bring a record up to date."""
        ...

    async def cancel(self, record: GoalRecord) -> None:
        """End one goal, and wait a moment for the end.

        Raises:
            LinkError: It goes on, or navigation could not be told.
        """
        ...
