from pathlib import Path

import anyio
import pytest

from fakes import FakeRobot, two_rooms
from mapspeak.errors import GoalError, LinkError
from mapspeak.geometry import Pose
from mapspeak.navigation.drive import Drive, DriveBook
from mapspeak.navigation.safety import WhenBusy
from mapspeak.navigation.vigil import SILENT_FOR_S, Vigil
from mapspeak.robot import GoalState, GoalStatus, StampedPose
from mapspeak.semantic import SemanticMapStore
from mapspeak.session import Session

pytestmark = pytest.mark.anyio

NEAR, FAR = Pose(2.5, 1.4), Pose(6.0, 1.4)


async def start(
    drives: DriveBook, goal: Pose, *, client: str = "", when_busy: WhenBusy | None = None
) -> Drive:
    with drives.preparing() as ticket:
        return await drives.start(
            goal, place="there", ticket=ticket, client=client, when_busy=when_busy
        )


async def state_of(drives: DriveBook, drive: Drive) -> GoalState:
    return (await drives.report(drive.goal_id)).status.state


async def tell_nobody(_report: object) -> None:
    await anyio.lowlevel.checkpoint()


async def test_the_same_clients_newer_drive_replaces_the_older_one() -> None:
    drives = DriveBook(FakeRobot(two_rooms()), when_busy=WhenBusy.REFUSE)
    first = await start(drives, FAR, client="one")
    second = await start(drives, NEAR, client="one")
    assert await state_of(drives, first) is GoalState.PREEMPTED
    assert await state_of(drives, second) is GoalState.DRIVING


async def test_another_clients_drive_is_refused_where_it_must_not_replace() -> None:
    drives = DriveBook(FakeRobot(two_rooms()), when_busy=WhenBusy.REFUSE)
    first = await start(drives, FAR, client="one")
    with pytest.raises(GoalError, match="G1 to there is under way"):
        await start(drives, NEAR, client="two")
    assert await state_of(drives, first) is GoalState.DRIVING


async def test_a_drive_that_waits_its_turn_begins_when_the_one_before_has_ended() -> None:
    robot = FakeRobot(two_rooms())
    drives = DriveBook(robot, when_busy=WhenBusy.WAIT)
    first = await start(drives, FAR, client="one")
    second = await start(drives, NEAR, client="two")
    assert await state_of(drives, second) is GoalState.PLANNED
    ended = await drives.wait(second.goal_id, wait_s=25.0, on_progress=tell_nobody)
    assert ended.status.state is GoalState.ARRIVED
    assert await state_of(drives, first) is GoalState.ARRIVED
    assert list(robot.goals.values()) == [FAR, NEAR]


async def test_a_drive_that_waits_begins_though_nobody_waits_for_it() -> None:
    robot = FakeRobot(two_rooms())
    drives = DriveBook(robot)
    await start(drives, NEAR)
    second = await start(drives, FAR, when_busy=WhenBusy.WAIT)
    await robot.sleep(5.0)
    await drives.watch()
    assert await state_of(drives, second) is GoalState.DRIVING


async def test_a_drive_that_waits_can_be_cancelled_and_is_stopped_with_the_rest() -> None:
    robot = FakeRobot(two_rooms())
    drives = DriveBook(robot)
    await start(drives, FAR)
    second = await start(drives, NEAR, when_busy=WhenBusy.WAIT)
    third = await start(drives, NEAR, when_busy=WhenBusy.WAIT)
    assert (await drives.cancel(second.goal_id)).status.state is GoalState.CANCELLED
    await drives.stop()
    assert await state_of(drives, third) is GoalState.CANCELLED
    assert not drives.is_busy
    assert len(robot.goals) == 1


class StubbornRobot(FakeRobot):
    """Refuses goals when a test says so."""

    refuses = False

    async def send_goal(self, goal: Pose) -> str:
        if self.refuses:
            raise GoalError("Not there.", hint="Elsewhere.")
        return await super().send_goal(goal)


async def test_a_goal_that_is_refused_leaves_the_drive_under_way_as_it_is() -> None:
    robot = StubbornRobot(two_rooms())
    drives = DriveBook(robot)
    first = await start(drives, FAR)
    robot.refuses = True
    with pytest.raises(GoalError):
        await start(drives, NEAR)
    assert drives.under_way == first
    assert await state_of(drives, first) is GoalState.DRIVING


