"""Watching a robot that drives: how its drive stands, signs that it is over, a stop still owed."""

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import anyio

from mapspeak.driving.drivereport import Drive, DriveReport
from mapspeak.errors import LinkError, MapspeakError
from mapspeak.geometry import Pose
from mapspeak.robot import Cause, CauseCode, GoalState, GoalStatus, PoseDoubt, Robot, StampedPose
from mapspeak.safety import NOBODY, calling

PATIENCE_S = 60.0
"""Robot time without any movement after which a drive has timed out."""
MOVED_M = 0.1
TURNED_RAD = math.radians(10)
JUMP_M = 1.0
FASTEST_DRIVE_MPS = 3.0
"""No indoor robot drives faster; what the pose moves beyond this and a slack is a jump."""
SILENT_FOR_S = 10.0
"""Wall time without state or pose after which a drive counts as lost."""
STEP_M = 0.05
"""A pose that has moved less may only have wavered."""
LEAST_PACED_M = 1.0
"""Shorter drives say nothing of the pace: they are mostly turning and stopping."""
LEAST_LOOK_S = 1.0
"""Wall time that a robot is given to answer, however short the wait is that was asked for."""
STALE = (PoseDoubt.OLD_POSE, PoseDoubt.SILENT_POSE, PoseDoubt.CLOCK_STANDS)
WAITS = GoalStatus(state=GoalState.PLANNED, cause=Cause(code=CauseCode.WAITING))
NEWS_S = 0.5
"""Wall time from the robot's return until its navigation has told how goals stand."""
NEEDS_NO_STOP = (GoalState.ARRIVED, GoalState.CANCELLED, GoalState.PREEMPTED)
"""Navigation has ended these itself; what a newer goal has replaced, that drives on with."""
logger = logging.getLogger(__name__)


class Odometer:
    """Adds up how far a robot has come, by the stamps of its poses; jumps are not driven."""

    def __init__(self) -> None:
        self.driven_m = 0.0
        self._begun_m = self._begun_s = 0.0
        self._paced_m = self._paced_s = 0.0
        self._counted: Pose | None = None
        self._before: StampedPose | None = None

    @property
    def pace_mps(self) -> float | None:
        """The mean speed of the drives that arrived, turns and waits included; None before one."""
        return self._paced_m / self._paced_s if self._paced_s > 0 else None

    def begin(self, now_s: float) -> None:
        """Note when a drive sets out."""
        self._begun_m, self._begun_s = self.driven_m, now_s

    def arrive(self, now_s: float) -> None:
        """Note when it has arrived."""
        drive_m, drive_s = self.driven_m - self._begun_m, now_s - self._begun_s
        if drive_m >= LEAST_PACED_M and drive_s > 0:
            self._paced_m += drive_m
            self._paced_s += drive_s
        self.begin(now_s)

    def take(self, here: StampedPose) -> float | None:
        """Add the way since the pose before, and return how far that jumped; None if it did not.

        A pose without a newer stamp says nothing of the way: part of it may be old.
        """
        before = self._before
        if before is not None and here.stamp_s == before.stamp_s:
            return None
        self._before = here
        if before is None or self._counted is None or here.stamp_s < before.stamp_s:
            self._counted = here.pose
            return None
        moved_m = before.pose.point.distance_to(here.pose.point)
        if moved_m > JUMP_M + FASTEST_DRIVE_MPS * (here.stamp_s - before.stamp_s):
            self._counted = here.pose
            return moved_m
        step_m = self._counted.point.distance_to(here.pose.point)
        if step_m >= STEP_M:
            self.driven_m += step_m
            self._counted = here.pose
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """What one look at a drive has shown.

    Attributes:
        status: How it stands, or stood when it was heard last.
        doubt: What of the robot is missing.
        error: Why.
    """

    status: GoalStatus
    doubt: PoseDoubt | None = None
    error: LinkError | None = None


