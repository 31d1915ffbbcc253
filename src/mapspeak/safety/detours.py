"""A drive round closed areas in parts, for navigation that knows nothing of them."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.safety.guard import Permit
from mapspeak.safety.monitor import KEEP_M, GoalMonitor
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import Path, find_path
from mapspeak.worldmodel.closures import MARGIN_M, ClosedArea, distance_to_sides
from mapspeak.worldmodel.revision import MapRevision

STEP_M = 0.1
STRAY_M = 0.03
"""So far the legs may lead off the way that was found: a part of the margin around areas."""
SHORTEST_M = 0.5
BOW_M = 1.0
"""From areas farther off than this a leg needs no second look: no robot leaves a line so far."""
AROUND_M = 2.0
LEAVING_M = 0.01
"""A robot that stands too near may come no nearer than by the noise of its pose."""


def plan_legs(revision: MapRevision, here: Point, goal: Pose) -> tuple[Pose, ...]:
    """Return the poses to drive to one after the other, the goal last.

    The robot's own navigation is expected to go the shortest way over the floor as it knows it.
    Where that is clear of areas, and of hindrances that can be avoided, it gets the goal alone;
    else the corners of the way round them.
    """
    if not (revision.areas or revision.hindrances):
        return (goal,)
    reach_m = revision.radius_m + MARGIN_M
    expected = revision.open.distances_from(here).path_to(goal.point)
    if expected is not None and not _is_clear(expected.points, revision.areas, reach_m):
        expected = None
    if expected is not None and not _find_crossed(revision, expected):
        return (goal,)
    way = revision.find_path(here, goal.point)
    if way is None:
        return (goal,)
    if expected is not None and _find_crossed(revision, expected) <= _find_crossed(revision, way):
        # The robot's own way is no worse than ours.
        return (goal,)
    corners = _split(revision, _simplify(way.points))[1:-1]
    ends = [*corners[1:], goal.point]
    return (
        *(
            Pose(corner.x, corner.y, corner.bearing_to(end))
            for corner, end in zip(corners, ends, strict=False)
        ),
        goal,
    )


def _find_crossed(revision: MapRevision, way: Path) -> set[int]:
    """Return the numbers of the hindrances that a way leads over."""
    return {n for n, each in enumerate(revision.hindrances) if each.is_crossed_by(way)}


def _simplify(points: Sequence[Point]) -> list[Point]:
    """Leave points out while the way stays where it was: at each one left the robot stops.

    This is Douglas and Peucker, "Algorithms for the reduction of the number of points required to
    represent a digitized line or its caricature" (1973).
    """
    start, end = points[0], points[-1]
    line = np.array([[start.x, start.y, end.x, end.y]])
    off_m = [distance_to_sides(each, line) for each in points[1:-1]]
    if not off_m or max(off_m) <= STRAY_M:
        return [start, end]
    farthest = off_m.index(max(off_m)) + 1
    return [*_simplify(points[: farthest + 1])[:-1], *_simplify(points[farthest:])]


def _split(revision: MapRevision, points: Sequence[Point]) -> list[Point]:
    """Make legs shorter by which a robot that keeps off walls would come too near to an area."""
    split = [points[0]]
    for start, end in itertools.pairwise(points):
        n_parts = _count_parts(revision, start, end)
        split += [_between(start, end, part / n_parts) for part in range(1, n_parts)]
        split.append(end)
    return split


def _count_parts(revision: MapRevision, start: Point, end: Point) -> int:
    """Return into how many parts a leg is cut, until the robot goes clear or they are short."""
    reach_m = revision.radius_m + KEEP_M + STRAY_M
    near = [
        area
        for area in revision.areas
        if min(map(area.distance_to, Path.through((start, end)).sampled(STEP_M)[1:]))
        < reach_m + BOW_M
    ]
    n_parts = 1
    while near and start.distance_to(end) / n_parts > SHORTEST_M:
        ends = [_between(start, end, part / n_parts) for part in range(n_parts + 1)]
        if all(_goes_clear(revision, near, pair, reach_m) for pair in itertools.pairwise(ends)):
            break
        n_parts *= 2
    return n_parts


def _goes_clear(
    revision: MapRevision, areas: Sequence[ClosedArea], ends: tuple[Point, Point], reach_m: float
) -> bool:
    """Return True when the robot is expected to keep off areas by its own planning."""
    way = find_path(_crop_around(revision.grid, ends), *ends, radius_m=revision.radius_m)
    return way is None or _is_clear(way.points, areas, reach_m)


def _crop_around(grid: OccupancyGrid, ends: tuple[Point, Point]) -> OccupancyGrid:
    """Return the part of the map on which a way between two near places is looked for."""
    rows, cols = grid.cells_at(np.array([[each.x, each.y] for each in ends]))
    return grid.crop(*grid.window(rows, cols, margin=math.ceil(AROUND_M / grid.resolution_m)))


def _is_clear(points: Sequence[Point], areas: Sequence[ClosedArea], reach_m: float) -> bool:
    """Return True when a way keeps off all areas, or leads away from one that is too near."""
    steps = Path.through(tuple(points)).sampled(STEP_M)[1:]
    for area in areas:
        least_m = min(area.distance_to_border(points[0]) - LEAVING_M, reach_m)
        along = (area.distance_to_border(each) for each in steps)
        if area.contains(points[0]) or any(off_m < least_m for off_m in along):
            return False
    return True


def _between(start: Point, end: Point, share: float) -> Point:
    return Point(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))


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
