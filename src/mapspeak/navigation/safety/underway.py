"""A drive as the guard sees it: the way it was allowed to go, and how far along it is."""

import itertools
from dataclasses import dataclass

from mapspeak.geometry import Pose
from mapspeak.navigation.goals import GoalCheck
from mapspeak.navigation.safety.guard import Clearance
from mapspeak.navigation.safety.lookout import Lookout

__all__ = ["GuardedDrive", "Plan"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """How the robot would get to a goal.

    Attributes:
        check: What the map says of the goal.
        legs: The poses to send it to, the goal last.
        here: Where it is.
    """

    check: GoalCheck
    legs: tuple[Pose, ...]
    here: Pose


@dataclass(slots=True, kw_only=True)
class GuardedDrive:
    """A drive under way, as far as anyone has asked.

    Attributes:
        goal_id: The id it is known by: that of its first leg.
        leg_id: What the robot calls the leg that it drives now.
        legs: Those after it.
    """

    goal_id: str
    leg_id: str
    legs: list[Pose]
    leg: Pose
    cleared: Clearance
    lookout: Lookout

    @property
    def further_m(self) -> float:
        """How far it is from the end of this leg to the goal."""
        ends = [self.leg, *self.legs]
        return sum(a.point.distance_to(b.point) for a, b in itertools.pairwise(ends))