class DriveMonitor:
    """Looks at one robot and watches its drive; what it saw last is told in a silence.

    Args:
        robot: The robot.
        patience_s: Robot time without any movement after which a drive has timed out.
        wall_s: Tells wall time.
    """

    def __init__(self, robot: Robot, *, patience_s: float, wall_s: Callable[[], float]) -> None:
        self._robot = robot
        self._patience_s = patience_s
        self._wall_s = wall_s
        self.odometer = Odometer()
        self._seen = StampedPose(Pose(0.0, 0.0), 0.0)
        self._seen_s = 0.0
        self.begin()

    @property
    def here(self) -> Pose:
        """Where the robot was seen last."""
        return self._seen.pose

    def begin(self) -> None:
        """Begin to watch a drive that was just sent."""
        self.odometer.begin(self._robot.now_s)
        self._moved_s = self._robot.now_s
        self._moved_at: Pose | None = None
        self._heard_s: float | None = None
        self._is_silent = False
        self._jump_m: float | None = None

    async def find_robot(self) -> None:
        """Look where the robot is.

        Raises:
            LinkError: The robot does not say where it is.
        """
        self._seen, self._seen_s = await self._robot.fetch_pose(), self._wall_s()
        jump_m = self.odometer.take(self._seen)
        # Kept until the drive under way is judged: this look may be for another.
        self._jump_m = self._jump_m if jump_m is None else jump_m

    async def look(self, drive: Drive, *, within_s: float = PATIENCE_S) -> Look:
        """Ask how a drive stands and where the robot is, by wall time within so long."""
        status, doubt = drive.final or drive.heard, PoseDoubt.NO_ANSWER
        try:
            with anyio.fail_after(max(within_s, LEAST_LOOK_S)):
                status = await self._fetch_status(drive)
                doubt = PoseDoubt.NO_POSE
                await self.find_robot()
            if drive.final is None and status.state is GoalState.ARRIVED:
                self.odometer.arrive(self._robot.now_s)
            return Look(status=status)
        except LinkError as error:
            return Look(status=status, doubt=doubt, error=error)
        except TimeoutError:
            late = LinkError("The robot has not answered in time.", hint="Wait, then ask again.")
            return Look(status=status, doubt=doubt, error=late)

    async def _fetch_status(self, drive: Drive) -> GoalStatus:
        if drive.robot_goal_id is None:
            return drive.final or WAITS
        try:
            return await self._robot.fetch_goal_status(drive.robot_goal_id)
        except MapspeakError:
            if drive.final is None:
                raise
            return drive.final

    def knows_place(self, look: Look) -> bool:
        """Return whether a look has shown where the robot is now."""
        return look.error is None and self._seen.find_doubt(self._robot.now_s) not in STALE

    def judge(self, look: Look) -> GoalStatus | None:
        """Return how the drive under way has to end; None where it may go on."""
        if look.error is not None or self._seen.is_clock_still:
            return self._judge_silence(look.error)
        if self._is_silent:
            # What happened in the silence is unknown: the robot may have moved all the time.
            self._moved_at = None
        self._heard_s, self._is_silent = self._wall_s() - self._seen.silent_s, False
        if self._jump_m is not None:
            cause = Cause(code=CauseCode.POSE_JUMPED, distance_m=self._jump_m)
            return GoalStatus(state=GoalState.LOST, cause=cause)
        return self._judge_progress(look.status)

    def _judge_silence(self, error: LinkError | None) -> GoalStatus | None:
        """Return that a drive is lost after a while without an answer, or without robot time.

        Where that stands nothing else that is measured in it would ever end the drive.
        """
        now_s = self._wall_s()
        self._heard_s = now_s if self._heard_s is None else self._heard_s
        self._is_silent = True
        silent_s = now_s - self._heard_s
        if silent_s < SILENT_FOR_S:
            return None
        code, quote = CauseCode.CLOCK_STANDS, ""
        if error is not None and not self._seen.is_clock_still:
            code, quote = CauseCode.ROBOT_SILENT, error.message
        cause = Cause(code=code, after_s=silent_s, quote=quote)
        return GoalStatus(state=GoalState.LOST, cause=cause)

    def _judge_progress(self, status: GoalStatus) -> GoalStatus | None:
        at, now_s = self._moved_at, self._robot.now_s
        stands = at is not None and at.is_near(self.here, off_m=MOVED_M, turn_rad=TURNED_RAD)
        if not stands or now_s < self._moved_s:
            self._moved_at, self._moved_s = self.here, now_s
        still_s = now_s - self._moved_s
        if still_s < self._patience_s:
            return None
        has_begun = status.state is not GoalState.ACCEPTED
        code = CauseCode.NOT_MOVED if has_begun else CauseCode.NOT_BEGUN
        return GoalStatus(
            state=GoalState.TIMED_OUT,
            distance_left_m=status.distance_left_m,
            n_recoveries=status.n_recoveries,
            cause=Cause(code=code, after_s=still_s),
        )

    def tell(self, drive: Drive, look: Look, *, is_stop_owed: bool) -> DriveReport:
        """Return what is known of a drive after a look at it."""
        now_s, status = self._robot.now_s, look.status
        if drive.final is not None:
            # Once it has ended as then, with what became of it since.
            status = replace(drive.final, afterwards=status.afterwards)
        unseen_s = 0.0 if look.error is None else self._wall_s() - self._seen_s
        until_s = now_s if drive.ended_s is None else drive.ended_s
        until_m = self.odometer.driven_m if drive.ended_m is None else drive.ended_m
        return DriveReport(
            drive=drive,
            status=status,
            pose=self._seen.pose,
            pose_age_s=max(self._seen.measure_age_s(now_s), unseen_s),
            pose_doubt=look.doubt or self._seen.find_doubt(now_s),
            silence="" if look.error is None else look.error.message,
            is_stop_owed=is_stop_owed,
            # A simulation that is begun anew sets its clock back.
            elapsed_s=max(until_s - drive.started_s, 0.0),
            driven_m=0.0 if drive.robot_goal_id is None else until_m - drive.begun_m,
        )


