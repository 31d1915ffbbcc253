"""A robot behind the guard: the only one that a session and its tools get."""

import logging
from collections import OrderedDict
from contextlib import suppress
from dataclasses import replace

import anyio
import anyio.to_thread

from mapspeak.errors import ConfigError, LinkError, MapspeakError, PolicyError
from mapspeak.geometry import Pose
from mapspeak.navigation.goals import GoalVerdict, check_goal
from mapspeak.navigation.safety.caller import NOBODY, current_caller
from mapspeak.navigation.safety.commands import Drive, say_command
from mapspeak.navigation.safety.guard import Clearance, Guard
from mapspeak.navigation.safety.hold import say_hold
from mapspeak.navigation.safety.legs import plan_legs
from mapspeak.navigation.safety.lookout import Lookout
from mapspeak.navigation.safety.surveying import Surveyor
from mapspeak.navigation.safety.underway import GuardedDrive, Plan
from mapspeak.navigation.safety.velocities import HandDriving
from mapspeak.robot import (
    CameraPicture,
    Detection,
    GoalState,
    GoalStatus,
    RangeScan,
    Robot,
    RobotDescription,
    StampedPose,
)
from mapspeak.spatial import OccupancyGrid

__all__ = ["GuardedRobot"]

WATCH_S = 0.1
"""Robot time between two looks at where a drive leads."""
EPSILON_S = 1e-6
BLIND_S = 2.0
"""Wall time without a pose after which a robot that must keep off some area is stopped."""
SAME_PLACE_M = 0.1
"""A goal no farther away than this is a turn."""
N_KEPT = 200

logger = logging.getLogger(__name__)


