"""Drives as jobs: sent, asked about later by their id, waited for, cancelled; one at a time.

A drive's state is the robot's own account of it, fetched when somebody asks; nothing runs in the
background, so a simulated robot's time stands still between two questions.
"""

import re
from collections.abc import Awaitable, Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import anyio

from mapspeak.errors import GoalError
from mapspeak.geometry import Point, Pose
from mapspeak.robot import GoalState, GoalStatus, Robot

__all__ = ["Drive", "DriveBook", "DriveReport"]

POLL_S = 0.2
PROGRESS_S = 1.0
N_KEPT = 200
N_BLOCKED_KEPT = 8
FRONTIER = re.compile(r"F\d+")


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """A drive that was sent to the robot.

    Attributes:
        goal_id: The name it goes by: G1, G2, ...
        goal: Where to.
        place: What the goal was called when it was asked for.
        robot_goal_id: What the robot's navigation calls it.
        started_s: Robot time at which it was sent.
        client: Who asked for it; empty where there can be only one.
        final: How it ended, once it has.
    """

    goal_id: str
    goal: Pose
    place: str
    robot_goal_id: str
    started_s: float
    client: str = ""
    final: GoalStatus | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveReport:
    """A drive and how it stands.

    Attributes:
        drive: The drive.
        status: How it stands.
        pose: Where the robot is now.
        elapsed_s: Robot time since the drive was sent.
    """

    drive: Drive
    status: GoalStatus
    pose: Pose
    elapsed_s: float


OnProgress = Callable[[DriveReport], Awaitable[None]]


