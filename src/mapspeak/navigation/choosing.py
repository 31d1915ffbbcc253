"""From a place that somebody names to the pose the robot drives to."""

import math
from dataclasses import dataclass

from mapspeak.errors import GoalError
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.navigation.atlas import Atlas, RememberedPlace, RememberedThing
from mapspeak.navigation.goals import GoalCheck, check_goal
from mapspeak.navigation.places import Place, Spot, find_place, is_taken_name, say_spot
from mapspeak.navigation.standing import (
    arrival_pose,
    facing_in,
    find_standing_point,
    stand_before,
)
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.rooms import Door, Region

__all__ = ["CheckedGoal", "check_place", "choose_goal", "read_place", "stand_at"]


@dataclass(frozen=True, slots=True)
class CheckedGoal:
    """A pose to drive to, judged against the map.

    Attributes:
        name: Such as "R3" or "(1.20, -3.40)".
        pose: Where to stand.
        check: What is to be said of it.
        reason: Why there, where words had to be read for it; else empty.
    """

    name: str
    pose: Pose
    check: GoalCheck
    reason: str = ""

    @property
    def title(self) -> str:
        """What the drive there is called: the id of what has one, else the name with its reason."""
        is_told = self.reason and not is_taken_name(self.name)
        return f"{self.name}: {self.reason}" if is_told else self.name

    @property
    def sentence(self) -> str:
        """Why there, and what is to be said of it."""
        return "; ".join(filter(None, (self.reason, self.check.sentence)))


def choose_goal(
    atlas: Atlas, *, place: str | None, x: float | None, y: float | None, yaw_deg: float | None
) -> CheckedGoal:
    """Gives the pose to drive to for a place or for coordinates, checked against the map.

    Raises:
        GoalError: Neither or both were given, there is no such place, or the robot cannot drive
            there; the hint names the nearest pose that would work.
    """
    goal = check_place(atlas, read_place(atlas, place=place, x=x, y=y), yaw_deg=yaw_deg)
    if not goal.check.is_ok:
        raise GoalError(f"{goal.name}: {goal.check.sentence}", hint=_what_instead(goal.check))
    return goal


def read_place(atlas: Atlas, *, place: str | None, x: float | None, y: float | None) -> Place:
    """Gives the place that was named, or that of the coordinates.

    Raises:
        GoalError: Neither or both were given, or there is no such place.
    """
    if place is not None and x is None and y is None:
        return find_place(atlas, place)
    if place is None and x is not None and y is not None:
        point = Point(x, y)
        return Place(say_spot(point), Spot(point))
    raise GoalError(
        "A goal is either a place or both x and y.",
        hint="Give place (an id such as R3, or a remembered name), or x and y in metres.",
    )


def check_place(atlas: Atlas, place: Place, *, yaw_deg: float | None = None) -> CheckedGoal:
    """Judges the pose in which the robot would stand at a place."""
    pose = stand_at(atlas, place)
    if yaw_deg is not None:
        pose = Pose(pose.x, pose.y, wrap_angle(math.radians(yaw_deg)))
    check = check_goal(atlas.grid, atlas.distances, pose, opened=atlas.map.open.distances_from)
    return CheckedGoal(place.name, pose, check, place.reason)


def stand_at(atlas: Atlas, place: Place) -> Pose:
    """Gives the pose to drive to for a place, whether or not the robot can stand there."""
    match place.thing:
        case Region() as region:
            point = find_standing_point(atlas, region) or region.widest
            return Pose(point.x, point.y, facing_in(atlas, region, point))
        case Door() as door:
            return arrival_pose(atlas, atlas.find_crossing(door) or door.place)
        case Frontier(pose=pose):
            return pose
        case RememberedPlace(waypoint=waypoint):
            return waypoint.pose
        case RememberedThing() as remembered:
            return stand_before(atlas, remembered)
        case Spot(point=point, yaw_rad=yaw_rad):
            straight_on = arrival_pose(atlas, point)
            return straight_on if yaw_rad is None else Pose(point.x, point.y, yaw_rad)


def _what_instead(check: GoalCheck) -> str:
    if check.nearest is None:
        return "No place near it works either; call look_at_map and choose another one."
    near = check.nearest
    return (
        f"The nearest pose that works is x={near.x:.2f}, y={near.y:.2f}, "
        f"yaw_deg={near.yaw_deg:.0f}; call navigate_to with it, or call look_at_map."
    )
