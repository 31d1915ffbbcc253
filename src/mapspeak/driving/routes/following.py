"""A route under way: which stops are done, which comes next, and why one was left out.

It advances only while somebody waits for it, and a drive that was ended from elsewhere is begun
again with the next call.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import anyio

from mapspeak.driving.drive import OnProgress
from mapspeak.driving.drivereport import DriveReport
from mapspeak.driving.exploration import Site
from mapspeak.driving.routes.planning import Candidate, RoutePlan, plan_route
from mapspeak.errors import GoalError
from mapspeak.geometry import Pose
from mapspeak.places.goalcheck import GoalCheck, check_goal, say_check
from mapspeak.places.standing import arrival_pose
from mapspeak.robot import GoalState, PoseDoubt
from mapspeak.worldmodel.model import Atlas

SLACK_S = 0.01
ENDED_ELSEWHERE = (GoalState.CANCELLED, GoalState.PREEMPTED)


class StopState(StrEnum):
    """How it stands with one stop."""

    AHEAD = "ahead"
    DONE = "done"
    SKIPPED = "skipped"


class RouteState(StrEnum):
    """How a route stands when a call ends."""

    DRIVING = "driving"
    AT_STOP = "at_stop"
    BLOCKED = "blocked"
    INTERRUPTED = "interrupted"
    DONE = "done"


class WhenBlocked(StrEnum):
    """What becomes of a route when a stop cannot be reached."""

    WAIT = "wait"
    SKIP = "skip"


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """One stop of a route.

    Attributes:
        words: As it was asked for.
        goal: What it is taken for.
        leg_m: The path to it from the stop before, as planned.
        state: How it stands.
        reason: Why it was left out, or could not be reached yet.
    """

    words: str
    goal: Candidate
    leg_m: float
    state: StopState = StopState.AHEAD
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class RouteProgress:
    """How a route stands.

    Attributes:
        state: At the end of the call.
        plan: The route as planned.
        stops: All of them.
        pose: Where the robot is.
        pose_doubt: Why it may be elsewhere.
        left_m: Of the path to the stop under way; None where none is.
        sentence: Why the call ended so.
    """

    state: RouteState
    plan: RoutePlan
    stops: tuple[Stop, ...]
    pose: Pose
    pose_doubt: PoseDoubt | None
    sentence: str
    left_m: float | None = None


class RouteBook:
    """The route of one robot, if it has one.

    Args:
        site: The robot, its drives and its map.
    """

    def __init__(self, site: Site) -> None:
        self._site = site
        self._plan: RoutePlan | None = None
        self._stops: list[Stop] = []
        self._goal_id: str | None = None
        self._pause_until_s: float | None = None
        self._pause_s = 0.0
        self._is_looking = False
        self._advancing = anyio.Lock()

    async def begin(self, stops: Sequence[str], *, pause_s: float, is_looking: bool) -> None:
        """Plans a route that takes the place of the one before.

        Args:
            stops: In their order.
            pause_s: Robot time to stand at each.
            is_looking: A call ends at each stop, so that somebody can look.

        Raises:
            GoalError: There is no such place, or no way there.
        """
        atlas = await self._site.fetch_atlas()
        plan = await self._site.compute(lambda: plan_route(atlas, stops))
        async with self._advancing:
            await self._give_up()
            self._plan = plan
            self._stops = [
                Stop(words=words, goal=goal, leg_m=leg_m)
                for words, goal, leg_m in zip(plan.stops, plan.chosen, plan.legs_m, strict=True)
            ]
            self._pause_s, self._is_looking, self._pause_until_s = pause_s, is_looking, None

    async def advance(
        self, *, wait_s: float, when_blocked: WhenBlocked, on_progress: OnProgress, client: str = ""
    ) -> RouteProgress:
        """Follows the route until it ends, pauses, or so much robot time has passed.

        Whoever gives up waiting gives up the drive: the robot comes to a stand.

        Args:
            wait_s: Robot time after which to answer, with the robot still under way.
            when_blocked: What to do about a stop that cannot be reached.
            on_progress: Told about the drive, about every second.
            client: Who asks for it.

        Raises:
            GoalError: There is no route, or the robot was stopped while a goal was being checked.
            PolicyError: The robot must not drive now, or not there.
        """
        if self._plan is None:
            raise GoalError(
                "There is no route to go on with.", hint="Call follow_route with its stops."
            )
        async with self._advancing:
            deadline_s = self._site.robot.now_s + wait_s
            return await self._advance(deadline_s, when_blocked, on_progress, client)

    async def _advance(
        self, deadline_s: float, when_blocked: WhenBlocked, on_progress: OnProgress, client: str
    ) -> RouteProgress:
        await self._forget_ended()
        while (number := self._find_next()) is not None:
            if not await self._pause(deadline_s):
                return await self._tell(RouteState.DRIVING, "The robot pauses at a stop.")
            if self._goal_id is None and (fault := await self._set_out(number, client)):
                ended = await self._leave_out(number, fault, when_blocked)
            else:
                ended = await self._drive(number, deadline_s, when_blocked, on_progress)
            if ended is not None:
                return ended
        return await self._finish(deadline_s)

    async def _forget_ended(self) -> None:
        """Forgets a drive that was ended between two calls: this call begins it again."""
        if self._goal_id is not None:
            report = await self._site.drives.report(self._goal_id)
            if report.status.state in ENDED_ELSEWHERE:
                self._goal_id = None

    def _find_next(self) -> int | None:
        ahead = (n for n, stop in enumerate(self._stops) if stop.state is StopState.AHEAD)
        return next(ahead, None)

    async def _set_out(self, number: int, client: str) -> str:
        """Starts the drive to a stop; gives why it could not where it could not."""
        goal, drives = self._stops[number].goal, self._site.drives
        with drives.preparing() as ticket:
            atlas = await self._site.fetch_atlas()
            pose, check = await self._site.compute(lambda: _check(atlas, goal))
            if not check.is_ok:
                return say_check(check)
            drive = await drives.start(pose, place=goal.title, ticket=ticket, client=client)
        self._goal_id = drive.goal_id
        return ""

    async def _drive(
        self, number: int, deadline_s: float, when_blocked: WhenBlocked, on_progress: OnProgress
    ) -> RouteProgress | None:
        """Waits for the drive to a stop; gives the answer where the call ends with it."""
        drives, left_s = self._site.drives, deadline_s - self._site.robot.now_s
        report = await drives.wait(self._goal_id, wait_s=max(left_s, 0.0), on_progress=on_progress)
        state, reason = report.status.state, report.status.reason
        if not state.is_final:
            return await self._tell(RouteState.DRIVING, "There are stops left.", report)
        self._goal_id = None
        if state is GoalState.ARRIVED:
            self._mark(number, StopState.DONE)
            self._pause_until_s = self._site.robot.now_s + self._pause_s
            sentence = f"The robot stands at stop {number + 1}, {self._stops[number].words}."
            return await self._tell(RouteState.AT_STOP, sentence) if self._is_looking else None
        if state in ENDED_ELSEWHERE:
            sentence = reason or f"The drive to stop {number + 1} was {state}."
            return await self._tell(RouteState.INTERRUPTED, sentence)
        return await self._leave_out(number, reason or f"the drive was {state}", when_blocked)

    async def _leave_out(
        self, number: int, reason: str, when_blocked: WhenBlocked
    ) -> RouteProgress | None:
        if when_blocked is WhenBlocked.SKIP:
            self._mark(number, StopState.SKIPPED, reason)
            return None
        self._mark(number, StopState.AHEAD, reason)
        sentence = f"Stop {number + 1}, {self._stops[number].words}: {reason}"
        return await self._tell(RouteState.BLOCKED, sentence)

    async def _pause(self, deadline_s: float) -> bool:
        """Stands at a stop as long as was asked for; False where the call ends before."""
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
            return await self._tell(RouteState.DRIVING, "The robot pauses at the last stop.")
        skipped = sum(stop.state is StopState.SKIPPED for stop in self._stops)
        left_out = f", {skipped} of them left out" if skipped else ""
        return await self._tell(RouteState.DONE, f"No stop is left{left_out}.")

    def _mark(self, number: int, state: StopState, reason: str = "") -> None:
        self._stops[number] = replace(self._stops[number], state=state, reason=reason)

    async def _give_up(self) -> None:
        """Ends the drive of an older route, so that none of it goes on."""
        if self._goal_id is not None:
            with anyio.CancelScope(shield=True):
                await self._site.drives.cancel(self._goal_id)
            self._goal_id = None

    async def _tell(
        self, state: RouteState, sentence: str, report: DriveReport | None = None
    ) -> RouteProgress:
        assert self._plan is not None  # noqa: S101 - only a route that was begun is told of
        if report is not None:
            pose, doubt = report.pose, report.pose_doubt
        else:
            here = await self._site.robot.fetch_pose()
            pose, doubt = here.pose, here.find_doubt(self._site.robot.now_s)
        return RouteProgress(
            state=state,
            plan=self._plan,
            stops=tuple(self._stops),
            pose=pose,
            pose_doubt=doubt,
            sentence=sentence,
            left_m=None if report is None else report.status.distance_left_m,
        )


def _check(atlas: Atlas, goal: Candidate) -> tuple[Pose, GoalCheck]:
    """Gives the pose for a stop as the robot comes to it from where it is, and judges it."""
    pose = arrival_pose(atlas, goal.pose.point) if goal.comes_straight_on else goal.pose
    return pose, check_goal(atlas.grid, atlas.distances, pose)