class OwedStop:
    """The stop that is owed to one robot, if any.

    Attributes:
        goal_id: Of the drive it is owed for; None where nothing is owed.
    """

    def __init__(self, robot: Robot, *, wall_s: Callable[[], float]) -> None:
        self._robot = robot
        self._wall_s = wall_s
        self._stopping = anyio.Lock()
        self._answered_s: float | None = None
        self._has_warned = False
        self.goal_id: str | None = None

    def owe(self, goal_id: str) -> None:
        """Note that a drive has to be stopped."""
        self.goal_id, self._answered_s, self._has_warned = goal_id, None, False

    def forgive(self) -> None:
        """Note that nothing has to be stopped any more."""
        self.goal_id = None

    async def wait_for_stop(self) -> None:
        """Return when no stop is being sent: it would end what is sent meanwhile."""
        async with self._stopping:
            return

    async def stop(self) -> None:
        """Stop the robot where that is owed; what fails stays owed."""
        async with self._stopping:
            owed = self.goal_id
            if owed is None:
                return
            try:
                with anyio.CancelScope(shield=True), calling(NOBODY):
                    await self._robot.stop()
            except MapspeakError as error:
                if not self._has_warned:
                    logger.warning("%s could not be stopped yet: %s", owed, error)
                self._has_warned = True
                return
            if self.goal_id == owed:
                self.forgive()

    async def settle(self, drive: Drive) -> GoalStatus | None:
        """Stop the drive a stop is owed for, unless it has ended by itself; return how it has.

        A robot that is back needs a moment to tell how its goals stand.
        """
        try:
            truth = await self._robot.fetch_goal_status(drive.robot_goal_id or "")
        except LinkError:
            # Out of reach, or only its state is: then it can be stopped.
            self._answered_s = None
            await self.stop()
            return None
        if self.goal_id != drive.goal_id:
            return None
        if truth.state in NEEDS_NO_STOP:
            self.forgive()
            return truth
        now_s = self._wall_s()
        self._answered_s = now_s if self._answered_s is None else self._answered_s
        if truth.state.is_final or now_s - self._answered_s >= NEWS_S:
            await self.stop()
        return None
