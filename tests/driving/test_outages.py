"""What becomes of a drive while the robot, its navigation or its pose is away, and after."""

from dataclasses import replace

import anyio
import pytest

from causes import code_of, quote_of
from failing_robot import FailingRobot
from fakes import FakeRobot, two_rooms
from mapspeak.driving.drive import DriveBook
from mapspeak.driving.drivereport import Drive, DriveReport
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.robot import CauseCode, GoalState, GoalStatus, PoseDoubt, StampedPose

pytestmark = pytest.mark.anyio

NEAR, FAR = Pose(2.5, 1.4), Pose(6.0, 1.4)
STEP_S = 0.5


class Watched:
    """A failing robot whose drives are looked after twice a second, on one clock."""

    def __init__(self) -> None:
        self.robot = FailingRobot()
        self.stood_s = 0.0
        self.drives = DriveBook(self.robot, wall_s=lambda: self.robot.now_s + self.stood_s)

    async def send(self, goal: Pose = FAR) -> Drive:
        with self.drives.preparing() as ticket:
            return await self.drives.start(goal, place="there", ticket=ticket)

    async def pass_time(self, duration_s: float) -> None:
        for _ in range(round(duration_s / STEP_S)):
            await self.robot.sleep(STEP_S)
            await self.drives.watch()

    async def lose_robot(self, duration_s: float) -> None:
        self.robot.is_reachable = False
        await self.pass_time(duration_s)

    async def stop_clock(self, duration_s: float) -> None:
        self.robot.is_clock_still = True
        for _ in range(round(duration_s / STEP_S)):
            self.stood_s += STEP_S
            await self.drives.watch()

    @property
    def is_driving(self) -> bool:
        return len(self.robot.ended) < len(self.robot.goals)


async def tell_nobody(_report: DriveReport) -> None:
    await anyio.lowlevel.checkpoint()


async def test_a_wait_ends_though_the_robot_never_answers_again() -> None:
    watched = Watched()
    drive = await watched.send()
    await watched.drives.wait(drive.goal_id, wait_s=0.5, on_progress=tell_nobody)
    watched.robot.is_mute = True
    with anyio.fail_after(10.0):
        told = await watched.drives.wait(drive.goal_id, wait_s=0.1, on_progress=tell_nobody)
    assert told.status.state is GoalState.DRIVING
    assert told.pose_doubt is PoseDoubt.NO_ANSWER
    assert not told.status.state.is_final


@pytest.mark.parametrize("away_s", [1.0, 5.0, 9.0])
async def test_after_a_short_outage_a_drive_is_taken_up_again(away_s: float) -> None:
    watched = Watched()
    drive = await watched.send()
    await watched.pass_time(2.0)
    await watched.lose_robot(away_s)
    told = await watched.drives.report(drive.goal_id)
    assert told.status.state is GoalState.DRIVING
    assert told.pose_doubt is PoseDoubt.NO_ANSWER
    assert told.pose_age_s == pytest.approx(away_s)
    assert "There is no connection." in told.silence
    watched.robot.is_reachable = True
    await watched.pass_time(5.0)
    told = await watched.drives.report(drive.goal_id)
    assert (told.status.state, told.pose_doubt) == (GoalState.DRIVING, None)
    await watched.pass_time(100.0)
    assert (await watched.drives.report(drive.goal_id)).status.state is GoalState.ARRIVED
    assert watched.robot.n_stops == 0


@pytest.mark.parametrize("away_s", [14.0, 26.0, 50.0])
async def test_after_a_long_outage_a_drive_that_goes_on_is_stopped(away_s: float) -> None:
    watched = Watched()
    drive = await watched.send()
    await watched.lose_robot(away_s)
    told = await watched.drives.report(drive.goal_id)
    assert told.status.state is GoalState.LOST
    assert told.is_stop_owed
    assert watched.is_driving
    watched.robot.is_reachable = True
    await watched.pass_time(2.0)
    assert not watched.is_driving
    told = await watched.drives.report(drive.goal_id)
    assert (told.status.state, told.is_stop_owed) == (GoalState.LOST, False)
    assert not watched.drives.is_busy


async def test_a_drive_that_ended_by_itself_in_an_outage_is_told_as_it_ended() -> None:
    watched = Watched()
    drive = await watched.send(NEAR)
    await watched.lose_robot(40.0)
    assert (await watched.drives.report(drive.goal_id)).status.state is GoalState.LOST
    watched.robot.is_reachable = True
    await watched.pass_time(2.0)
    told = await watched.drives.report(drive.goal_id)
    assert (told.status.state, told.is_stop_owed) == (GoalState.ARRIVED, False)
    assert watched.robot.n_stops == 0


