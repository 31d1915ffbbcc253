"""Goal checks by the map, and the legs that lead the robot round closed areas to a goal."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import anyio.to_thread
import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.places.goalcheck import GoalCheck, GoalVerdict, check_goal
from mapspeak.robot import Cause, GoalStatus, Robot, StampedPose
from mapspeak.safety.deciding import MOST_NESTED, Refused, judge_check, read_number, refuse
from mapspeak.safety.guard import MapReviser, Permit
from mapspeak.safety.monitor import KEEP_M, GoalMonitor, comes_too_near
from mapspeak.safety.policy import Policy
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import Path, find_path
from mapspeak.worldmodel.keepout import MARGIN_M, ClosedArea, distance_to_sides
from mapspeak.worldmodel.revision import MapRevision

STEP_M = 0.1
STRAY_M = 0.03
"""Largest distance of the legs from the path that was found: part of the margin around areas."""
SHORTEST_M = 0.5
BOW_M = 1.0
"""A leg farther than this from all areas needs no second check: no robot strays that far."""
AROUND_M = 2.0
HALTED_AGAIN_M = 0.3
"""A robot that is stopped again so near to where it was led on from does not follow."""


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
    return _cut(revision, way, goal)


def lead_round(revision: MapRevision, here: Point, goal: Pose) -> tuple[Pose, ...]:
    """Return the poses of the way to a goal for a robot that would go another; none without one."""
    way = revision.find_path(here, goal.point)
    return () if way is None else _cut(revision, way, goal)


def _cut(revision: MapRevision, way: Path, goal: Pose) -> tuple[Pose, ...]:
    """Return the corners of a way as poses, the goal last."""
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
    here, steps = points[0], Path.through(tuple(points)).sampled(STEP_M)[1:]
    return not any(
        area.contains(here) or comes_too_near(area, here, steps, reach_m=reach_m) for area in areas
    )


def _between(start: Point, end: Point, share: float) -> Point:
    return Point(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))


@dataclass(slots=True, kw_only=True)
class GuardedDrive:
    """A drive under way, as it was last seen.

    Attributes:
        goal_id: The id it is known by: that of its first leg.
        leg_id: What the robot calls the leg that it drives now.
        map: What its legs were planned on.
        halted: Why the robot was stopped; it is to be led round that.
        halts: Where it was stopped so.
        is_given_up: True when it must not be sent on.
        verdict: Why it was ended here; it counts once the robot has ended its leg.
    """

    goal_id: str
    leg_id: str
    legs: list[Pose]
    leg: Pose
    permit: Permit
    goal_monitor: GoalMonitor
    map: MapRevision
    halted: Cause | None = None
    halts: list[Point] = field(default_factory=list)
    is_given_up: bool = False
    verdict: GoalStatus | None = None

    @property
    def goal(self) -> Pose:
        """Where it ends."""
        return [self.leg, *self.legs][-1]

    def halt(self, cause: Cause, here: Point) -> bool:
        """Note that the robot must stop here; false where it does not follow: it did so before."""
        if self.halted is None:
            if any(here.distance_to(each) < HALTED_AGAIN_M for each in self.halts):
                return False
            self.halts.append(here)
            self.halted = cause
        return True

    def needs_legs(self, revision: MapRevision) -> bool:
        """Return True where it must be planned anew."""
        if self.is_given_up:
            return False
        was = (self.map.areas, self.map.hindrances)
        return self.halted is not None or (revision.areas, revision.hindrances) != was

    def plan_anew(self, revision: MapRevision, here: Point) -> tuple[Pose, ...]:
        """Return the legs from here, the goal last; none where a stopped robot has no way."""
        plan = plan_legs if self.halted is None else lead_round
        return plan(revision, here, self.goal)

    @property
    def further_m(self) -> float:
        """How far it is from the end of this leg to the goal."""
        ends = [self.leg, *self.legs]
        return sum(a.point.distance_to(b.point) for a, b in itertools.pairwise(ends))


SAME_PLACE_M = 0.1
"""A goal no farther away than this is a turn."""
SURVEY_EVERY_S = 1.0
"""Robot time between two looks at the map; so late may a closing hour be noticed."""
MOST_POSES = 200
NO_FRAME = "?"
"""For a pose without a readable frame, or one that is not in metres."""

Message = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """How the robot would get to a goal.

    Attributes:
        legs: The poses to send it to, the goal last.
    """

    check: GoalCheck
    legs: tuple[Pose, ...]
    here: StampedPose
    map: MapRevision


class Planner:
    """Checks goals against the map, and plans the legs to them."""

    def __init__(self, robot: Robot, *, reviser: MapReviser, policy: Policy) -> None:
        self._robot = robot
        self._reviser = reviser
        self._policy = policy
        self._revised_s = -math.inf

    @property
    def radius_m(self) -> float:
        """The robot's radius with the clearance that the policy wants."""
        return self._robot.description.radius_m + self._policy.clearance_m

    async def revise_lately(self) -> MapRevision:
        """Return the map of a second of robot time ago at most, or of now."""
        since_s = self._robot.now_s - self._revised_s
        if self._reviser.latest is None or not 0 <= since_s < SURVEY_EVERY_S:
            self._revised_s = self._robot.now_s
            return await self.revise()
        return self._reviser.latest

    async def revise(self) -> MapRevision:
        """Return the map of now with the areas that are closed now."""
        grid = await self._robot.fetch_map()
        return await self._reviser.revise(grid, radius_m=self.radius_m)

    async def plan(self, goal: Pose) -> Plan:
        """Check a goal, and find the legs by which the robot would get there."""
        revision, here = await self._look()
        check = await anyio.to_thread.run_sync(_check, revision, here.pose, goal)
        legs: tuple[Pose, ...] = (goal,)
        if check.is_ok and check.path_m:
            legs = await anyio.to_thread.run_sync(plan_legs, revision, here.pose.point, goal)
        return Plan(check=check, legs=legs, here=here, map=revision)

    async def judge_message(self, message: Message) -> Refused | None:
        """Return what is against the goal of an action: each pose in it is held to the map.

        Raises:
            LinkError: It holds a pose, and the map or where the robot is are not known.
        """
        poses = list(find_poses(message))
        if not poses:
            return None
        map_frame = self._robot.description.map_frame
        strange = next((frame for frame, _ in poses if frame not in ("", map_frame)), None)
        if strange is not None and self._reviser.has_rules:
            return _refuse_frame(strange, map_frame)
        goals = [pose for frame, pose in poses if frame in ("", map_frame)]
        if len(goals) > MOST_POSES:
            return _refuse_many(len(goals))
        if not goals:
            return None
        revision, here = await self._look()
        return await anyio.to_thread.run_sync(self._judge_all, revision, here.pose, goals)

    def _judge_all(
        self, revision: MapRevision, here: Pose, goals: Sequence[Pose]
    ) -> Refused | None:
        judged = (judge_check(_check(revision, here, goal), self._policy) for goal in goals)
        return next((each for each in judged if each is not None), None)

    async def _look(self) -> tuple[MapRevision, StampedPose]:
        here = await self._robot.fetch_pose()
        return await self.revise(), here