class GuardedRobot:
    """A `Robot` that drives only where its policy lets it; stopping is always allowed.

    Args:
        robot: The robot itself; nobody else may have it.
        guard: Decides and notes.
        surveyor: Knows what is closed now.

    Attributes:
        by_hand: Looks after the robot while published velocities drive it.
    """

    def __init__(self, robot: Robot, *, guard: Guard, surveyor: Surveyor) -> None:
        self._robot = robot
        self._guard = guard
        self._surveyor = surveyor
        self._drive: GuardedDrive | None = None
        self._verdicts: OrderedDict[str, GoalStatus] = OrderedDict()
        self._n_stops = 0
        self._answered_hold: str | None = None
        self._watching = anyio.Lock()
        self._stepping = anyio.Lock()
        self._seen_at_s = float("-inf")
        self.by_hand = HandDriving(robot, surveyor=surveyor, radius_m=self.description.radius_m)

    @property
    def description(self) -> RobotDescription:
        """What is fixed about this robot; its radius includes the clearance that it must keep."""
        bare = self._robot.description
        return replace(bare, radius_m=bare.radius_m + self._guard.policy.clearance_m)

    @property
    def now_s(self) -> float:
        """Robot time."""
        return self._robot.now_s

    async def sleep(self, duration_s: float) -> None:
        """Returns when that much robot time has passed; a drive is watched meanwhile."""
        deadline_s = self.now_s + duration_s
        while self._is_moving and self.now_s < deadline_s - EPSILON_S:
            await self._robot.sleep(min(WATCH_S, deadline_s - self.now_s))
            await self.obey_hold()
            await self.watch()
            await self.watch_map()
        await self._robot.sleep(max(deadline_s - self.now_s, 0.0))

    async def fetch_map(self) -> OccupancyGrid:
        """Gives the latest map."""
        return await self._robot.fetch_map()

    async def fetch_pose(self) -> StampedPose:
        """Gives where the robot believes it is."""
        return await self._robot.fetch_pose()

    async def fetch_picture(self) -> CameraPicture:
        """Takes a picture with the front camera."""
        return await self._robot.fetch_picture()

    async def fetch_foreign_goals(self) -> tuple[GoalState, ...]:
        """Gives how goals stand that others have sent."""
        return await self._robot.fetch_foreign_goals()

    async def fetch_detections(self) -> tuple[Detection, ...]:
        """Gives what the robot's own object detector reports in the camera view."""
        return await self._robot.fetch_detections()

    async def fetch_scan(self) -> RangeScan | None:
        """Gives what the laser meets now; None without one."""
        return await self._robot.fetch_scan()

    async def send_goal(self, goal: Pose) -> str:
        """Starts a drive that the policy allows, and gives the id it is known by.

        Raises:
            PolicyError: The policy, a hold or a person does not allow it, or it was stopped.
        """
        n_stops = self._n_stops
        plan = await self._plan(goal)
        cleared = self._guard.clear(Drive(goal=goal, check=plan.check), robot_s=self.now_s)
        if n_stops != self._n_stops:
            raise self._overtaken(cleared)
        try:
            robot_goal_id = await self._robot.send_goal(plan.legs[0])
        except BaseException as error:
            # Whether the robot took the goal is unknown: it must not drive with nobody knowing.
            with anyio.CancelScope(shield=True):
                self._guard.note_result(cleared, _say_error(error), robot_s=self.now_s)
                await self.stop()
            raise
        self._take_up(robot_goal_id, plan, cleared)
        if n_stops != self._n_stops:
            with anyio.CancelScope(shield=True):
                await self.stop()
            raise self._overtaken(cleared)
        return robot_goal_id

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        """Gives how a drive stands; why it was ended here comes before what the robot says."""
        drive = self._drive
        if drive is not None and drive.goal_id == robot_goal_id:
            status = await self._follow(drive)
        else:
            status = await self._robot.fetch_goal_status(robot_goal_id)
        status = self._verdicts.get(robot_goal_id, status)
        self._note_end(robot_goal_id, status)
        return status

    async def cancel_goal(self, robot_goal_id: str) -> None:
        """Asks the navigation to end a drive; never refused."""
        drive = self._drive
        leg_id = robot_goal_id
        if drive is not None and drive.goal_id == robot_goal_id:
            leg_id = drive.leg_id
            self._give_up_legs(drive, "It was cancelled.")
        try:
            await self._robot.cancel_goal(leg_id)
        finally:
            self._guard.note_event("stop", f"cancelled {robot_goal_id}", robot_s=self.now_s)

    async def stop(self) -> None:
        """Ends every drive and commands zero velocity, at once; never refused."""
        await self._stop("stopped")

    @property
    def name(self) -> str:
        """What the operator calls the robot."""
        return self._guard.robot or self._robot.description.name

    async def obey_hold(self) -> None:
        """Stops the robot for a hold; to be called often, and apart from what asks the robot.

        Stops that fail are tried again at the next call.
        """
        held_by = self._guard.hold.read()
        if held_by is None or held_by == self._answered_hold:
            self._answered_hold = held_by
            return
        if self._drive is not None:
            await self._end(
                self._drive, GoalState.CANCELLED, f"The robot is held: {say_hold(held_by)}."
            )
        else:
            await self._stop("held")
        self._answered_hold = held_by
        self._guard.hold.answer(self.name, held_by=held_by)

    async def watch(self) -> None:
        """Stops the robot before it enters a closed area; to be called often."""
        async with self._watching:
            await self._watch_hand_driving()
            drive = self._drive
            if drive is None:
                return
            fault = await self._find_fault(drive)
            if fault is not None and drive is self._drive:
                await self._end(drive, GoalState.BLOCKED, fault)
            elif drive.legs and drive is self._drive:
                await self._follow(drive)

    async def watch_map(self) -> None:
        """Stops the robot when its goal is closed or full by now; to be called often.

        A map may take long to come and to be looked through: `watch` must not wait for it.
        """
        drive = self._drive
        if drive is None or not drive.lookout.is_map_due(self.now_s):
            return
        try:
            grid = await self._robot.fetch_map()
        except LinkError as error:
            logger.warning("While watching the map: %s", error)
            return
        revision = await self._surveyor.survey(grid, radius_m=self.description.radius_m)
        fault = drive.lookout.judge_goal(revision, now_s=self.now_s)
        if fault is not None and drive is self._drive:
            await self._end(drive, GoalState.BLOCKED, fault)

    # --- inside ---

    @property
    def _is_moving(self) -> bool:
        return self._drive is not None or self.by_hand.is_under_way

    async def _watch_hand_driving(self) -> None:
        """Stops a robot that published velocities drive towards what is closed."""
        fault = None
        # While nobody knows where the robot is, the next message is refused, and a stand follows.
        with suppress(LinkError):
            fault = await self.by_hand.find_fault()
        if fault is not None:
            logger.warning("%s", fault)
            with anyio.CancelScope(shield=True):
                self.by_hand.stand()
                await self._stop(fault)

    def _take_up(self, robot_goal_id: str, plan: Plan, cleared: Clearance) -> None:
        """Begins to look after a drive that the robot has accepted."""
        self._note_replaced()
        self._seen_at_s = anyio.current_time()
        first, *others = plan.legs
        lookout = Lookout(goal=plan.legs[-1], radius_m=self.description.radius_m)
        lookout.begin_at(plan.here, now_s=self.now_s)
        self._drive = GuardedDrive(
            goal_id=robot_goal_id,
            leg_id=robot_goal_id,
            leg=first,
            legs=others,
            cleared=cleared,
            lookout=lookout,
        )
        said = f", in {len(plan.legs)} legs round what is closed" if others else ""
        self._guard.note_result(cleared, f"accepted as {robot_goal_id}{said}", robot_s=self.now_s)

    async def _follow(self, drive: GuardedDrive) -> GoalStatus:
        """Gives how a drive stands, and sends the robot on where a leg of it has ended."""
        async with self._stepping:
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
        n_stops = self._n_stops
        if self._guard.hold.read() is not None:
            return
        drive.leg = drive.legs.pop(0)
        said = f"on to ({drive.leg.x:.2f}, {drive.leg.y:.2f})"
        self._guard.note_leg(drive.cleared, said, robot_s=self.now_s)
        drive.leg_id = await self._robot.send_goal(drive.leg)
        if n_stops != self._n_stops:
            with anyio.CancelScope(shield=True):
                await self.stop()

    async def _plan(self, goal: Pose) -> Plan:
        """Judges a goal, and gives the legs by which the robot would get there."""
        grid = await self._robot.fetch_map()
        here = (await self._robot.fetch_pose()).pose
        revision = await self._surveyor.survey(grid, radius_m=self.description.radius_m)
        check = await anyio.to_thread.run_sync(
            lambda: check_goal(revision.grid, revision.distances_from(here.point), goal)
        )
        if check.is_ok:
            legs = await anyio.to_thread.run_sync(lambda: plan_legs(revision, here.point, goal))
            return Plan(check=check, legs=legs, here=here)
        is_turn = goal.is_finite() and here.point.distance_to(goal.point) <= SAME_PLACE_M
        is_over = any(area.distance_to(here.point) < revision.radius_m for area in revision.areas)
        if is_turn and not is_over:
            # Where it stands it can stand, however tight the map shows that place to be.
            check = replace(check, verdict=GoalVerdict.OK, path_m=0.0, nearest=None)
        return Plan(check=check, legs=(goal,), here=here)

    async def _find_fault(self, drive: GuardedDrive) -> str | None:
        """Finds why a drive must not go on; that nothing can be seen is a reason after a while."""
        try:
            return await self._judge(drive)
        except LinkError as error:
            blind_s = anyio.current_time() - self._seen_at_s
            if blind_s < BLIND_S:
                return None
            return f"The robot was stopped: where it is was unknown for {blind_s:.0f} s. {error}"

    async def _judge(self, drive: GuardedDrive) -> str | None:
        revision = self._surveyor.latest
        if revision is None or not revision.areas:
            return None
        pose = (await self._robot.fetch_pose()).pose
        self._seen_at_s = anyio.current_time()
        return drive.lookout.judge_motion(revision, pose, now_s=self.now_s)

    async def _end(self, drive: GuardedDrive, state: GoalState, reason: str) -> None:
        """Stops the robot and remembers why, whatever its navigation will say of the drive."""
        self._verdicts[drive.goal_id] = GoalStatus(state=state, reason=reason)
        logger.warning("%s", reason)
        with anyio.CancelScope(shield=True):
            try:
                await self._stop(reason)
            except MapspeakError:
                # It may still drive: nobody may take the drive for ended, and it is stopped again.
                del self._verdicts[drive.goal_id]
                raise
        self._note_end(drive.goal_id, self._verdicts[drive.goal_id])

    async def _stop(self, why: str) -> None:
        self._n_stops += 1
        self._guard.end_errands()
        if self._drive is not None:
            self._give_up_legs(self._drive, "The robot was stopped.")
        try:
            await self._robot.stop()
        except MapspeakError as error:
            why = f"{why}, but: {error}"
            raise
        finally:
            self._guard.note_event("stop", why, robot_s=self.now_s)
            self._latch()

    def _latch(self) -> None:
        """Holds the robot after a client's stop, where the policy says so."""
        caller = current_caller()
        if caller is NOBODY or not self._guard.policy.latches_on_stop:
            return
        try:
            at = self._guard.wall_clock()
            self._guard.hold.put(f"{caller.tool or 'a client'} stopped it", at=at)
        except ConfigError as error:
            logger.error("%s", error)  # noqa: TRY400 - it says all there is to say

    def _note_end(self, robot_goal_id: str, status: GoalStatus) -> None:
        drive = self._drive
        if drive is None or drive.goal_id != robot_goal_id or not status.state.is_final:
            return
        self._drive = None
        # The robot knows legs by other ids: how the drive ended is known here alone.
        self._verdicts[robot_goal_id] = status
        while len(self._verdicts) > N_KEPT:
            self._verdicts.popitem(last=False)
        said = f"{status.state}: {status.reason}" if status.reason else str(status.state)
        self._guard.note_end(drive.cleared, said, robot_s=self.now_s)

    def _give_up_legs(self, drive: GuardedDrive, reason: str) -> None:
        """Ends a drive that was to go on after its present leg: its end is not the goal."""
        if drive.legs:
            drive.legs.clear()
            status = GoalStatus(state=GoalState.CANCELLED, reason=reason)
            self._verdicts.setdefault(drive.goal_id, status)

    def _note_replaced(self) -> None:
        if self._drive is not None:
            status = GoalStatus(state=GoalState.PREEMPTED, reason="A newer goal took its place.")
            self._note_end(self._drive.goal_id, status)

    def _overtaken(self, cleared: Clearance) -> PolicyError:
        what = say_command(cleared.command)
        self._guard.note_result(cleared, "given up: the robot was stopped", robot_s=self.now_s)
        return PolicyError(
            f"The robot was stopped before it could {what}.",
            hint="Call navigate_to again when it may drive.",
        )


def _say_error(error: BaseException) -> str:
    return str(error) if isinstance(error, MapspeakError) else f"given up: {type(error).__name__}"