async def test_a_lost_drive_is_not_stopped_once_a_newer_goal_drives_the_robot() -> None:
    watched = Watched()
    await watched.send()
    await watched.lose_robot(20.0)
    watched.robot.is_reachable = True
    newer = await watched.send(Pose(1.5, 0.5))
    await watched.pass_time(5.0)
    assert watched.robot.n_stops == 0
    assert (await watched.drives.report(newer.goal_id)).status.state is GoalState.DRIVING


async def test_a_stop_that_could_not_be_told_is_told_when_the_robot_is_back() -> None:
    watched = Watched()
    drive = await watched.send()
    await watched.lose_robot(2.0)
    with pytest.raises(LinkError):
        await watched.drives.stop()
    assert (await watched.drives.report(drive.goal_id)).is_stop_owed
    watched.robot.is_reachable = True
    await watched.pass_time(2.0)
    assert not watched.is_driving
    assert (await watched.drives.report(drive.goal_id)).status.state is GoalState.CANCELLED


async def test_who_hangs_up_in_an_outage_leaves_a_robot_that_is_stopped_after_it() -> None:
    watched = Watched()
    drive = await watched.send()
    with anyio.CancelScope() as scope:

        async def hang_up(_report: DriveReport) -> None:
            watched.robot.is_reachable = False
            scope.cancel()
            await anyio.lowlevel.checkpoint()

        await watched.drives.wait(drive.goal_id, wait_s=20.0, on_progress=hang_up)
    assert watched.is_driving
    watched.robot.is_reachable = True
    await watched.pass_time(2.0)
    assert not watched.is_driving


async def test_while_the_pose_is_missing_a_drive_tells_so_and_before_long_is_stopped() -> None:
    watched = Watched()
    drive = await watched.send()
    watched.robot.tells_pose = False
    await watched.pass_time(5.0)
    told = await watched.drives.report(drive.goal_id)
    assert (told.status.state, told.pose_doubt) == (GoalState.DRIVING, PoseDoubt.NO_POSE)
    await watched.pass_time(6.0)
    told = await watched.drives.report(drive.goal_id)
    assert told.status.state is GoalState.LOST
    assert code_of(told.status) is CauseCode.ROBOT_SILENT
    assert "No transform has come." in quote_of(told.status)
    assert not watched.is_driving


async def test_arriving_with_an_old_pose_is_told_with_a_doubt() -> None:
    watched = Watched()
    drive = await watched.send(NEAR)
    watched.robot.freeze_pose()
    await watched.pass_time(30.0)
    told = await watched.drives.report(drive.goal_id)
    assert (told.status.state, told.pose_doubt) == (GoalState.ARRIVED, PoseDoubt.OLD_POSE)
    assert told.pose_age_s == pytest.approx(30.0)
    assert told.drive.ended_at is None


async def test_what_was_driven_while_the_pose_was_away_is_no_jump() -> None:
    watched = Watched()
    drive = await watched.send()
    watched.robot.freeze_pose()
    await watched.pass_time(4.0)
    watched.robot.pose = Pose(4.0, 1.4)
    watched.robot.frozen_s = None
    await watched.pass_time(STEP_S)
    assert (await watched.drives.report(drive.goal_id)).status.state is GoalState.DRIVING


async def test_a_pose_that_moves_under_an_old_stamp_is_no_jump() -> None:
    watched = Watched()
    drive = await watched.send()
    watched.robot.freeze_pose()
    for x in (2.0, 3.5, 5.0):
        watched.robot.seen = StampedPose(Pose(x, 1.4), watched.robot.frozen_s or 0.0)
        await watched.pass_time(STEP_S)
    assert (await watched.drives.report(drive.goal_id)).status.state is GoalState.DRIVING


async def test_a_pose_from_after_the_clock_was_set_back_is_no_jump() -> None:
    watched = Watched()
    await watched.robot.sleep(50.0)
    drives = DriveBook(watched.robot)
    with drives.preparing() as ticket:
        drive = await drives.start(FAR, place="there", ticket=ticket)
    await drives.watch()
    watched.robot.set_clock(1.0)
    watched.robot.pose = Pose(5.0, 1.4)
    assert (await drives.report(drive.goal_id)).status.state is GoalState.DRIVING


async def test_a_pose_that_jumps_stops_the_robot_and_what_waits_does_not_start() -> None:
    watched = Watched()
    drive = await watched.send()
    await watched.pass_time(1.0)
    watched.robot.pose = Pose(5.9, 0.7)
    await watched.pass_time(1.0)
    told = await watched.drives.report(drive.goal_id)
    assert told.status.state is GoalState.LOST
    assert told.status.cause is not None
    assert told.status.cause.code is CauseCode.POSE_JUMPED
    assert told.status.cause.distance_m == pytest.approx(4.4, abs=0.05)
    assert watched.robot.n_stops == 1


