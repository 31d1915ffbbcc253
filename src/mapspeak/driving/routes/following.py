"""A route under way: which stops are done, which comes next, and why one was left out.

It advances only while a call waits for it, and a drive that was ended from elsewhere is begun
again with the next call.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial

import anyio

from mapspeak.driving.drive import OnProgress
from mapspeak.driving.drivereport import DriveReport
from mapspeak.driving.exploration.trips import TripContext
from mapspeak.driving.routes.ordering import RouteOrder
from mapspeak.driving.routes.planning import RoutePlan, StopState, WhenBlocked, plan_route
from mapspeak.errors import GoalError, NextStep
from mapspeak.geometry import Pose
from mapspeak.places.goalcheck import GoalCheck, check_goal
from mapspeak.places.relations.choosing import CheckedGoal
from mapspeak.places.standing import arrival_pose
from mapspeak.robot import GoalState, GoalStatus, PoseDoubt
from mapspeak.worldmodel.model import WorldModel

SLACK_S = 0.01
ENDED_ELSEWHERE = (GoalState.CANCELLED, GoalState.PREEMPTED)


class RouteState(StrEnum):
    """How a route stands when a call ends."""

    DRIVING = "driving"
    AT_STOP = "at_stop"
    PLANNED = "planned"
    BLOCKED = "blocked"
    INTERRUPTED = "interrupted"
    DONE = "done"


@dataclass(frozen=True, slots=True, kw_only=True)
class RouteProgress:
    """How a route stands.

    Attributes:
        plan: The route as planned, and how it stands with each stop.
        pose_doubt: Why the robot may be elsewhere.
        left_m: Of the path to the stop under way; None where none is.
        number: The stop that the robot stands at, or that the call ended for; counted from 0.
        is_pausing: The call ended while the robot stood at a stop as long as was asked for.
        ended: How the drive ended that something interrupted.
        whole_s: Robot time for the whole route with its pauses, at the pace of the drives before;
            None where that is unknown.
    """

    state: RouteState
    plan: RoutePlan
    pose: Pose
    pose_doubt: PoseDoubt | None
    left_m: float | None = None
    number: int | None = None
    is_pausing: bool = False
    ended: GoalStatus | None = None
    whole_s: float | None = None


class RouteBook:
    """The route of one robot, if it has one."""

    def __init__(self, site: TripContext) -> None:
        self._site = site
        self._plan = RoutePlan(stops=(), greedy_m=0.0)
        self._goal_id: str | None = None
        self._pause_until_s: float | None = None
        self._pause_s = 0.0
        self._is_looking = False
        self._advancing = anyio.Lock()

    async def begin(
        self,
        stops: Sequence[str],
        *,
        pause_s: float,
        is_looking: bool,
        order: RouteOrder = RouteOrder.AS_GIVEN,
        end_at: str | None = None,
        when_blocked: WhenBlocked = WhenBlocked.WAIT,
    ) -> RoutePlan:
        """Plan a route that takes the place of the one before, and return it.

        Args:
            is_looking: A call ends at each stop, so that the caller can look.
            order: Whether stops are driven past as they are given, or on the shortest way.
            end_at: A last stop, whatever the order; "start" is where the robot is now.

        Raises:
            GoalError: There is no such place, or no way there.
        """
        plan = await self._plan_route(stops, order, end_at, when_blocked)
        async with self._advancing:
            await self._give_up()
            self._plan = plan
            self._pause_s, self._is_looking, self._pause_until_s = pause_s, is_looking, None
        return plan

    async def plan(
        self,
        stops: Sequence[str],
        *,
        pause_s: float,
        order: RouteOrder,
        end_at: str | None,
        when_blocked: WhenBlocked,
    ) -> RouteProgress:
        """Return a route as planned; the robot and the route it follows stay as they are.

        Raises:
            GoalError: There is no such place, or no way there.
        """
        plan = await self._plan_route(stops, order, end_at, when_blocked)
        here = await self._site.robot.fetch_pose()
        return RouteProgress(
            state=RouteState.PLANNED,
            plan=plan,
            pose=here.pose,
            pose_doubt=here.find_doubt(self._site.robot.now_s),
            whole_s=self._estimate_s(plan, pause_s),
        )

    async def _plan_route(
        self,
        stops: Sequence[str],
        order: RouteOrder,
        end_at: str | None,
        when_blocked: WhenBlocked,
    ) -> RoutePlan:
        world = await self._site.fetch_world_model()
        plan = partial(plan_route, order=order, end_at=end_at, when_blocked=when_blocked)
        return await self._site.compute(partial(plan, world, stops))

    def _estimate_s(self, plan: RoutePlan, pause_s: float) -> float | None:
        pace_mps = self._site.drives.odometer.pace_mps
        return None if pace_mps is None else plan.total_m / pace_mps + len(plan.stops) * pause_s

    async def advance(
        self, *, wait_s: float, when_blocked: WhenBlocked, on_progress: OnProgress
    ) -> RouteProgress:
        """Follow the route until it ends, pauses, or `wait_s` of robot time have passed.

        Cancelling the call cancels the drive and stops the robot.

        Args:
            wait_s: Robot time after which to answer, with the robot still under way.
            when_blocked: What to do about a stop that cannot be reached.

        Raises:
            GoalError: There is no route, or the robot was stopped while a goal was being checked.
            PolicyError: The robot must not drive now, or not there.
        """
        if not self._plan.stops:
            raise GoalError(
                "There is no route to continue.",
                hint="Begin one with its stops.",
                step=NextStep.BEGIN_ROUTE,
            )
        async with self._advancing:
            deadline_s = self._site.robot.now_s + wait_s
            return await self._advance(deadline_s, when_blocked, on_progress)

    async def _advance(
        self, deadline_s: float, when_blocked: WhenBlocked, on_progress: OnProgress
    ) -> RouteProgress:
        await self._forget_ended()
        while (number := self._find_next()) is not None:
            if not await self._pause(deadline_s):
                return await self._tell(RouteState.DRIVING, is_pausing=True)
            if self._goal_id is None and (check := await self._set_out(number)):
                ended = await self._leave_out(number, check, when_blocked)
            else:
                ended = await self._drive(number, deadline_s, when_blocked, on_progress)
            if ended is not None:
                return ended
        return await self._finish(deadline_s)

    async def _forget_ended(self) -> None:
        """Forget a drive that was ended between two calls: this call begins it again."""
        if self._goal_id is not None:
            try:
                report = await self._site.drives.report(self._goal_id)
            except GoalError:
                # So many drives have begun since that this one is forgotten.
                self._goal_id = None
                return
            if report.status.state in ENDED_ELSEWHERE:
                self._goal_id = None

    def _find_next(self) -> int | None:
        ahead = (n for n, stop in enumerate(self._plan.stops) if stop.state is StopState.AHEAD)
        return next(ahead, None)

    async def _set_out(self, number: int) -> GoalCheck | None:
        """Start the drive to a stop; return the check of its pose where it cannot be driven to."""
        goal, drives = self._plan.stops[number].goal, self._site.drives
        with drives.preparing() as ticket:
            world = await self._site.fetch_world_model()
            pose, check = await self._site.compute(lambda: _check(world, goal))
            if not check.is_ok:
                return check
            drive = await drives.start(pose, place=goal.name, ticket=ticket, thing=goal.thing)
        self._goal_id = drive.goal_id
        return None

    async def _drive(
        self, number: int, deadline_s: float, when_blocked: WhenBlocked, on_progress: OnProgress
    ) -> RouteProgress | None:
        """Wait for the drive to a stop; return the answer where the call ends with it."""
        drives, left_s = self._site.drives, deadline_s - self._site.robot.now_s
        report = await drives.wait(self._goal_id, wait_s=max(left_s, 0.0), on_progress=on_progress)
        status = report.status
        if not status.state.is_final:
            return await self._tell(RouteState.DRIVING, report)
        self._goal_id = None
        if status.state is GoalState.ARRIVED:
            self._mark(number, StopState.DONE)
            self._pause_until_s = self._site.robot.now_s + self._pause_s
            is_looking = self._is_looking
            return await self._tell(RouteState.AT_STOP, number=number) if is_looking else None
        if status.state in ENDED_ELSEWHERE:
            return await self._tell(RouteState.INTERRUPTED, number=number, ended=status)
        return await self._leave_out(number, status, when_blocked)

    async def _leave_out(
        self, number: int, obstacle: GoalCheck | GoalStatus, when_blocked: WhenBlocked
    ) -> RouteProgress | None:
        if when_blocked is WhenBlocked.SKIP:
            self._mark(number, StopState.SKIPPED, obstacle)
            return None
        self._mark(number, StopState.AHEAD, obstacle)
        return await self._tell(RouteState.BLOCKED, number=number)

    async def _pause(self, deadline_s: float) -> bool:
        """Stand at a stop as long as was asked for; False where the call ends before."""
        if self._pause_until_s is None:
            return True
        now_s = self._site.robot.now_s
        left_s = min(self._pause_until_s, deadline_s) - now_s
        if left_s > 0:
            await self._site.robot.sleep(left_s)
        if self._site.robot.now_s < self._pause_until_s - SLACK_S:
            return False
        self._pause_until_s = None
        return True

    async def _finish(self, deadline_s: float) -> RouteProgress:
        if not await self._pause(deadline_s):
            return await self._tell(RouteState.DRIVING, is_pausing=True)
        return await self._tell(RouteState.DONE)

    def _mark(
        self, number: int, state: StopState, obstacle: GoalCheck | GoalStatus | None = None
    ) -> None:
        stops = list(self._plan.stops)
        stops[number] = replace(stops[number], state=state, obstacle=obstacle)
        self._plan = replace(self._plan, stops=tuple(stops))

    async def _give_up(self) -> None:
        """End the drive of an older route, so that it does not continue."""
        if self._goal_id is not None:
            with anyio.CancelScope(shield=True), suppress(GoalError):
                await self._site.drives.cancel(self._goal_id)
            self._goal_id = None

    async def _tell(
        self,
        state: RouteState,
        report: DriveReport | None = None,
        *,
        number: int | None = None,
        is_pausing: bool = False,
        ended: GoalStatus | None = None,
    ) -> RouteProgress:
        if report is not None:
            pose, doubt = report.pose, report.pose_doubt
        else:
            here = await self._site.robot.fetch_pose()
            pose, doubt = here.pose, here.find_doubt(self._site.robot.now_s)
        return RouteProgress(
            state=state,
            plan=self._plan,
            pose=pose,
            pose_doubt=doubt,
            left_m=None if report is None else report.status.distance_left_m,
            number=number,
            is_pausing=is_pausing,
            ended=ended,
            whole_s=self._estimate_s(self._plan, self._pause_s),
        )


def _check(world: WorldModel, goal: CheckedGoal) -> tuple[Pose, GoalCheck]:
    """Return the pose for a stop as the robot comes to it from where it is, and judge it."""
    pose = arrival_pose(world, goal.pose.point) if goal.comes_straight_on else goal.pose
    return pose, check_goal(world.grid, world.distances, pose)