async def test_a_drive_that_waited_and_is_refused_then_says_why() -> None:
    robot = StubbornRobot(two_rooms())
    drives = DriveBook(robot)
    await start(drives, NEAR)
    second = await start(drives, FAR, when_busy=WhenBusy.WAIT)
    robot.refuses = True
    ended = await drives.wait(second.goal_id, wait_s=25.0, on_progress=tell_nobody)
    assert ended.status.state is GoalState.REJECTED
    assert "Not there." in ended.status.reason


class StuckRobot(FakeRobot):
    """Accepts goals and never begins to drive."""

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        status = await super().fetch_goal_status(robot_goal_id)
        return status if status.state.is_final else GoalStatus(state=GoalState.ACCEPTED)

    async def sleep(self, duration_s: float) -> None:
        self._now_s += duration_s


async def test_a_navigation_that_never_begins_times_out_and_is_stopped() -> None:
    robot = StuckRobot(two_rooms())
    drives = DriveBook(robot, patience_s=10.0)
    drive = await start(drives, FAR)
    ended = await drives.wait(drive.goal_id, wait_s=25.0, on_progress=tell_nobody)
    assert ended.status.state is GoalState.TIMED_OUT
    assert "has not begun for 10 s" in ended.status.reason
    assert ended.elapsed_s < 11.0
    assert robot.n_stops == 1


async def test_a_drive_that_goes_on_does_not_time_out() -> None:
    drives = DriveBook(FakeRobot(two_rooms()), patience_s=1.0)
    drive = await start(drives, FAR)
    ended = await drives.wait(drive.goal_id, wait_s=25.0, on_progress=tell_nobody)
    assert ended.status.state is GoalState.ARRIVED


async def test_a_robot_whose_pose_jumps_is_stopped_and_its_drive_is_lost() -> None:
    robot = FakeRobot(two_rooms())
    drives = DriveBook(robot)
    drive = await start(drives, FAR)
    waiting = await start(drives, NEAR, when_busy=WhenBusy.WAIT)
    await drives.watch()
    robot.pose = Pose(5.9, 0.7)
    await drives.watch()
    report = await drives.report(drive.goal_id)
    assert report.status.state is GoalState.LOST
    assert "jumped by 4.5 m" in report.status.reason
    assert robot.n_stops == 1
    assert await state_of(drives, waiting) is GoalState.CANCELLED


class SilentRobot(FakeRobot):
    """Stops answering when a test says so."""

    is_silent = False

    async def fetch_pose(self) -> StampedPose:
        if self.is_silent:
            raise LinkError("The line is dead.", hint="Wait.")
        return await super().fetch_pose()


async def test_a_silent_robot_is_an_error_at_first_and_a_lost_drive_at_last() -> None:
    robot = SilentRobot(two_rooms())
    drives = DriveBook(robot)
    drive = await start(drives, FAR)
    await drives.watch()
    robot.is_silent = True
    await drives.watch()
    with pytest.raises(LinkError):
        await drives.report(drive.goal_id)
    drives._vigil._silent_since_s = anyio.current_time() - SILENT_FOR_S
    await drives.watch()
    report = await drives.report(drive.goal_id)
    assert report.status.state is GoalState.LOST
    assert "The line is dead." in report.status.reason
    assert report.pose == robot.pose


async def test_one_answer_ends_the_silence() -> None:
    vigil = Vigil(patience_s=60.0)
    status = GoalStatus(state=GoalState.DRIVING)
    vigil.note_silence(LinkError("Silence.", hint="Wait."))
    vigil._silent_since_s = anyio.current_time() - SILENT_FOR_S
    vigil.judge(status, NEAR, now_s=0.0)
    assert vigil.note_silence(LinkError("Silence.", hint="Wait.")) is None


async def test_a_watching_session_stops_a_robot_that_jumps(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    session = Session(robot, SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0)
    await start(session.drives, FAR)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(session.keep_watch)
        await session.drives.watch()
        robot.pose = Pose(5.9, 0.7)
        with anyio.fail_after(20.0):
            while not robot.n_stops:
                await anyio.lowlevel.checkpoint()
        tasks.cancel_scope.cancel()


class SlowToAccept(FakeRobot):
    """A robot that takes goals only after a while."""

    async def send_goal(self, goal: Pose) -> str:
        await self.sleep(4.0)
        return await super().send_goal(goal)


async def test_the_time_of_a_drive_counts_from_when_it_was_sent() -> None:
    drives = DriveBook(SlowToAccept(two_rooms()))
    drive = await start(drives, FAR)
    assert (await drives.report(drive.goal_id)).elapsed_s == pytest.approx(4.0)
