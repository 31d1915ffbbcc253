"""Monitors: closed areas ahead of a moving robot, its goal, and whether a held robot stands."""

import math
from collections.abc import Awaitable, Callable, Iterable
from enum import StrEnum

import anyio

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.hold import Hold
from mapspeak.robot import Cause, CauseCode, Robot, StampedPose
from mapspeak.worldmodel.keepout import ClosedArea
from mapspeak.worldmodel.revision import MapRevision

BLIND_S = 2.0
"""Wall time without a pose after which a robot that must keep off some area is stopped."""
OCCUPIED_FOR_S = 5.0
"""A person who walks over the goal does not spoil it."""
REACTION_S = 0.2
"""Between a look at the pose and the wheels' answer to a stop."""
BRAKING_MPS2 = 1.0
KEEP_M = 0.05
"""What a stop leaves between the robot's edge and an area; less than ways and goals leave."""
WAVER_M = 0.01
"""The pose of a standing robot differs by at most this between two looks."""
LEAST_STEP_S = 0.05
LOST_TRACK_S = 2.0
"""An older pose says nothing about how fast the robot drives now."""
CORRECTED_MPS = 5.0
"""A faster movement was not driven: localisation has corrected itself."""
N_STEPS = 8
"""The number of points on the braking path at which the distance to areas is checked."""


class Mover(StrEnum):
    """What moves a robot: its own navigation, a published velocity, or nothing of ours."""

    NAVIGATION = "navigation"
    VELOCITY = "velocity"
    OTHERS = "others"


AT_AREA = {
    Mover.NAVIGATION: CauseCode.NAVIGATION_AT_AREA,
    Mover.VELOCITY: CauseCode.VELOCITY_AT_AREA,
    Mover.OTHERS: CauseCode.OTHERS_AT_AREA,
}


class GoalMonitor:
    """Watches whether a drive's goal still is one; it only judges what it is told."""

    def __init__(self, *, goal: Pose, radius_m: float) -> None:
        self._goal = goal
        self._radius_m = radius_m
        self._occupied_since_s: float | None = None

    def judge(self, revision: MapRevision, *, now_s: float) -> Cause | None:
        """Return why the goal is no longer allowed; None while it is."""
        here = self._goal.point
        # The way to the goal was checked; only what closes or fills up since then matters here.
        near = (area for area in revision.areas if area.distance_to(here) < self._radius_m)
        area = next(near, None)
        if area is not None:
            return Cause(code=CauseCode.GOAL_CLOSED, name=area.title)
        cell = revision.grid.cell_at(here)
        is_off = not revision.grid.contains(cell)
        if not is_off and not revision.grid.is_occupied(cell):
            self._occupied_since_s = None
            return None
        self._occupied_since_s = now_s if self._occupied_since_s is None else self._occupied_since_s
        if now_s - self._occupied_since_s < OCCUPIED_FOR_S:
            return None
        return Cause(code=CauseCode.GOAL_OFF_MAP if is_off else CauseCode.GOAL_OCCUPIED)


class KeepOutMonitor:
    """Watches a robot, whatever moves it, for the closed areas ahead.

    Attributes:
        seen_at_s: When its pose was known last, in wall time.
    """

    def __init__(self) -> None:
        self.seen_at_s = -math.inf
        self._before: tuple[StampedPose, float] | None = None
        self._least_m: dict[ClosedArea, float] = {}

    @property
    def here(self) -> Point:
        """Where the robot was at the last look."""
        if self._before is None:
            raise LinkError("The robot was not seen yet.", hint="Look again.")
        return self._before[0].pose.point

    def begin_at(self, here: StampedPose, *, now_s: float) -> None:
        """Begin anew where the robot stands: what it came too near to before is forgotten."""
        self._before = (here, now_s)
        self._least_m = {}

    async def look(self, robot: Robot, revision: MapRevision, *, mover: Mover) -> Cause | None:
        """Return why a robot must not go on; that nothing can be seen is a reason after a while.

        The blind robot is stopped only when we drive it: what others do with it is not known.
        """
        try:
            here = await robot.fetch_pose()
        except LinkError as error:
            blind_s = anyio.current_time() - self.seen_at_s
            if mover is Mover.OTHERS or blind_s < BLIND_S:
                return None
            return Cause(code=CauseCode.POSE_UNKNOWN, after_s=blind_s, quote=str(error))
        self.seen_at_s = anyio.current_time()
        fault = self.judge(revision, here, now_s=robot.now_s, mover=mover)
        if fault is not None:
            self.begin_at(here, now_s=robot.now_s)
        return fault

    def judge(
        self, revision: MapRevision, stamped: StampedPose, *, now_s: float, mover: Mover
    ) -> Cause | None:
        """Return which closed area the robot is about to enter; None when it enters none.

        A robot already too close may move along or away from the area, never closer.
        """
        here = stamped.pose
        way = (here.point, *self._find_way_to_stand(stamped, now_s))
        self._least_m = {
            area: self._least_m[area] for area in revision.areas if area in self._least_m
        }
        for area in revision.areas:
            left_m = area.distance_to_border(here.point)
            least_m = self._find_least(area, min(revision.radius_m + KEEP_M, left_m - WAVER_M))
            if any(area.distance_to_border(each) < least_m for each in way):
                edge_m = max(left_m - revision.radius_m, 0.0)
                return Cause(code=AT_AREA[mover], name=area.title, distance_m=edge_m)
        return None

    def _find_least(self, area: ClosedArea, least_m: float) -> float:
        """Return how near to an area the robot's centre may come: as near as it is, if too near."""
        self._least_m[area] = max(least_m, self._least_m.get(area, least_m))
        return self._least_m[area]

    def _find_way_to_stand(self, stamped: StampedPose, now_s: float) -> tuple[Point, ...]:
        """Return the way that the robot would still go if the next look told it to stop."""
        before, self._before = self._before, (stamped, now_s)
        if before is None:
            return ()
        passed_s = now_s - before[1]
        is_told_again = (stamped.pose, stamped.stamp_s) == (before[0].pose, before[0].stamp_s)
        # A clock that was set back has not run backwards: the look before is of no use.
        if 0.0 <= passed_s < LEAST_STEP_S or is_told_again:
            # The pose that is told next may be older than one look.
            self._before = before
            return ()
        then, here = before[0].pose, stamped.pose
        moved_m = then.point.distance_to(here.point)
        if not 0.0 < passed_s <= LOST_TRACK_S or moved_m <= WAVER_M:
            return ()
        speed_mps = moved_m / passed_s
        if speed_mps > CORRECTED_MPS:
            return ()
        # The next look is as far away as the last one was.
        further_m = speed_mps * (passed_s + REACTION_S + speed_mps / (2 * BRAKING_MPS2))
        turned_rad = _find_turn(then, here)
        heading_rad = then.point.bearing_to(here.point) + turned_rad / 2
        return follow_arc(here.point, heading_rad, turned_rad / moved_m, further_m, n_steps=N_STEPS)