def _check(revision: MapRevision, here: Pose, goal: Pose) -> GoalCheck:
    check = check_goal(revision.grid, revision.distances_from(here.point), goal)
    if check.is_ok:
        return check
    is_turn = goal.is_finite() and here.point.distance_to(goal.point) <= SAME_PLACE_M
    is_over = any(area.distance_to(here.point) < revision.radius_m for area in revision.areas)
    if is_turn and not is_over:
        # Where it stands it can stand, however tight the map shows that place to be.
        return replace(check, verdict=GoalVerdict.OK, path_m=0.0, nearest=None)
    return check


def find_poses(value: object, frame: str = "", depth: int = 0) -> Iterator[tuple[str, Pose]]:
    """Find the poses anywhere in a message, each with its frame; "" where no header says one."""
    if depth > MOST_NESTED:
        yield NO_FRAME, Pose(math.nan, math.nan)
    elif isinstance(value, Mapping):
        frame = _read_frame(value, frame)
        pose = _read_pose(value, is_stamped="header" in value)
        if pose is not None:
            yield (frame if pose.is_finite() else NO_FRAME), pose
            return
        for inner in value.values():
            yield from find_poses(inner, frame, depth + 1)
    elif isinstance(value, (list, tuple)):
        for inner in value:
            yield from find_poses(inner, frame, depth + 1)


def _read_frame(message: Message, outer: str) -> str:
    header = message.get("header")
    if not isinstance(header, Mapping):
        return outer
    frame = header.get("frame_id")
    # A header without a frame names none, which is not the same as having no header.
    return frame.strip("/") if isinstance(frame, str) and frame else NO_FRAME


def _read_pose(message: Message, *, is_stamped: bool) -> Pose | None:
    """Return the pose of a Pose, a Pose2D or a PointStamped; not finite if it has no position.

    A message may leave fields out, which are zero then.
    """
    position = message.get("position")
    if not isinstance(position, Mapping) and is_stamped:
        position = message.get("point")
    if isinstance(position, Mapping):
        if not set(position) <= {"x", "y", "z"}:
            return Pose(math.nan, math.nan)
        return Pose(_number(position, "x"), _number(position, "y"), _read_yaw(message))
    if "theta" in message and {"x", "y"} & set(message):
        return Pose(_number(message, "x"), _number(message, "y"), _number(message, "theta"))
    return None


def _read_yaw(message: Message) -> float:
    quaternion = message.get("orientation")
    if not isinstance(quaternion, Mapping):
        return 0.0
    x, y, z, w = (_number(quaternion, axis) for axis in "xyzw")
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def _number(message: Message, name: str) -> float:
    return read_number(message.get(name, 0.0))


def _refuse_frame(frame: str, map_frame: str) -> Refused:
    said = "no frame" if frame == NO_FRAME else f"the frame {frame[:80]!r}"
    return refuse(
        f"Areas are closed to the robot, and this goal has a pose in {said}: whether it "
        "lies in one of them cannot be known.",
        rule="keep_out",
        hint=f"Give poses in the frame {map_frame!r}.",
    )


def _refuse_many(n_poses: int) -> Refused:
    return refuse(
        f"This goal has {n_poses} poses; at most {MOST_POSES} are checked.",
        rule="goals",
        hint="Send it in parts.",
    )
