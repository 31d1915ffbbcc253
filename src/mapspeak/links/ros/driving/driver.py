"""What all ways of sending goals have in common."""

from dataclasses import dataclass
from typing import Protocol

from mapspeak.geometry import Pose
from mapspeak.links.ros.driving.record import GoalRecord
from mapspeak.robot import GoalState

LATEST_S = 0.0
"""A stamp that ROS takes for "as it is now"; our idea of robot time may be off."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivingPatience:
    """How long to wait for the robot's navigation, in wall time; a test shortens it.

    Between nodes on Fast DDS, a message that was lost comes again after three seconds: to wait for
    less would be to take a lost message for a silent robot.

    Attributes:
        acceptance_s: For the first sign that a goal was taken.
        end_s: For a goal to end that was cancelled or replaced.
        result_s: For the result of a goal whose end is known already.
        return_s: After a reconnection, for word of a goal that was under way.
        settling_s: After connecting, for all that the robot offers to be found.
    """

    acceptance_s: float = 5.0
    end_s: float = 4.0
    result_s: float = 1.0
    return_s: float = 5.0
    settling_s: float = 3.0


class Driver(Protocol):
    """One way of sending goals."""

    @property
    def foreign_goals(self) -> tuple[GoalState, ...]:
        """How goals stand that others have sent and that are under way, as last heard."""
        ...

    async def send(self, goal: Pose) -> GoalRecord:
        """Sends a goal in the map frame, and gives the record of what becomes of it.

        Raises:
            LinkError: It could not be sent.
        """
        ...

    async def look_at(self, record: GoalRecord) -> None:
        """Brings a record up to date."""
        ...

    async def cancel(self, record: GoalRecord) -> None:
        """Ends one goal and waits a moment for the end.

        Raises:
            LinkError: It could not be cancelled.
        """
        ...

    async def cancel_all(self) -> None:
        """Ends every goal, those of other clients too, and waits a moment for ours to end.

        Raises:
            LinkError: The robot could not be told.
        """
        ...