def comes_too_near(area: ClosedArea, here: Point, way: Iterable[Point], *, reach_m: float) -> bool:
    """Return True for a way from here that comes nearer to an area than `reach_m`.

    A robot that is too near already may drive along the area or away from it.
    """
    least_m = min(reach_m, area.distance_to_border(here) - WAVER_M)
    return any(area.distance_to_border(each) < least_m for each in way)


def _find_turn(then: Pose, here: Pose) -> float:
    """Return by how much a robot turned as it drove, without what it turned on the spot before.

    At the end of an arc it looks half the turn away from the chord, and after a turn on the spot
    along it.
    """
    turned_rad = wrap_angle(here.yaw_rad - then.yaw_rad)
    off_rad = wrap_angle(here.yaw_rad - then.point.bearing_to(here.point))
    if abs(off_rad) > math.pi / 2:
        off_rad = wrap_angle(off_rad + math.pi)
    low, high = min(turned_rad, 0.0), max(turned_rad, 0.0)
    return min(max(2 * off_rad, low), high)


def follow_arc(
    start: Point, heading_rad: float, curvature_radpm: float, length_m: float, *, n_steps: int
) -> tuple[Point, ...]:
    """Return points along an arc, without its start."""
    step_m = length_m / n_steps
    points = [start]
    for number in range(n_steps):
        toward_rad = heading_rad + curvature_radpm * step_m * (number + 0.5)
        last = points[-1]
        points.append(
            Point(last.x + step_m * math.cos(toward_rad), last.y + step_m * math.sin(toward_rad))
        )
    return tuple(points[1:])


WAVER_RAD = 0.02
OLD_S = 1.0
"""A pose from longer ago says nothing of whether the robot moves now."""
LOOK_S = 1.0
"""A look takes no longer, in wall time."""


class StandingCheck:
    """Compares where a robot is with where it was at the look before."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._before: Pose | None = None
        self._has_looked = False

    def begin(self) -> None:
        """Forget where it was: it was just stopped, and may roll on."""
        self._before, self._has_looked = None, False

    async def is_standing(self) -> bool:
        """Return False when the robot moved since the look before, or its pose is not known.

        There is nothing to compare the first look with.
        """
        before, is_first = self._before, not self._has_looked
        self._before = here = await self._look()
        self._has_looked = True
        if here is None:
            return False
        if before is None:
            return is_first
        return before.is_near(here, off_m=WAVER_M, turn_rad=WAVER_RAD)

    async def _look(self) -> Pose | None:
        with anyio.move_on_after(LOOK_S):
            try:
                stamped = await self._robot.fetch_pose()
            except LinkError:
                return None
            is_old = self._robot.now_s - stamped.stamp_s > OLD_S
            return None if is_old else stamped.pose
        return None


class HoldKeeper:
    """Obeys a hold, and tells the operator what came of it.

    Args:
        repeat_s: Between two looks whether it does, in wall time.
    """

    def __init__(self, hold: Hold, standing: StandingCheck, *, repeat_s: float) -> None:
        self._hold = hold
        self._standing = standing
        self._repeat_s = repeat_s
        self._answered: str | None = None
        self._next_look_s = float("-inf")

    async def obey(
        self,
        robot: str,
        *,
        stop: Callable[[str], Awaitable[None]],
        repeat: Callable[[], Awaitable[None]],
    ) -> None:
        """Stop the robot when a hold is new, and again while it is not known to stand.

        Args:
            robot: What the operator calls it.
            stop: Stops it for the reason that is given.
            repeat: Stops it once more.

        Raises:
            MapspeakError: The stop failed, which the operator is told; call again.
        """
        held_by = self._hold.read()
        if held_by is None or held_by != self._answered:
            self._answered = None
        if held_by is None:
            return
        try:
            if self._answered is not None:
                await self._keep_still(repeat)
                return
            await stop(held_by)
        except MapspeakError as error:
            self._answered = None
            self._hold.answer(robot, held_by=held_by, failure=str(error))
            raise
        self._answered = held_by
        self._standing.begin()
        self._hold.answer(robot, held_by=held_by)

    async def _keep_still(self, repeat: Callable[[], Awaitable[None]]) -> None:
        if anyio.current_time() < self._next_look_s:
            return
        self._next_look_s = anyio.current_time() + self._repeat_s
        if not await self._standing.is_standing():
            await repeat()
