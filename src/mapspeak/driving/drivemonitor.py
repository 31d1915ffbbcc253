"""Looking at a robot that drives: how its drive stands, where it is, and whether it may go on."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from mapspeak.driving.drivereport import Drive, DriveReport
from mapspeak.driving.watchdog import DriveWatchdog, Odometer
from mapspeak.errors import LinkError, MapspeakError
from mapspeak.geometry import Pose
from mapspeak.robot import GoalState, GoalStatus, PoseDoubt, Robot, StampedPose

STALE = (PoseDoubt.OLD_POSE, PoseDoubt.SILENT_POSE, PoseDoubt.CLOCK_STANDS)
WAITS = GoalStatus(state=GoalState.PLANNED, reason="It waits for the drive before it.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """What one look at a drive has shown.

    Attributes:
        status: How it stands, or stood when it was heard last.
        jump_m: How far the pose jumped; None where it did not.
        doubt: What of the robot is missing.
        error: Why.
    """

    status: GoalStatus
    jump_m: float | None = None
    doubt: PoseDoubt | None = None
    error: LinkError | None = None


class DriveMonitor:
    """Looks at one robot; what it saw last is told while the robot is silent.

    Args:
        robot: The robot.
        patience_s: Robot time without any movement after which a drive has timed out.
        wall_s: Tells wall time.
    """

    def __init__(self, robot: Robot, *, patience_s: float, wall_s: Callable[[], float]) -> None:
        self._robot = robot
        self._wall_s = wall_s
        self._watchdog = DriveWatchdog(patience_s=patience_s, wall_s=wall_s)
        self._odometer = Odometer()
        self._seen = StampedPose(Pose(0.0, 0.0), 0.0)
        self._seen_s = 0.0

    @property
    def here(self) -> Pose:
        """Where the robot was seen last."""
        return self._seen.pose

    @property
    def driven_m(self) -> float:
        """How far the robot has come, by its own poses."""
        return self._odometer.driven_m

    def begin(self) -> None:
        """Begin to watch a drive that was just sent."""
        self._watchdog.begin(now_s=self._robot.now_s)

    async def find_robot(self) -> float | None:
        """Look where the robot is; return how far its pose jumped.

        Raises:
            LinkError: The robot does not say where it is.
        """
        self._seen, self._seen_s = await self._robot.fetch_pose(), self._wall_s()
        return self._odometer.take(self._seen)

    async def look(self, drive: Drive) -> Look:
        """Ask how a drive stands and where the robot is."""
        status, doubt = drive.final or drive.heard, PoseDoubt.NO_ANSWER
        try:
            status = await self._fetch_status(drive)
            doubt = PoseDoubt.NO_POSE
            return Look(status=status, jump_m=await self.find_robot())
        except LinkError as error:
            return Look(status=status, doubt=doubt, error=error)

    def knows_place(self, look: Look) -> bool:
        """Return whether a look has shown where the robot is now."""
        return look.error is None and self._seen.find_doubt(self._robot.now_s) not in STALE

    def judge(self, look: Look) -> GoalStatus | None:
        """Return how the drive under way has to end; None where it may go on."""
        if look.error is not None:
            return self._watchdog.note_silence(look.error)
        return self._watchdog.judge(
            look.status, self._seen, jump_m=look.jump_m, now_s=self._robot.now_s
        )

    def tell(self, drive: Drive, look: Look, *, is_stop_owed: bool) -> DriveReport:
        """Return what is known of a drive after a look at it."""
        now_s = self._robot.now_s
        unseen_s = 0.0 if look.error is None else self._wall_s() - self._seen_s
        return DriveReport(
            drive=drive,
            status=_end_of(drive, look.status),
            pose=self._seen.pose,
            pose_age_s=max(self._seen.measure_age_s(now_s), unseen_s),
            pose_doubt=look.doubt or self._seen.find_doubt(now_s),
            silence="" if look.error is None else look.error.message,
            is_stop_owed=is_stop_owed,
            # A simulation that is begun anew sets its clock back.
            elapsed_s=max(now_s - drive.started_s, 0.0),
        )

    async def _fetch_status(self, drive: Drive) -> GoalStatus:
        if drive.robot_goal_id is None:
            return drive.final or WAITS
        try:
            return await self._robot.fetch_goal_status(drive.robot_goal_id)
        except MapspeakError:
            if drive.final is None:
                raise
            return drive.final


def _end_of(drive: Drive, heard: GoalStatus) -> GoalStatus:
    """Return how a drive stands: once it has ended as then, with what became of it since."""
    return heard if drive.final is None else replace(drive.final, afterwards=heard.afterwards)
