"""Drives as jobs: sent, asked about later by their id, waited for, cancelled; one at a time.

A drive's state is the robot's own account of it, fetched on request; nothing runs in the
background, so a simulated robot's time stands still between two questions. `watch` asks when
no client does, so that a drive also ends when the robot falls silent, jumps or does not move.

A drive that ends otherwise than by arriving, or by the navigation's own word that it was cancelled
or replaced, is stopped; where the robot cannot be reached, as soon as it can.
"""

import logging
from collections.abc import Awaitable, Callable, Generator
from contextlib import contextmanager
from dataclasses import replace

import anyio

from mapspeak.driving.drivemonitor import NEEDS_NO_STOP, PATIENCE_S, DriveMonitor, Look, OwedStop
from mapspeak.driving.drivereport import (
    JUST_SENT,
    Drive,
    DriveReport,
    find_drive,
    refuse_beside,
)
from mapspeak.errors import GoalError, LinkError, MapspeakError, NextStep
from mapspeak.geometry import Pose
from mapspeak.places.relations.choosing import GoalPurpose
from mapspeak.robot import Cause, CauseCode, GoalState, GoalStatus, PoseDoubt, Robot
from mapspeak.safety import WhenBusy, calling, current_caller
from mapspeak.worldmodel.remembered import RememberedThing

POLL_S = 0.2
PROGRESS_S = 1.0
N_KEPT = 200
WAS_STOPPED = Cause(code=CauseCode.STOPPED)
OnProgress = Callable[[DriveReport], Awaitable[None]]

logger = logging.getLogger(__name__)


