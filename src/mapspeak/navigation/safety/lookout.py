"""What is looked out for while a robot drives: closed areas ahead, and a goal that went bad."""

from mapspeak.geometry import Point, Pose
from mapspeak.navigation.closures import ClosedArea
from mapspeak.navigation.revision import MapRevision

__all__ = ["Lookout"]

MAP_EVERY_S = 1.0
"""Robot time between two looks at the map; so late may a closing hour be noticed."""
OCCUPIED_FOR_S = 5.0
"""A person who walks over the goal does not spoil it."""
REACTION_S = 0.2
"""Between a look at the pose and the wheels' answer to a stop."""
BRAKING_MPS2 = 1.0
SLACK_M = 0.05
"""A goal at the very edge of a closed area can be reached."""
LEAST_STEP_S = 0.05
LOST_TRACK_S = 2.0
"""What lies longer ago says nothing about how fast the robot drives now."""


class Lookout:
    """Watches one drive; it only judges what it is told.

    Args:
        goal: Where the drive leads.
        radius_m: Of the robot.
    """

    def __init__(self, *, goal: Pose, radius_m: float) -> None:
        self._goal = goal
        self._radius_m = radius_m
        self._next_map_s = 0.0
        self._occupied_since_s: float | None = None
        self._before: tuple[Point, float] | None = None

    def begin_at(self, here: Point, *, now_s: float) -> None:
        """Notes where the robot stands before it is sent off."""
        self._before = (here, now_s)

    def is_map_due(self, now_s: float) -> bool:
        """True when it is time to look at the map again."""
        if now_s < self._next_map_s <= now_s + MAP_EVERY_S:
            return False
        self._next_map_s = now_s + MAP_EVERY_S
        return True

    def judge_goal(self, revision: MapRevision, *, now_s: float) -> str | None:
        """Gives why the goal is no longer a goal; None while it is one."""
        here = self._goal.point
        # The way to the goal was checked; only what closes or fills up since then matters here.
        area = self._closest(revision, here)
        if area is not None:
            return f"The goal now lies in the {area.title}; the robot was stopped."
        cell = revision.grid.cell_at(here)
        is_off = not revision.grid.contains(cell)
        if not is_off and not revision.grid.occupied[cell.row, cell.col]:
            self._occupied_since_s = None
            return None
        self._occupied_since_s = now_s if self._occupied_since_s is None else self._occupied_since_s
        if now_s - self._occupied_since_s < OCCUPIED_FOR_S:
            return None
        what = "is off the map now" if is_off else "has an obstacle on it now"
        return f"The map has changed: the goal {what}; the robot was stopped."

    def judge_motion(self, revision: MapRevision, here: Point, *, now_s: float) -> str | None:
        """Gives which closed area the robot is about to enter; None where it enters none.

        One that leaves an area is let go.
        """
        ahead = self._where_it_would_stand(here, now_s)
        if ahead is None:
            return None
        reach_m = self._radius_m - SLACK_M
        for area in revision.areas:
            left_m, then_m = area.distance_to(here), area.distance_to(ahead)
            is_deeper = area.contains(here) and area.contains(ahead)
            if then_m < reach_m and (then_m < left_m or is_deeper):
                edge_m = max(left_m - self._radius_m, 0.0)
                return (
                    f"The robot was stopped {edge_m:.2f} m before the {area.title}: its own "
                    "navigation was about to drive into it. Lead it round by goals on the way."
                )
        return None

    def _closest(self, revision: MapRevision, point: Point) -> ClosedArea | None:
        reach_m = self._radius_m - SLACK_M
        return next((a for a in revision.areas if a.distance_to(point) < reach_m), None)

    def _where_it_would_stand(self, here: Point, now_s: float) -> Point | None:
        """Gives where the robot would come to stand if it was told to stop now."""
        before, self._before = self._before, (here, now_s)
        if before is None:
            return None
        point, then_s = before
        passed_s = now_s - then_s
        if passed_s < LEAST_STEP_S:
            self._before = before
            return None
        if passed_s > LOST_TRACK_S:
            return None
        speed_mps = point.distance_to(here) / passed_s
        further_s = REACTION_S + speed_mps / (2 * BRAKING_MPS2)
        share = further_s / passed_s
        return Point(here.x + share * (here.x - point.x), here.y + share * (here.y - point.y))
