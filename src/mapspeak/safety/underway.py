"""A drive as the guard sees it: the way it was allowed to go, and how far along it is."""

import itertools
from dataclasses import dataclass

from mapspeak.geometry import Pose
from mapspeak.safety.guard import Permit
from mapspeak.safety.monitor import GoalMonitor


@dataclass(slots=True, kw_only=True)
class GuardedDrive:
    """A drive under way, as far as anyone has asked.

    Attributes:
        goal_id: The id it is known by: that of its first leg.
        leg_id: What the robot calls the leg that it drives now.
        legs: Those after it.
        permit: By which it was allowed.
        goal_monitor: Watches its goal.
    """

    goal_id: str
    leg_id: str
    legs: list[Pose]
    leg: Pose
    permit: Permit
    goal_monitor: GoalMonitor

    @property
    def further_m(self) -> float:
        """How far it is from the end of this leg to the goal."""
        ends = [self.leg, *self.legs]
        return sum(a.point.distance_to(b.point) for a, b in itertools.pairwise(ends))
