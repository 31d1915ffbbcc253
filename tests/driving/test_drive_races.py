"""What becomes of drives when two things are asked of a robot at once."""

from collections.abc import Awaitable, Callable
from pathlib import Path

import anyio
import pytest

from fakes import FakeRobot, two_rooms
from mapspeak.driving.drive import DriveBook
from mapspeak.driving.drivereport import Drive
from mapspeak.errors import GoalError
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import CauseCode, GoalState
from mapspeak.safety import Caller, WhenBusy, calling
from mapspeak.session import Session

pytestmark = pytest.mark.anyio

NEAR, FAR = Pose(2.5, 1.4), Pose(6.0, 1.4)
ELSEWHERE = Pose(5.9, 0.7)


async def start(drives: DriveBook, goal: Pose, *, client: str = "") -> Drive:
    with calling(Caller(session=client)), drives.preparing() as ticket:
        return await drives.start(goal, place="there", ticket=ticket)


async def state_of(drives: DriveBook, drive: Drive) -> GoalState:
    return (await drives.report(drive.goal_id)).status.state


class BusyRobot(FakeRobot):
    """Does something while it accepts a goal, or while it is being stopped, when a test says so."""

    while_accepting: Callable[[], Awaitable[None]] | None = None
    while_stopping: Callable[[], Awaitable[None]] | None = None

    async def send_goal(self, goal: Pose) -> str:
        meanwhile, self.while_accepting = self.while_accepting, None
        goal_id = await super().send_goal(goal)
        if meanwhile is not None:
            await meanwhile()
        return goal_id

    async def stop(self) -> None:
        meanwhile, self.while_stopping = self.while_stopping, None
        await super().stop()
        if meanwhile is not None:
            await meanwhile()


@pytest.mark.parametrize("asks", ["about an ended drive", "about one that waits", "for another"])
async def test_a_jump_ends_a_drive_though_it_was_seen_when_something_else_was_asked(
    asks: str,
) -> None:
    robot = FakeRobot(two_rooms())
    drives = DriveBook(robot, when_busy=WhenBusy.WAIT, wall_s=lambda: robot.now_s)
    ended = await start(drives, NEAR)
    await robot.sleep(2.0)
    assert await state_of(drives, ended) is GoalState.ARRIVED
    under_way = await start(drives, FAR)
    waiting = await start(drives, NEAR, client="another")
    assert await state_of(drives, under_way) is GoalState.DRIVING
    robot.pose = Pose(0.6, 2.3)
    await robot.sleep(0.1)
    match asks:
        case "about an ended drive":
            await drives.report(ended.goal_id)
        case "about one that waits":
            await drives.report(waiting.goal_id)
        case _:
            with pytest.raises(GoalError):
                await drives.start(FAR, place="there", ticket=-1)
    for _ in range(3):
        await robot.sleep(0.5)
        await drives.watch()
    assert await state_of(drives, under_way) is GoalState.LOST
    assert robot.n_stops == 1


async def test_a_drive_that_is_cancelled_while_it_is_sent_does_not_drive() -> None:
    robot = BusyRobot(two_rooms())
    drives = DriveBook(robot, when_busy=WhenBusy.WAIT)
    await start(drives, NEAR)
    waiting = await start(drives, FAR, client="two")
    await robot.sleep(5.0)
    async with anyio.create_task_group() as tasks:

        async def cancel() -> None:
            tasks.start_soon(drives.cancel, waiting.goal_id)
            await anyio.wait_all_tasks_blocked()

        robot.while_accepting = cancel
        await drives.watch()
    assert await state_of(drives, waiting) is GoalState.CANCELLED
    assert len(robot.ended) == len(robot.goals)


async def test_a_goal_that_waits_for_an_owed_stop_is_not_sent_after_another_stop() -> None:
    robot = BusyRobot(two_rooms())
    drives = DriveBook(robot)
    blocked = await start(drives, FAR)
    robot.end_goal(GoalState.BLOCKED)
    async with anyio.create_task_group() as tasks:

        async def send() -> None:
            with pytest.raises(GoalError, match="was stopped while"):
                await start(drives, NEAR)

        async def stop_again() -> None:
            tasks.start_soon(send)
            await anyio.wait_all_tasks_blocked()
            await drives.stop()

        robot.while_stopping = stop_again
        await drives.report(blocked.goal_id)
    assert len(robot.goals) == 1


async def test_who_gives_up_waiting_for_the_latest_drive_ends_no_drive_of_another_client() -> None:
    robot = FakeRobot(two_rooms())
    drives = DriveBook(robot)
    await start(drives, FAR, client="one")
    with anyio.CancelScope() as scope:

        async def lose_to_another(_report: object) -> None:
            await start(drives, NEAR, client="two")
            scope.cancel()
            await anyio.lowlevel.checkpoint()

        await drives.wait(None, wait_s=20.0, on_progress=lose_to_another)
    latest = drives.latest
    assert latest is not None
    assert latest.caller.session == "two"
    assert await state_of(drives, latest) is GoalState.DRIVING


async def test_a_drive_whose_client_is_gone_does_not_begin_after_those_of_others(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    session = Session(robot, SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0)
    session.drives = DriveBook(robot, when_busy=WhenBusy.WAIT)
    under_way = await start(session.drives, NEAR, client="one")
    of_gone = await start(session.drives, FAR, client="two")
    of_third = await start(session.drives, FAR, client="three")
    await session.client_is_gone("two")
    assert await state_of(session.drives, under_way) is GoalState.DRIVING
    told = await session.drives.report(of_gone.goal_id)
    assert told.status.state is GoalState.CANCELLED
    assert told.status.cause is not None
    assert told.status.cause.code is CauseCode.CLIENT_GONE
    assert await state_of(session.drives, of_third) is GoalState.PLANNED


async def test_a_clients_newer_drive_takes_the_turn_of_its_older_one_that_waits() -> None:
    robot = FakeRobot(two_rooms())
    drives = DriveBook(robot, when_busy=WhenBusy.WAIT)
    await start(drives, NEAR, client="one")
    older = await start(drives, ELSEWHERE, client="two")
    await start(drives, FAR, client="two")
    assert await state_of(drives, older) is GoalState.CANCELLED
    await robot.sleep(5.0)
    await drives.watch()
    assert list(robot.goals.values()) == [NEAR, FAR]


async def test_a_drive_under_way_is_known_however_many_wait() -> None:
    drives = DriveBook(FakeRobot(two_rooms()), when_busy=WhenBusy.WAIT)
    under_way = await start(drives, FAR)
    for number in range(210):
        await start(drives, NEAR, client=f"client {number}")
    assert drives.under_way is not None
    assert drives.under_way.goal_id == under_way.goal_id
