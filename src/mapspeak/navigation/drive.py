"""Drives as jobs: sent, asked about later by their id, waited for, cancelled; one at a time.

A drive's state is the robot's own account of it, fetched when somebody asks; nothing runs in the
background, so a simulated robot's time stands still between two questions. `watch` asks where
nobody else does, so that a drive ends also when the robot falls silent, jumps or does not move.
"""

import re
from collections.abc import Awaitable, Callable, Generator
from contextlib import contextmanager
from dataclasses import replace

import anyio

from mapspeak.errors import GoalError, LinkError, MapspeakError
from mapspeak.geometry import Point, Pose
from mapspeak.navigation.drivereport import Drive, DriveReport
from mapspeak.navigation.safety import WhenBusy
from mapspeak.navigation.vigil import Vigil
from mapspeak.robot import GoalState, GoalStatus, Robot, StampedPose

__all__ = ["Drive", "DriveBook", "DriveReport"]

POLL_S = 0.2
PROGRESS_S = 1.0
N_KEPT = 200
N_BLOCKED_KEPT = 8
FRONTIER = re.compile(r"F\d+")


OnProgress = Callable[[DriveReport], Awaitable[None]]


class DriveBook:
    """Every drive of one robot, the latest last.

    Args:
        robot: The robot.
        when_busy: What becomes of a drive while one of another client is under way.
        patience_s: Robot time without any movement after which a drive has timed out.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        when_busy: WhenBusy = WhenBusy.REPLACE,
        patience_s: float = 60.0,
    ) -> None:
        self._robot = robot
        self._when_busy = when_busy
        self._vigil = Vigil(patience_s=patience_s)
        self._last_seen: StampedPose | None = None
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
        return next((each for each in self._open() if each.robot_goal_id is not None), None)

    @property
    def last_ended(self) -> Drive | None:
        """The drive that was started last of those that have ended, as far as anyone has asked."""
        return next((each for each in reversed(self._drives.values()) if each.final), None)

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
        """True while a drive is under way, waits its turn or is being prepared."""
        return bool(self._open()) or self._n_preparing > 0

    @contextmanager
    def preparing(self) -> Generator[int]:
        """Marks that a goal is being checked, and gives the ticket to start its drive with."""
        self._n_preparing += 1
        try:
            yield self._n_stops
        finally:
            self._n_preparing -= 1

    async def start(
        self,
        goal: Pose,
        *,
        place: str,
        ticket: int,
        client: str = "",
        when_busy: WhenBusy | None = None,
    ) -> Drive:
        """Sends a goal to the robot, or lets it wait its turn.

        Args:
            goal: Where to.
            place: What it was called.
            ticket: From `preparing`.
            client: Who asks.
            when_busy: What becomes of it while another drive is under way; by default a newer
                drive of the same client replaces the older one.

        Raises:
            GoalError: The robot was stopped after the ticket was given, or another drive is under
                way that must not be replaced.
            PolicyError: The robot must not drive there.
        """
        async with self._starting:
            busy = await self._find_busy()
            begun_at = await self._find_begin()
            self._check_ticket(ticket)
            if busy is None or self._choose(busy, client, when_busy) is WhenBusy.REPLACE:
                sent_s = self._robot.now_s
                drive = self._note(goal, place, client, await self._robot.send_goal(goal))
                drive = self._keep(replace(drive, begun_at=begun_at, started_s=sent_s))
                self._vigil.begin(drive.goal_id, now_s=self._robot.now_s)
                self._end_all("A newer goal took its place.", but=drive)
                return drive
            if self._choose(busy, client, when_busy) is WhenBusy.WAIT:
                return self._note(goal, place, client, None)
            raise GoalError(
                f"{busy.goal_id} to {busy.place} is under way.",
                hint="Wait for its end with wait_for_goal, or end it with cancel_goal.",
            )

    async def report(self, goal_id: str | None = None) -> DriveReport:
        """Gives how a drive stands; the latest one when no id is given.

        Raises:
            GoalError: No drive has that id.
            LinkError: The robot does not answer.
        """
        if goal_id is None and not self._drives:
            await self._check_foreign_goals()
        drive = self._find(goal_id)
        status = drive.final or await self._fetch_status(drive)
        drive = self._note_end(drive, status)
        stamped = await self._fetch_pose(is_over=status.state.is_final)
        if drive.final is not None and drive.ended_at is None:
            drive = self._keep(replace(drive, ended_at=stamped.pose.point))
        if drive.final is None and drive.robot_goal_id is not None:
            fault = self._vigil.judge(status, stamped.pose, now_s=self._robot.now_s)
            if fault is not None:
                return await self._give_up(drive, fault)
        elapsed_s = self._robot.now_s - drive.started_s
        return DriveReport(drive=drive, status=status, pose=stamped.pose, elapsed_s=elapsed_s)

    async def watch(self) -> None:
        """Looks after the drive under way, and starts the next one; to be called now and then."""
        drive = self.under_way
        if drive is not None:
            try:
                await self.report(drive.goal_id)
            except LinkError as error:
                fault = self._vigil.note_silence(error)
                if fault is not None:
                    self._note_end(drive, fault)
        await self._start_next()

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
            await self._start_next()
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
        if report.drive.robot_goal_id is None:
            status = GoalStatus(state=GoalState.CANCELLED, reason="It was cancelled.")
            self._note_end(report.drive, status)
        else:
            with anyio.CancelScope(shield=True):
                await self._robot.cancel_goal(report.drive.robot_goal_id)
        return await self.report(report.drive.goal_id)

    async def stop(self, reason: str = "The robot was stopped.") -> None:
        """Stops the robot and ends what was under way; what is being prepared does not start."""
        self._n_stops += 1
        with anyio.CancelScope(shield=True):
            await self._robot.stop()
            drive = self.under_way
            self._dismiss(reason)
            if drive is not None:
                report = await self.report(drive.goal_id)
                if report.status.state is GoalState.CANCELLED:
                    self._keep(replace(report.drive, final=replace(report.status, reason=reason)))

    # --- inside ---

    def _open(self) -> list[Drive]:
        """Gives the drives that have not ended, in their order."""
        return [each for each in self._drives.values() if each.final is None]

    def _waiting(self) -> list[Drive]:
        """Gives the drives that wait their turn, in their order."""
        return [each for each in self._open() if each.robot_goal_id is None]

    def _dismiss(self, reason: str) -> None:
        """Ends the drives that wait."""
        for drive in self._waiting():
            self._note_end(drive, GoalStatus(state=GoalState.CANCELLED, reason=reason))

    async def _find_busy(self) -> Drive | None:
        """Finds the drive that is under way, after asking the robot whether it has ended."""
        drive = self.under_way
        if drive is not None:
            await self.report(drive.goal_id)
        return self.under_way

    def _check_ticket(self, ticket: int) -> None:
        if ticket != self._n_stops:
            raise GoalError(
                "The robot was stopped while this goal was being checked.",
                hint="Call navigate_to again when it may drive.",
            )

    def _choose(self, busy: Drive, client: str, when_busy: WhenBusy | None) -> WhenBusy:
        if when_busy is not None:
            return when_busy
        return WhenBusy.REPLACE if busy.client == client else self._when_busy

    def _note(self, goal: Pose, place: str, client: str, robot_goal_id: str | None) -> Drive:
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

    def _end_all(self, reason: str, *, but: Drive) -> None:
        """Notes that all drives but one are over: the robot has one goal."""
        status = GoalStatus(state=GoalState.PREEMPTED, reason=reason)
        for drive in self._open():
            if drive.goal_id != but.goal_id:
                self._note_end(drive, status)

    async def _start_next(self) -> None:
        """Sends the next drive that waits, once the one before it has ended."""
        if not self._waiting():
            return
        async with self._starting:
            if await self._find_busy() is not None or not self._waiting():
                return
            drive, sent_s = self._waiting()[0], self._robot.now_s
            try:
                robot_goal_id = await self._robot.send_goal(drive.goal)
            except MapspeakError as error:
                self._note_end(drive, GoalStatus(state=GoalState.REJECTED, reason=str(error)))
                return
            self._keep(replace(drive, robot_goal_id=robot_goal_id, started_s=sent_s))
            self._vigil.begin(drive.goal_id, now_s=self._robot.now_s)

    async def _fetch_status(self, drive: Drive) -> GoalStatus:
        if drive.robot_goal_id is None:
            return GoalStatus(state=GoalState.PLANNED, reason="It waits for the drive before it.")
        return await self._robot.fetch_goal_status(drive.robot_goal_id)

    async def _fetch_pose(self, *, is_over: bool) -> StampedPose:
        """Gives where the robot is; of a drive that is over, where it was seen last will do."""
        try:
            self._last_seen = await self._robot.fetch_pose()
        except LinkError:
            if not is_over or self._last_seen is None:
                raise
        return self._last_seen

    async def _find_begin(self) -> Point | None:
        """Gives where a drive begins; None of a robot that does not say."""
        try:
            return (await self._fetch_pose(is_over=False)).pose.point
        except LinkError:
            return None

    async def _give_up(self, drive: Drive, fault: GoalStatus) -> DriveReport:
        """Ends a drive that must not go on; the robot comes to a stand."""
        self._note_end(drive, fault)
        self._dismiss(f"The drive before it has ended: {fault.reason}")
        with anyio.CancelScope(shield=True):
            await self._robot.stop()
        return await self.report(drive.goal_id)

    async def _check_foreign_goals(self) -> None:
        goals = await self._robot.fetch_foreign_goals()
        if goals:
            raise GoalError(
                f"No drive of ours is under way, but {len(goals)} that somebody else has sent: "
                f"{', '.join(goals)}.",
                hint="The robot moves by itself: wait, or end it with stop_robot.",
            )

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
            return self._keep(replace(drive, final=status))
        return drive

    def _keep(self, drive: Drive) -> Drive:
        self._drives[drive.goal_id] = drive
        return drive

    def _forget_old(self) -> None:
        while len(self._drives) > N_KEPT:
            del self._drives[next(iter(self._drives))]