class DriveBook:
    """Every drive of one robot, the latest last.

    Args:
        when_busy: What becomes of a drive while one of another client is under way.
        patience_s: Robot time without any movement after which a drive has timed out.

    Attributes:
        odometer: How far and how fast the robot has come on its drives, by its own poses.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        when_busy: WhenBusy = WhenBusy.REPLACE,
        patience_s: float = PATIENCE_S,
        wall_s: Callable[[], float] = anyio.current_time,
    ) -> None:
        self._robot = robot
        self._when_busy = when_busy
        self._monitor = DriveMonitor(robot, patience_s=patience_s, wall_s=wall_s)
        self.odometer = self._monitor.odometer
        self._owed = OwedStop(robot, wall_s=wall_s)
        self._drives: dict[str, Drive] = {}
        self._n_started = 0
        self._n_stops = 0
        self._preparing: list[str] = []
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
    def ended(self) -> tuple[Drive, ...]:
        """The drives that have ended, as far as anyone has asked; the oldest first."""
        return tuple(each for each in self._drives.values() if each.final)

    @property
    def is_busy(self) -> bool:
        """True while a drive may be under way, waits its turn or is being prepared."""
        return bool(self._open()) or self._owed.goal_id is not None or bool(self._preparing)

    @property
    def owners(self) -> frozenset[str]:
        """Whose the drive under way is, and the goals that are being prepared."""
        drive = self.under_way
        return frozenset([*self._preparing, *(() if drive is None else (drive.caller.owner,))])

    @property
    def n_stops(self) -> int:
        """How often a stop was asked for here."""
        return self._n_stops

    @contextmanager
    def preparing(self) -> Generator[int]:
        """Mark that a goal is being checked, and return the ticket to start its drive with."""
        owner = current_caller().owner
        self._preparing.append(owner)
        try:
            yield self._n_stops
        finally:
            self._preparing.remove(owner)

    async def start(
        self,
        goal: Pose,
        *,
        place: str,
        ticket: int,
        purpose: GoalPurpose = GoalPurpose.ARRIVE,
        thing: RememberedThing | None = None,
        part_of: Drive | None = None,
    ) -> Drive:
        """Send a goal to the robot, or let it wait its turn.

        A newer drive of the same owner replaces the older one.

        Args:
            ticket: From `preparing`.

        Raises:
            GoalError: The robot was stopped after the ticket was given, or another drive is under
                way that must not be replaced.
            LinkError: The robot cannot be reached, or its pose is unknown.
            PolicyError: The robot must not drive there.
        """
        async with self._starting:
            busy = await self._find_busy()
            await self._monitor.find_robot()
            self._check_ticket(ticket)
            drive = Drive(
                goal_id=f"G{self._n_started + 1}",
                goal=goal,
                place=place,
                robot_goal_id=None,
                started_s=self._robot.now_s,
                caller=current_caller(),
                ticket=ticket,
                purpose=purpose,
                thing=thing,
                part_of=part_of,
            )
            is_other = busy is not None and busy.caller.owner != drive.caller.owner
            when_busy = self._when_busy if is_other else WhenBusy.REPLACE
            if busy is None or when_busy is WhenBusy.REPLACE:
                drive = await self._send(replace(drive, begun_at=self._monitor.here.point))
                self._end_all(Cause(code=CauseCode.REPLACED), but=drive)
                return drive
            if when_busy is not WhenBusy.WAIT:
                refuse_beside(busy)
            self.dismiss(Cause(code=CauseCode.REPLACED), owner=drive.caller.owner)
            return self._keep(drive)

    async def report(
        self, goal_id: str | None = None, *, within_s: float = PATIENCE_S
    ) -> DriveReport:
        """Return how a drive stands, or stood when the robot was heard last; by default the latest.

        A robot that has not answered `within_s` seconds of wall time counts as out of reach.

        Raises:
            GoalError: No drive has that id.
        """
        if goal_id is None and not self._drives:
            await self._check_foreign_goals()
        drive = find_drive(self._drives, goal_id)
        look = await self._monitor.look(drive, within_s=within_s)
        drive = self._drives.get(drive.goal_id, drive)
        if drive.final is None:
            await self._note(drive, look)
            drive = self._drives.get(drive.goal_id, drive)
        if drive.final is not None and drive.ended_at is None and self._monitor.knows_place(look):
            drive = self._keep(replace(drive, ended_at=self._monitor.here.point))
        return self._monitor.tell(drive, look, is_stop_owed=self._owed.goal_id == drive.goal_id)

    async def watch(self) -> None:
        """Look after the drive under way, and start the next one; to be called now and then."""
        if (drive := self.under_way) is not None:
            await self.report(drive.goal_id)
        await self._settle()
        await self._start_next()

    async def wait(
        self, goal_id: str | None, *, wait_s: float, on_progress: OnProgress
    ) -> DriveReport:
        """Wait until a drive ends or that much robot time has passed; return how it stands then.

        Cancelling the wait cancels the drive and stops the robot.
        """
        goal_id = find_drive(self._drives, goal_id).goal_id if self._drives else goal_id
        try:
            return await self._wait(goal_id, wait_s, on_progress)
        except anyio.get_cancelled_exc_class():
            with anyio.CancelScope(shield=True):
                await self.abandon(goal_id)
            raise

    async def _wait(
        self, goal_id: str | None, wait_s: float, on_progress: OnProgress
    ) -> DriveReport:
        told_s, before_s = 0.0, self._robot.now_s
        report = await self.report(goal_id, within_s=wait_s)
        waited_s, before_s = max(self._robot.now_s - before_s, 0.0), self._robot.now_s
        while not report.status.state.is_final and waited_s < wait_s:
            try:
                await self._robot.sleep(pause_s := min(POLL_S, max(wait_s - waited_s, 0.01)))
            except LinkError:
                # The robot's clock stands: its time would be waited for without end.
                return await self.report(report.drive.goal_id, within_s=0.0)
            await self._start_next()
            report = await self.report(report.drive.goal_id, within_s=wait_s - waited_s)
            # A simulation that is begun anew sets its clock back.
            waited_s += max(self._robot.now_s - before_s, pause_s)
            before_s = self._robot.now_s
            if waited_s - told_s >= PROGRESS_S:
                told_s = waited_s
                await on_progress(report)
        return report

    async def abandon(self, goal_id: str | None) -> None:
        """End a drive whose caller gave up; if the robot is out of reach, once it is back."""
        if goal_id not in self._drives:
            return
        try:
            await self.cancel(goal_id)
        except LinkError as error:
            logger.warning("%s could not be cancelled yet: %s", goal_id, error)
            self._owed.owe(goal_id)

    async def cancel(self, goal_id: str | None = None) -> DriveReport:
        """End a drive; one that has already ended is reported as it ended.

        Raises:
            GoalError: No drive has that id.
            LinkError: The robot could not be told.
        """
        report = await self.report(goal_id)
        if report.status.state.is_final:
            return report
        if report.drive.robot_goal_id is None:
            cause = Cause(code=CauseCode.CANCELLED)
            status = GoalStatus(state=GoalState.CANCELLED, cause=cause)
            self._end(report.drive, status)
        else:
            with anyio.CancelScope(shield=True):
                await self._robot.cancel_goal(report.drive.robot_goal_id)
        return await self.report(report.drive.goal_id)

    async def stop(self, cause: Cause = WAS_STOPPED) -> None:
        """Stop the robot and end what was under way; what is being prepared does not start.

        Raises:
            LinkError: The robot could not be told; it is as soon as it can be reached.
        """
        self._n_stops += 1
        with anyio.CancelScope(shield=True):
            self.dismiss(cause)
            if (drive := self.under_way) is not None:
                self._owed.owe(drive.goal_id)
            await self._robot.stop()
            self._owed.forgive()
            if (drive := self.under_way) is not None:
                report = await self.report(drive.goal_id)
                if report.status.state is GoalState.CANCELLED:
                    self._keep(replace(report.drive, final=replace(report.status, cause=cause)))

    def dismiss(self, cause: Cause, *, owner: str | None = None) -> None:
        """End the drives that wait their turn, those of one owner or all."""
        for drive in self._waiting():
            if owner in (None, drive.caller.owner):
                self._end(drive, GoalStatus(state=GoalState.CANCELLED, cause=cause))

    def _open(self) -> list[Drive]:
        """Return the drives that have not ended, in their order."""
        return [each for each in self._drives.values() if each.final is None]

    def _waiting(self) -> list[Drive]:
        """Return the drives that wait their turn, in their order."""
        return [each for each in self._open() if each.robot_goal_id is None]

    async def _find_busy(self) -> Drive | None:
        """Find the drive that is under way, after asking the robot whether it has ended."""
        if (drive := self.under_way) is not None:
            await self.report(drive.goal_id)
        return self.under_way

    def _check_ticket(self, ticket: int) -> None:
        if ticket != self._n_stops:
            raise GoalError(
                "The robot was stopped while this goal was being checked.",
                hint="Send the robot again when it may drive.",
                step=NextStep.DRIVE_AGAIN,
            )

    async def _send(self, drive: Drive) -> Drive:
        """Send a drive to the robot, which gives up whatever it was doing."""
        await self._owed.wait_for_stop()
        self._check_ticket(drive.ticket)
        started_s = self._robot.now_s
        robot_goal_id = await self._robot.send_goal(drive.goal)
        self._owed.forgive()
        self._monitor.begin()
        # It may have been ended while it was sent.
        drive = self._drives.get(drive.goal_id, drive)
        drive = self._keep(
            replace(
                drive,
                started_s=started_s,
                begun_m=self.odometer.driven_m,
                robot_goal_id=robot_goal_id,
                heard=JUST_SENT,
            )
        )
        if drive.final is not None:
            self._owed.owe(drive.goal_id)
            await self._owed.stop()
        return drive

    def _end_all(self, cause: Cause, *, but: Drive) -> None:
        """Note that all drives but one are over: the robot has one goal."""
        status = GoalStatus(state=GoalState.PREEMPTED, cause=cause)
        for drive in self._open():
            if drive.goal_id != but.goal_id:
                self._end(drive, status)

    async def _start_next(self) -> None:
        """Send the next drive that waits, once the one before it has ended."""
        if not self._waiting():
            return
        async with self._starting:
            if await self._find_busy() is not None or not self._waiting():
                return
            drive = self._waiting()[0]
            try:
                with calling(drive.caller):
                    await self._send(drive)
            except MapspeakError as error:
                cause = Cause(code=CauseCode.REFUSED, quote=str(error))
                self._end(drive, GoalStatus(state=GoalState.REJECTED, cause=cause))

    async def _note(self, drive: Drive, look: Look) -> None:
        """Note what a look has shown of a drive, and end one that is over or must not go on."""
        drive = self._keep(replace(drive, heard=look.status))
        end = look.status if look.status.state.is_final else None
        if end is None and drive.robot_goal_id is not None:
            end = self._monitor.judge(look)
            if end is not None:
                self.dismiss(Cause(code=CauseCode.PREVIOUS_ENDED, previous=end.cause))
        if end is None:
            return
        self._end(drive, end)
        if end.state not in NEEDS_NO_STOP:
            self._owed.owe(drive.goal_id)
            # A goal that is being sent takes over from it; a robot out of reach is stopped later.
            if not self._starting.locked() and look.doubt is not PoseDoubt.NO_ANSWER:
                await self._owed.stop()

    async def _settle(self) -> None:
        """Stop what could not be stopped before, or note that it has ended by itself."""
        drive = self._drives.get(self._owed.goal_id or "")
        if drive is None or self._starting.locked():
            return
        truth = await self._owed.settle(drive)
        drive = self._drives.get(drive.goal_id, drive)
        if truth is not None and (drive.final is None or drive.final.state is GoalState.LOST):
            self._keep(replace(drive, final=truth))

    async def _check_foreign_goals(self) -> None:
        goals = await self._robot.fetch_foreign_goals()
        if goals:
            raise GoalError(
                f"The robot follows a goal that was not sent from here: {', '.join(goals)}.",
                hint="Wait for its end, or end it.",
                step=NextStep.WAIT_OR_STOP,
            )

    def _end(self, drive: Drive, status: GoalStatus) -> None:
        """Note how a drive ended; the first word counts."""
        drive = self._drives.get(drive.goal_id, drive)
        if drive.final is None:
            ended_m = self.odometer.driven_m
            self._keep(replace(drive, final=status, ended_s=self._robot.now_s, ended_m=ended_m))

    def _keep(self, drive: Drive) -> Drive:
        self._n_started += drive.goal_id not in self._drives
        self._drives[drive.goal_id] = drive
        for old in self.ended[: max(len(self._drives) - N_KEPT, 0)]:
            del self._drives[old.goal_id]
        return drive