class DriveBook:
    """Every drive of one robot, the latest last."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._drives: dict[str, Drive] = {}
        self._n_started = 0
        self._n_stops = 0
        self._n_preparing = 0
        self._starting = anyio.Lock()

    @property
    def latest(self) -> Drive | None:
        """The drive that was started last."""
        return next(reversed(self._drives.values()), None)

    @property
    def under_way(self) -> Drive | None:
        """The drive that has not ended yet, as far as anyone has asked."""
        latest = self.latest
        return latest if latest is not None and latest.final is None else None

    @property
    def frontiers_tried(self) -> tuple[Point, ...]:
        """Where the robot has arrived, or lately could not get to, when sent to a frontier.

        One that was blocked is worth another try later, when more is known of the way.
        """
        ended = [drive for drive in self._drives.values() if drive.final is not None]
        lately = {drive.goal_id for drive in ended[-N_BLOCKED_KEPT:]}
        return tuple(
            drive.goal.point
            for drive in ended
            if FRONTIER.fullmatch(drive.place)
            and drive.final is not None
            and (
                drive.final.state is GoalState.ARRIVED
                or (drive.final.state is GoalState.BLOCKED and drive.goal_id in lately)
            )
        )

    @property
    def is_busy(self) -> bool:
        """True while a drive is under way or being prepared."""
        return self.under_way is not None or self._n_preparing > 0

    @contextmanager
    def preparing(self) -> Generator[int]:
        """Marks that a goal is being checked, and gives the ticket to start its drive with."""
        self._n_preparing += 1
        try:
            yield self._n_stops
        finally:
            self._n_preparing -= 1

    async def start(self, goal: Pose, *, place: str, ticket: int, client: str = "") -> Drive:
        """Sends a goal to the robot; a drive that was under way ends as preempted.

        Raises:
            GoalError: The robot was stopped after the ticket was given.
        """
        async with self._starting:
            await self._preempt()
            if ticket != self._n_stops:
                raise GoalError(
                    "The robot was stopped while this goal was being checked.",
                    hint="Call navigate_to again when it may drive.",
                )
            robot_goal_id = await self._robot.send_goal(goal)
            self._n_started += 1
            drive = Drive(
                goal_id=f"G{self._n_started}",
                goal=goal,
                place=place,
                robot_goal_id=robot_goal_id,
                started_s=self._robot.now_s,
                client=client,
            )
            self._drives[drive.goal_id] = drive
            self._forget_old()
            return drive

    async def report(self, goal_id: str | None = None) -> DriveReport:
        """Gives how a drive stands; the latest one when no id is given.

        Raises:
            GoalError: No drive has that id.
        """
        drive = self._find(goal_id)
        status = drive.final or await self._robot.fetch_goal_status(drive.robot_goal_id)
        drive = self._note_end(drive, status)
        stamped = await self._robot.fetch_pose()
        elapsed_s = self._robot.now_s - drive.started_s
        return DriveReport(drive=drive, status=status, pose=stamped.pose, elapsed_s=elapsed_s)

    async def wait(
        self, goal_id: str | None, *, wait_s: float, on_progress: OnProgress
    ) -> DriveReport:
        """Waits until a drive ends or that much robot time has passed; gives how it stands then.

        Whoever gives up waiting gives up the drive: the robot comes to a stand.
        """
        try:
            return await self._wait(goal_id, wait_s, on_progress)
        except anyio.get_cancelled_exc_class():
            with anyio.CancelScope(shield=True):
                await self.cancel(goal_id)
            raise

    async def _wait(
        self, goal_id: str | None, wait_s: float, on_progress: OnProgress
    ) -> DriveReport:
        deadline_s = self._robot.now_s + wait_s
        next_progress_s = self._robot.now_s + PROGRESS_S
        report = await self.report(goal_id)
        while not report.status.state.is_final and self._robot.now_s < deadline_s:
            left_s = deadline_s - self._robot.now_s
            await self._robot.sleep(min(POLL_S, max(left_s, 0.01)))
            report = await self.report(report.drive.goal_id)
            if self._robot.now_s >= next_progress_s:
                next_progress_s += PROGRESS_S
                await on_progress(report)
        return report

    async def cancel(self, goal_id: str | None = None) -> DriveReport:
        """Ends a drive; one that has already ended is reported as it ended."""
        report = await self.report(goal_id)
        if report.status.state.is_final:
            return report
        with anyio.CancelScope(shield=True):
            await self._robot.cancel_goal(report.drive.robot_goal_id)
        return await self.report(report.drive.goal_id)

    async def stop(self, reason: str = "The robot was stopped.") -> None:
        """Stops the robot and ends what was under way; what is being prepared does not start."""
        self._n_stops += 1
        with anyio.CancelScope(shield=True):
            await self._robot.stop()
            drive = self.under_way
            if drive is not None:
                report = await self.report(drive.goal_id)
                if report.status.state is GoalState.CANCELLED:
                    ended = replace(report.drive, final=replace(report.status, reason=reason))
                    self._drives[drive.goal_id] = ended

    def _find(self, goal_id: str | None) -> Drive:
        drive = self.latest if goal_id is None else self._drives.get(goal_id.strip().upper())
        if drive is not None:
            return drive
        if not self._drives:
            raise GoalError(
                "The robot has not been sent anywhere yet.", hint="Call navigate_to first."
            )
        raise GoalError(
            f"There is no goal {str(goal_id)[:40]!r}.",
            hint=f"Known goals are {', '.join(list(self._drives)[-5:])}.",
        )

    def _note_end(self, drive: Drive, status: GoalStatus) -> Drive:
        if drive.final is None and status.state.is_final:
            drive = replace(drive, final=status)
            self._drives[drive.goal_id] = drive
        return drive

    async def _preempt(self) -> None:
        drive = self.under_way
        if drive is None:
            return
        report = await self.report(drive.goal_id)
        if not report.status.state.is_final:
            reason = "A newer goal took its place."
            self._note_end(drive, GoalStatus(state=GoalState.PREEMPTED, reason=reason))

    def _forget_old(self) -> None:
        while len(self._drives) > N_KEPT:
            del self._drives[next(iter(self._drives))]
