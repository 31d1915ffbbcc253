"""A drive round closed areas in legs, for a robot whose own navigation knows nothing of them."""

import itertools
import math
from collections.abc import Iterator, Sequence

from mapspeak.geometry import Point, Pose
from mapspeak.navigation.closures import ClosedArea
from mapspeak.navigation.revision import MapRevision

__all__ = ["plan_legs"]

SLACK_M = 0.05
STEP_M = 0.1
LEAVING_M = 0.01
"""A robot that stands too near may come no nearer than by the noise of its pose."""


def plan_legs(revision: MapRevision, here: Point, goal: Pose) -> tuple[Pose, ...]:
    """Gives the poses to drive to one after the other, the goal last.

    The robot's own navigation is expected to go the shortest way over the floor as it knows it.
    Where that is clear of areas it gets the goal alone; else the corners of the way round them.
    """
    if not revision.areas:
        return (goal,)
    reach_m = revision.radius_m - SLACK_M
    expected = revision.open.distances_from(here).path_to(goal.point)
    if expected is not None and _is_clear(expected.points, revision.areas, reach_m):
        return (goal,)
    way = revision.distances_from(here).path_to(goal.point)
    if way is None:
        return (goal,)
    corners = [each for each in way.points[1:-1] if each not in (here, goal.point)]
    ends = [*corners[1:], goal.point]
    return (
        *(
            Pose(corner.x, corner.y, corner.bearing_to(end))
            for corner, end in zip(corners, ends, strict=False)
        ),
        goal,
    )


def _is_clear(points: Sequence[Point], areas: Sequence[ClosedArea], reach_m: float) -> bool:
    """True when a way keeps off all areas, or leads away from one that it begins too near to."""
    start = points[0]
    for area in areas:
        least_m = min(area.distance_to(start) - LEAVING_M, reach_m)
        is_within = area.contains(start)
        along = (area.distance_to(each) for each in _steps(points))
        if is_within or any(off_m < least_m for off_m in along):
            return False
    return True


def _steps(points: Sequence[Point]) -> Iterator[Point]:
    """Gives points along a way, close together."""
    for start, end in itertools.pairwise(points):
        n_steps = max(math.ceil(start.distance_to(end) / STEP_M), 1)
        for step in range(1, n_steps + 1):
            share = step / n_steps
            yield Point(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))
