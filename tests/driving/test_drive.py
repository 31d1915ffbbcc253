from pathlib import Path

import anyio
import pytest

from causes import code_of, quote_of
from fakes import FakeRobot, two_rooms
from mapspeak.driving.drive import DriveBook
from mapspeak.driving.drivereport import Drive
from mapspeak.errors import GoalError
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import CauseCode, GoalState, GoalStatus
from mapspeak.safety import Caller, WhenBusy, calling, current_caller
from mapspeak.session import Session

pytestmark = pytest.mark.anyio

NEAR, FAR = Pose(2.5, 1.4), Pose(6.0, 1.4)


async def start(drives: DriveBook, goal: Pose, *, client: str = "") -> Drive:
    with calling(Caller(session=client)), drives.preparing() as ticket:
        return await drives.start(goal, place="there", ticket=ticket)


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
    drives = DriveBook(robot, when_busy=WhenBusy.WAIT)
    await start(drives, NEAR)
    second = await start(drives, FAR, client="two")
    await robot.sleep(5.0)
    await drives.watch()
    assert await state_of(drives, second) is GoalState.DRIVING


class NotingRobot(FakeRobot):
    """Notes for whom it is sent."""

    def __init__(self) -> None:
        super().__init__(two_rooms())
        self.sent_for: list[str] = []

    async def send_goal(self, goal: Pose) -> str:
        self.sent_for.append(current_caller().session)
        return await super().send_goal(goal)


async def test_a_drive_that_waits_is_sent_for_its_own_client_whoever_asks_then() -> None:
    robot = NotingRobot()
    drives = DriveBook(robot, when_busy=WhenBusy.WAIT)
    first = await start(drives, NEAR, client="one")
    await start(drives, FAR, client="two")
    with calling(Caller(session="one")):
        await drives.wait(first.goal_id, wait_s=25.0, on_progress=tell_nobody)
        await drives.watch()
    assert robot.sent_for == ["one", "two"]


async def test_a_drive_that_waits_can_be_cancelled_and_is_stopped_with_the_rest() -> None:
    robot = FakeRobot(two_rooms())
    drives = DriveBook(robot, when_busy=WhenBusy.WAIT)
    await start(drives, FAR)
    second = await start(drives, NEAR, client="two")
    third = await start(drives, NEAR, client="three")
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
    assert drives.under_way is not None
    assert drives.under_way.goal_id == first.goal_id
    assert await state_of(drives, first) is GoalState.DRIVING


async def test_a_drive_that_waited_and_is_refused_then_says_why() -> None:
    robot = StubbornRobot(two_rooms())
    drives = DriveBook(robot, when_busy=WhenBusy.WAIT)
    await start(drives, NEAR)
    second = await start(drives, FAR, client="two")
    robot.refuses = True
    ended = await drives.wait(second.goal_id, wait_s=25.0, on_progress=tell_nobody)
    assert ended.status.state is GoalState.REJECTED
    assert code_of(ended.status) is CauseCode.REFUSED
    assert "Not there." in quote_of(ended.status)


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
    assert code_of(ended.status) is CauseCode.NOT_BEGUN
    assert ended.elapsed_s < 11.0
    assert robot.n_stops == 1


async def test_a_drive_tells_how_far_the_robot_has_come_on_it() -> None:
    robot = FakeRobot(two_rooms())
    drives = DriveBook(robot)
    there = await start(drives, FAR)
    began = robot.pose.point
    ended = await drives.wait(there.goal_id, wait_s=25.0, on_progress=tell_nobody)
    assert ended.driven_m >= began.distance_to(FAR.point) - 0.2
    back = await start(drives, Pose(began.x, began.y))
    assert (await drives.report(back.goal_id)).driven_m == 0.0
    await drives.wait(back.goal_id, wait_s=25.0, on_progress=tell_nobody)
    assert (await drives.report(there.goal_id)).driven_m == ended.driven_m


async def test_a_drive_that_goes_on_does_not_time_out() -> None:
    drives = DriveBook(FakeRobot(two_rooms()), patience_s=1.0)
    drive = await start(drives, FAR)
    ended = await drives.wait(drive.goal_id, wait_s=25.0, on_progress=tell_nobody)
    assert ended.status.state is GoalState.ARRIVED


async def test_a_watching_session_stops_a_robot_that_jumps(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    session = Session(robot, SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0)
    await start(session.drives, FAR)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(session.keep_watch)
        await session.drives.watch()
        robot.pose = Pose(5.9, 0.7)
        await robot.sleep(0.1)
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


@pytest.mark.parametrize(
    ("state", "n_stops"),
    [
        (GoalState.ARRIVED, 0),
        (GoalState.CANCELLED, 0),
        (GoalState.PREEMPTED, 0),
        (GoalState.BLOCKED, 1),
        (GoalState.REJECTED, 1),
        (GoalState.TIMED_OUT, 1),
        (GoalState.LOST, 1),
    ],
)
async def test_a_drive_that_ends_badly_is_stopped_whoever_says_so(
    state: GoalState, n_stops: int
) -> None:
    robot = FakeRobot(two_rooms())
    drives = DriveBook(robot)
    drive = await start(drives, FAR)
    robot.ended[drive.robot_goal_id or ""] = GoalStatus(state=state)
    await drives.watch()
    await drives.watch()
    assert robot.n_stops == n_stops
    assert await state_of(drives, drive) is state
    assert not drives.is_busy


async def test_the_metres_driven_are_counted_also_while_nobody_waits() -> None:
    robot = FakeRobot(two_rooms())
    drives = DriveBook(robot)
    await start(drives, FAR)
    for _ in range(9):
        await robot.sleep(0.5)
        await drives.watch()
    assert drives.odometer.driven_m == pytest.approx(4.5, abs=0.01)


async def test_a_drive_from_before_the_clock_was_set_back_has_no_negative_time() -> None:
    robot = FakeRobot(two_rooms())
    await robot.sleep(100.0)
    drives = DriveBook(robot)
    drive = await start(drives, NEAR)
    await robot.sleep(3.0)
    robot.set_clock(0.0)
    report = await drives.report(drive.goal_id)
    assert report.elapsed_s == 0.0
    assert report.pose_age_s == 0.0


async def test_the_time_of_a_drive_ends_with_it() -> None:
    robot = FakeRobot(two_rooms())
    drives = DriveBook(robot)
    drive = await start(drives, FAR)
    ended = await drives.cancel(drive.goal_id)
    await robot.sleep(60.0)
    later = await drives.report(drive.goal_id)
    assert later.elapsed_s == ended.elapsed_s
