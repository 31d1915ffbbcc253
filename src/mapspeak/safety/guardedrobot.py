"""A robot behind the guard: the only one that a session and its tools get."""

import logging
from collections import OrderedDict
from dataclasses import replace

import anyio
import anyio.to_thread

from mapspeak.errors import LinkError, MapspeakError, NextStep, PolicyError
from mapspeak.geometry import Pose
from mapspeak.hold import say_hold
from mapspeak.robot import (
    CameraPicture,
    Cause,
    CauseCode,
    Detection,
    GoalState,
    GoalStatus,
    NavigationLook,
    RangeScan,
    Robot,
    RobotDescription,
    StampedPose,
)
from mapspeak.safety.commands import DriveCommand, say_command
from mapspeak.safety.guard import Guard, MapReviser, Permit
from mapspeak.safety.monitor import GoalMonitor, HoldKeeper, KeepOutMonitor, Mover, StandingCheck
from mapspeak.safety.planning import GuardedDrive, Plan, Planner
from mapspeak.safety.teleop import Teleop
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.revision import MapRevision

WATCH_S = 0.1
"""Robot time between two looks at where a drive leads."""
EPSILON_S = 1e-6
REPEAT_S = 0.5
N_KEPT = 200

logger = logging.getLogger(__name__)


class GuardedRobot:
    """A `Robot` that drives only where its policy lets it; stopping is always allowed.

    Args:
        robot: The robot itself; it must not be shared.
        repeat_s: Between two looks whether a held robot stands, in wall time.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        guard: Guard,
        reviser: MapReviser,
        repeat_s: float = REPEAT_S,
    ) -> None:
        self._robot = robot
        self._guard = guard
        self._reviser = reviser
        self._drive: GuardedDrive | None = None
        self._verdicts: OrderedDict[str, GoalStatus] = OrderedDict()
        self._n_stops, self._is_stop_owed = 0, False
        self._watching, self._stepping, self._leading = anyio.Lock(), anyio.Lock(), anyio.Lock()
        self._hold_keeper = HoldKeeper(guard.hold, StandingCheck(robot), repeat_s=repeat_s)
        self.planner = Planner(robot, reviser=reviser, policy=guard.policy)
        self.teleop = Teleop(robot, planner=self.planner, reviser=reviser)
        self._monitor = KeepOutMonitor()

    @property
    def description(self) -> RobotDescription:
        """What is fixed about this robot; its radius includes its clearance."""
        return replace(self._robot.description, radius_m=self.planner.radius_m)

    @property
    def now_s(self) -> float:
        """Robot time."""
        return self._robot.now_s

    async def sleep(self, duration_s: float) -> None:
        """Return when that much robot time has passed; a drive is watched meanwhile."""
        left_s = duration_s
        while self._is_watched and left_s > EPSILON_S:
            before_s, step_s = self.now_s, min(WATCH_S, left_s)
            await self._robot.sleep(step_s)
            await self.obey_hold()
            await self.watch()
            await self.watch_map()
            # A simulation that is begun anew sets its clock back.
            left_s -= max(self.now_s - before_s, step_s)
        await self._robot.sleep(max(left_s, 0.0))

    @property
    def _is_watched(self) -> bool:
        return self._drive is not None or self.teleop.is_under_way or self._reviser.has_rules

    async def fetch_map(self) -> OccupancyGrid:
        """Return the latest map."""
        return await self._robot.fetch_map()

    async def fetch_pose(self) -> StampedPose:
        """Return where the robot believes it is."""
        return await self._robot.fetch_pose()

    async def fetch_picture(self, camera: str | None = None) -> CameraPicture:
        """Take a picture."""
        return await self._robot.fetch_picture(camera)

    async def fetch_foreign_goals(self) -> tuple[GoalState, ...]:
        """Return how goals stand that others have sent."""
        return await self._robot.fetch_foreign_goals()

    async def fetch_detections(self) -> tuple[Detection, ...]:
        """Return what the robot's own object detector reports in the camera view."""
        return await self._robot.fetch_detections()

    async def fetch_scan(self) -> RangeScan | None:
        """Return what the laser meets now; None without one."""
        return await self._robot.fetch_scan()

    async def fetch_navigation(self) -> tuple[NavigationLook, ...]:
        """Return what navigation tells of path, footprint and costmaps."""
        return await self._robot.fetch_navigation()

    async def send_goal(self, goal: Pose) -> str:
        """Start a drive that the policy allows, and return the id it is known by.

        Raises:
            PolicyError: The policy, a hold or a person does not allow it, or it was stopped.
        """
        n_stops = self._n_stops
        if self._is_stop_owed:
            await self.watch()
        plan = await self.planner.plan(goal)
        async with self._stepping:
            pass  # A leg that is on its way must not come after this goal.
        permit = self._guard.clear(DriveCommand(goal=goal, check=plan.check), robot_s=self.now_s)
        if n_stops != self._n_stops:
            raise self._overtaken(permit)
        if self._drive is not None:
            self._give_up_legs(self._drive, CauseCode.REPLACED)
        try:
            robot_goal_id = await self._robot.send_goal(plan.legs[0])
        except BaseException as error:
            # Whether the robot took the goal is unknown: it must not drive unnoticed.
            self._is_stop_owed = True
            with anyio.CancelScope(shield=True):
                self._guard.note_result(permit, _say_error(error), robot_s=self.now_s)
                await self._stop("given up")
            raise
        self._take_up(robot_goal_id, plan, permit)
        if n_stops != self._n_stops:
            with anyio.CancelScope(shield=True):
                await self._stop("stopped")
            raise self._overtaken(permit)
        return robot_goal_id

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        """Return how a drive stands; why it was ended here comes before what the robot says."""
        drive = self._drive
        if drive is not None and drive.goal_id == robot_goal_id:
            status = await self._follow(drive)
            if status.state.is_final:
                status = drive.verdict or status
        else:
            status = await self._robot.fetch_goal_status(robot_goal_id)
        status = self._verdicts.get(robot_goal_id, status)
        self._note_end(robot_goal_id, status)
        return status

    async def cancel_goal(self, robot_goal_id: str) -> None:
        """Ask the navigation to end a drive; never refused."""
        drive = self._drive
        leg_id = robot_goal_id
        if drive is not None and drive.goal_id == robot_goal_id:
            leg_id = drive.leg_id
            self._give_up_legs(drive, CauseCode.CANCELLED)
        try:
            await self._robot.cancel_goal(leg_id)
        finally:
            self._guard.note_event("stop", f"cancelled {robot_goal_id}", robot_s=self.now_s)

    async def stop(self) -> None:
        """End every drive and command zero velocity, at once; never refused."""
        try:
            await self._stop("stopped")
        finally:
            self._guard.latch()

    @property
    def name(self) -> str:
        """What the operator calls the robot."""
        return self._guard.robot or self._robot.description.name

    async def obey_hold(self) -> None:
        """Stop the robot for a hold, and again when it moves; to be called often, and apart.

        Stops that fail are tried again at the next call.
        """
        await self._hold_keeper.obey(self.name, stop=self._stop_for_hold, repeat=self._repeat_stop)

    async def watch(self) -> None:
        """Stop the robot before it enters a closed area, whatever moves it; to be called often."""
        async with self._watching:
            if self._is_stop_owed:
                await self._repeat_stop()
            drive = self._drive
            revision, fault = self._reviser.latest, None
            if revision is not None and revision.areas:
                other = Mover.VELOCITY if self.teleop.is_under_way else Mover.OTHERS
                mover = other if drive is None else Mover.NAVIGATION
                fault = await self._monitor.look(self._robot, revision, mover=mover)
            if drive is not self._drive:
                return
            if fault is None:
                if drive is not None and drive.legs:
                    await self._follow(drive)
            elif drive is not None:
                await self._halt(drive, fault)
            else:
                logger.warning("The robot is stopped: %s.", fault)
                with anyio.CancelScope(shield=True):
                    await self._stop(str(fault))

    async def watch_map(self) -> None:
        """Notice what closes, and stop the robot when its goal is closed or full by now.

        A map may take long to come and to be looked through: `watch` must not wait for it.
        """
        drive = self._drive
        if drive is None and not self._reviser.has_rules:
            return
        try:
            revision = await self.planner.revise_lately()
        except LinkError as error:
            level = logging.DEBUG if drive is None else logging.WARNING
            logger.log(level, "While watching the map: %s", error)
            return
        if drive is None:
            return
        fault = drive.goal_monitor.judge(revision, now_s=self.now_s)
        if drive is not self._drive:
            return
        if fault is not None:
            await self._end(drive, GoalState.BLOCKED, fault)
        elif drive.needs_legs(revision):
            await self._lead(drive, revision)

    # --- inside ---

    def _take_up(self, robot_goal_id: str, plan: Plan, permit: Permit) -> None:
        """Begin to look after a drive that the robot has accepted."""
        if self._drive is not None:
            replaced = GoalStatus(state=GoalState.PREEMPTED, cause=Cause(code=CauseCode.REPLACED))
            self._note_end(self._drive.goal_id, replaced)
        self._is_stop_owed = False
        first, *others = plan.legs
        self._monitor.begin_at(plan.here, now_s=self.now_s)
        self._monitor.seen_at_s = anyio.current_time()
        self._drive = GuardedDrive(
            goal_id=robot_goal_id,
            leg_id=robot_goal_id,
            leg=first,
            legs=others,
            permit=permit,
            map=plan.map,
            goal_monitor=GoalMonitor(goal=plan.legs[-1], radius_m=self.description.radius_m),
        )
        said = f", in {len(plan.legs)} legs round what is closed" if others else ""
        self._guard.note_result(permit, f"accepted as {robot_goal_id}{said}", robot_s=self.now_s)

    async def _follow(self, drive: GuardedDrive) -> GoalStatus:
        """Return how a drive stands, and send the robot on where a leg of it has ended."""
        async with self._stepping:
            if drive.halted is not None and not drive.is_given_up:
                return GoalStatus(state=GoalState.DRIVING)
            status = await self._robot.fetch_goal_status(drive.leg_id)
            if status.state is GoalState.ARRIVED and drive.legs and drive is self._drive:
                further_m = drive.further_m
                await self._send_on(drive)
                return GoalStatus(state=GoalState.DRIVING, distance_left_m=further_m)
        left_m = status.distance_left_m
        if not drive.legs or left_m is None:
            return status
        return replace(status, distance_left_m=left_m + drive.further_m)

    async def _send_on(self, drive: GuardedDrive) -> None:
        if self._guard.hold.read() is not None:
            return
        leg, now_s = drive.legs[0], self.now_s
        try:
            self._guard.note_leg(drive.permit, f"on to ({leg.x:.2f}, {leg.y:.2f})", robot_s=now_s)
            # Who gives up asking how a drive stands does not give up the drive.
            with anyio.CancelScope(shield=True):
                drive.leg_id = await self._robot.send_goal(leg)
        except BaseException as error:
            cause = Cause(code=CauseCode.NOT_SENT_ON, quote=_say_error(error))
            await self._end(drive, GoalState.BLOCKED, cause)
            raise
        drive.leg, drive.legs = leg, drive.legs[1:]
        if drive.is_given_up:
            with anyio.CancelScope(shield=True):
                await self._stop("given up")

    async def _halt(self, drive: GuardedDrive, cause: Cause) -> None:
        """Stop the robot before an area, to be led round it; end the drive for another reason."""
        is_at_area = cause.code is CauseCode.NAVIGATION_AT_AREA and not drive.is_given_up
        if not is_at_area or not drive.halt(cause, self._monitor.here):
            await self._end(drive, GoalState.BLOCKED, cause)
            return
        logger.info("The robot is stopped, to be led round: %s.", cause)
        self._is_stop_owed = True
        with anyio.CancelScope(shield=True):
            await self._repeat_stop()
        self._guard.note_event("stop", str(cause), robot_s=self.now_s)

    async def _lead(self, drive: GuardedDrive, revision: MapRevision) -> None:
        """Send the robot the way that a drive takes on a map where other areas are closed."""
        async with self._leading:
            if drive is not self._drive or not drive.needs_legs(revision):
                return
            here = (await self._robot.fetch_pose()).pose.point
            legs = await anyio.to_thread.run_sync(drive.plan_anew, revision, here)
            if not legs and drive.halted is not None:
                shut = replace(drive.halted, code=CauseCode.NO_WAY_ROUND)
                await self._end(drive, GoalState.BLOCKED, shut)
                return
            async with self._stepping:
                if drive is not self._drive or drive.is_given_up or self._is_stop_owed:
                    return
                drive.map = revision
                if drive.halted is not None or [*legs] != [drive.leg, *drive.legs]:
                    drive.legs, drive.halted = list(legs), None
                    await self._send_on(drive)

    async def _end(self, drive: GuardedDrive, state: GoalState, cause: Cause) -> None:
        """Stop the robot, and only then end the drive, whatever its navigation will say of it."""
        drive.verdict = drive.verdict or GoalStatus(state=state, cause=cause)
        logger.warning("The robot is stopped: %s.", cause)
        with anyio.CancelScope(shield=True):
            await self._stop(str(cause))
        self._note_end(drive.goal_id, drive.verdict)

    async def _stop_for_hold(self, held_by: str) -> None:
        if self._drive is None:
            await self._stop("held")
            return
        cause = Cause(code=CauseCode.HELD, quote=say_hold(held_by))
        await self._end(self._drive, GoalState.CANCELLED, cause)

    async def _repeat_stop(self) -> None:
        await self._robot.stop()
        self.teleop.end_all()
        self._is_stop_owed = False

    async def _stop(self, why: str) -> None:
        self._n_stops += 1
        self._guard.end_scopes()
        if self._drive is not None:
            self._give_up_legs(self._drive, CauseCode.STOPPED)
        try:
            await self._repeat_stop()
        except MapspeakError as error:
            why = f"{why}, but: {error}"
            raise
        finally:
            self._guard.note_event("stop", why, robot_s=self.now_s)

    def _note_end(self, robot_goal_id: str, status: GoalStatus) -> None:
        drive = self._drive
        if drive is None or drive.goal_id != robot_goal_id or not status.state.is_final:
            return
        self._drive = None
        self._verdicts[robot_goal_id] = status
        while len(self._verdicts) > N_KEPT:
            self._verdicts.popitem(last=False)
        said = str(status.state) if status.cause is None else f"{status.state}: {status.cause}"
        self._guard.note_end(drive.permit, said, robot_s=self.now_s)

    def _give_up_legs(self, drive: GuardedDrive, code: CauseCode) -> None:
        """End a drive; where it was to go on after its present leg, its end is not the goal."""
        drive.is_given_up = True
        if drive.legs:
            drive.legs = []
            status = GoalStatus(state=GoalState.CANCELLED, cause=Cause(code=code))
            drive.verdict = drive.verdict or status

    def _overtaken(self, permit: Permit) -> PolicyError:
        what = say_command(permit.command)
        self._guard.note_result(permit, "given up: the robot was stopped", robot_s=self.now_s)
        return PolicyError(
            f"The robot was stopped before it could {what}.",
            hint="Send the goal again when it may drive.",
            step=NextStep.DRIVE_AGAIN,
        )


def _say_error(error: BaseException) -> str:
    return str(error) if isinstance(error, MapspeakError) else f"given up: {type(error).__name__}"