async def test_time_in_an_outage_is_not_taken_for_time_without_movement() -> None:
    watched = Watched()
    drives = DriveBook(watched.robot, patience_s=8.0, wall_s=lambda: watched.robot.now_s)
    with drives.preparing() as ticket:
        drive = await drives.start(FAR, place="there", ticket=ticket)
    await drives.watch()
    before = watched.robot.pose
    watched.robot.is_reachable = False
    await drives.watch()
    await watched.robot.sleep(9.0)
    watched.robot.is_reachable = True
    watched.robot.pose = before
    assert (await drives.report(drive.goal_id)).status.state is GoalState.DRIVING


class StandingClock(FakeRobot):
    """A simulation that is paused: its clock cannot be waited for."""

    async def sleep(self, duration_s: float) -> None:
        raise LinkError(f"{duration_s} s cannot be waited for: the clock stands.", hint="Unpause.")


class LateNavigation(FailingRobot):
    """Takes up a goal that it had called rejected."""

    afterwards = ""

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        status = await super().fetch_goal_status(robot_goal_id)
        return replace(status, state=GoalState.REJECTED, afterwards=self.afterwards)


async def test_what_becomes_of_a_drive_after_its_end_is_told_with_it() -> None:
    robot = LateNavigation()
    drives = DriveBook(robot, wall_s=lambda: robot.now_s)
    with drives.preparing() as ticket:
        drive = await drives.start(FAR, place="there", ticket=ticket)
    before = await drives.wait(drive.goal_id, wait_s=20.0, on_progress=tell_nobody)
    robot.afterwards = "It was taken 7.0 s after it was sent; it was cancelled at once."
    after = await drives.wait(drive.goal_id, wait_s=20.0, on_progress=tell_nobody)
    assert (before.status.state, before.status.afterwards) == (GoalState.REJECTED, "")
    assert after.status.state is GoalState.REJECTED
    assert after.status.afterwards == robot.afterwards


async def test_waiting_ends_when_the_robots_clock_stands() -> None:
    drives = DriveBook(StandingClock(two_rooms()))
    with drives.preparing() as ticket:
        drive = await drives.start(FAR, place="there", ticket=ticket)
    report = await drives.wait(drive.goal_id, wait_s=20.0, on_progress=tell_nobody)
    assert report.drive.goal_id == "G1"
    assert report.status.state is GoalState.DRIVING


async def test_a_drive_whose_robots_clock_has_died_is_ended_and_stopped() -> None:
    watched = Watched()
    drive = await watched.send()
    await watched.pass_time(2.0)
    await watched.stop_clock(9.0)
    told = await watched.drives.report(drive.goal_id)
    assert (told.status.state, told.pose_doubt) == (GoalState.DRIVING, PoseDoubt.CLOCK_STANDS)
    await watched.stop_clock(2.0)
    told = await watched.drives.report(drive.goal_id)
    assert told.status.state is GoalState.LOST
    assert code_of(told.status) is CauseCode.CLOCK_STANDS
    assert not watched.is_driving
    assert watched.robot.n_stops == 1


async def test_a_drive_goes_on_where_the_robots_clock_has_stood_for_a_moment() -> None:
    watched = Watched()
    drive = await watched.send()
    for _ in range(3):
        await watched.stop_clock(9.0)
        watched.robot.is_clock_still = False
        await watched.pass_time(2.0)
    assert (await watched.drives.report(drive.goal_id)).status.state is GoalState.DRIVING
    assert watched.robot.n_stops == 0


def test_a_pose_is_doubted_when_it_is_old_silent_or_odometry() -> None:
    here = Pose(1.0, 2.0)
    assert StampedPose(here, 9.0).find_doubt(10.0) is None
    assert StampedPose(here, 5.0).find_doubt(10.0) is PoseDoubt.OLD_POSE
    assert StampedPose(here, 10.0, silent_s=9.0).find_doubt(10.0) is PoseDoubt.SILENT_POSE
    assert StampedPose(here, 1.0, silent_s=9.0).find_doubt(10.0) is PoseDoubt.SILENT_POSE
    for silent_s in (0.0, 9.0):
        paused = StampedPose(here, 10.0, silent_s=silent_s, is_clock_still=True)
        assert paused.find_doubt(10.0) is PoseDoubt.CLOCK_STANDS
    assert StampedPose(here, 9.0, is_odometry=True).find_doubt(10.0) is PoseDoubt.ODOMETRY
    assert StampedPose(here, 12.0).measure_age_s(10.0) == 0.0
    assert StampedPose(here, 10.0, silent_s=9.0).measure_age_s(10.0) == 9.0
