"""What a guarded robot does when two things are asked of it at once, or a stop is not heard."""

from collections.abc import Awaitable, Callable
from pathlib import Path

import anyio
import pytest

from drawing import grid_from_text
from fakes import FakeRobot, two_rooms
from guarding import make_guard, rectangle
from mapspeak.driving.drive import DriveBook
from mapspeak.errors import LinkError, PolicyError
from mapspeak.geometry import Pose
from mapspeak.robot import GoalState
from mapspeak.safety import Caller, GuardedRobot, MapReviser, Policy, calling

pytestmark = pytest.mark.anyio

HALL = grid_from_text(
    """
    ######################
    #....................#
    #....................#
    #....................#
    #....................#
    #....................#
    #....................#
    #....................#
    ######################
    """,
    resolution_m=0.5,
)
WEST, EAST, NEAR = Pose(1.5, 2.25), Pose(9.5, 2.25), Pose(2.5, 1.4)
PIT = Policy(areas=(rectangle("pit", (5.0, 1.5), (6.0, 3.0)),))
Deed = Callable[[], Awaitable[object]]


class SlowRobot(FakeRobot):
    """Takes its time to accept a goal, and lets a test do something meanwhile."""

    before: Deed | None = None
    after: Deed | None = None
    hears_stops = True

    async def send_goal(self, goal: Pose) -> str:
        before, after = self.before, self.after
        self.before = self.after = None
        if before is not None:
            await before()
        goal_id = await super().send_goal(goal)
        if after is not None:
            await after()
        return goal_id

    async def stop(self) -> None:
        if not self.hears_stops:
            raise LinkError("The line is dead.", hint="Wait.")
        await super().stop()

    async def hang_up(self) -> None:
        await anyio.lowlevel.checkpoint()
        raise LinkError("The line is dead.", hint="Wait.")

    async def reach_corner(self) -> None:
        """Drives to the end of the leg that it was sent last."""
        *_, leg = self.goals.values()
        while self.pose.point.distance_to(leg.point) > 0.01:
            await self.sleep(0.5)


def guarded(robot: FakeRobot, folder: Path, policy: Policy | None = None) -> GuardedRobot:
    guard = make_guard(folder, policy)
    reviser = MapReviser(guard.policy.areas, wall_clock=guard.wall_clock)
    return GuardedRobot(robot, guard=guard, reviser=reviser)


async def test_a_drive_that_is_cancelled_while_a_leg_is_sent_goes_no_further(
    tmp_path: Path,
) -> None:
    fake = SlowRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, PIT)
    goal_id = await robot.send_goal(EAST)
    await fake.reach_corner()

    async def cancel() -> None:
        await robot.cancel_goal(goal_id)

    fake.after = cancel
    await robot.fetch_goal_status(goal_id)
    assert len(fake.ended) == len(fake.goals)
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.CANCELLED


async def test_a_leg_is_not_sent_after_a_newer_goal(tmp_path: Path) -> None:
    fake = SlowRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, PIT)
    older = await robot.send_goal(EAST)

    # The leg's end is seen before navigation has accepted the newer goal.
    fake.before, fake.after = fake.reach_corner, robot.watch
    newer = await robot.send_goal(WEST)
    assert list(fake.goals.values())[-1] == WEST
    assert (await robot.fetch_goal_status(newer)).state is GoalState.DRIVING
    assert (await robot.fetch_goal_status(older)).state is GoalState.PREEMPTED


async def test_a_newer_goal_is_sent_after_a_leg_that_is_on_its_way(tmp_path: Path) -> None:
    fake = SlowRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, PIT)
    older = await robot.send_goal(EAST)
    await fake.reach_corner()
    async with anyio.create_task_group() as tasks:

        async def send() -> None:
            await robot.send_goal(WEST)

        async def begin_to_send() -> None:
            tasks.start_soon(send)
            await anyio.wait_all_tasks_blocked()

        fake.before = begin_to_send
        await robot.fetch_goal_status(older)
    assert list(fake.goals.values())[-1] == WEST
    assert (await robot.fetch_goal_status("fake-3")).state is GoalState.DRIVING


async def test_a_robot_that_may_have_taken_a_goal_is_stopped_as_soon_as_it_hears(
    tmp_path: Path,
) -> None:
    fake = SlowRobot(two_rooms())
    robot = guarded(fake, tmp_path)
    fake.hears_stops, fake.after = False, fake.hang_up
    with pytest.raises(LinkError):
        await robot.send_goal(NEAR)
    with pytest.raises(LinkError):
        await robot.watch()
    assert not fake.ended
    fake.hears_stops = True
    await robot.watch()
    assert list(fake.ended) == ["fake-1"]
    await robot.watch()
    assert fake.n_stops == 1


async def test_a_robot_that_missed_a_stop_is_left_to_its_newer_goal(tmp_path: Path) -> None:
    fake = SlowRobot(two_rooms())
    robot = guarded(fake, tmp_path)
    fake.hears_stops, fake.after = False, fake.hang_up
    with pytest.raises(LinkError):
        await robot.send_goal(NEAR)
    fake.hears_stops = True
    newer = await robot.send_goal(NEAR)
    await robot.watch()
    assert (await robot.fetch_goal_status(newer)).state is GoalState.DRIVING


async def test_a_leg_that_cannot_be_noted_is_not_driven_and_its_drive_can_be_cancelled(
    tmp_path: Path,
) -> None:
    fake = SlowRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, PIT)
    goal_id = await robot.send_goal(EAST)
    await fake.reach_corner()
    (tmp_path / "audit.jsonl").unlink()
    (tmp_path / "audit.jsonl").mkdir()
    with pytest.raises(PolicyError):
        await robot.fetch_goal_status(goal_id)
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.BLOCKED
    assert len(fake.goals) == 1


@pytest.mark.parametrize("stopped_by", ["monitor", "failed send", "bad end"])
async def test_only_a_clients_own_stop_latches(tmp_path: Path, stopped_by: str) -> None:
    fake = SlowRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=PIT.areas, latches_on_stop=True))
    drives = DriveBook(robot)
    with calling(Caller(client="tester", tool="navigate_to")):
        if stopped_by == "failed send":
            fake.after = fake.hang_up
            with pytest.raises(LinkError):
                await robot.send_goal(EAST)
        else:
            with drives.preparing() as ticket:
                drive = await drives.start(Pose(4.0, 2.25), place="there", ticket=ticket)
            if stopped_by == "monitor":
                fake.goals["fake-1"] = EAST
            else:
                fake.end_goal(GoalState.BLOCKED)
            await robot.sleep(10.0)
            assert (await drives.report(drive.goal_id)).status.state.is_final
    assert fake.n_stops
    await robot.send_goal(WEST)


class BegunAnew(FakeRobot):
    """A simulated robot whose clock is set back after a while."""

    async def sleep(self, duration_s: float) -> None:
        await super().sleep(duration_s)
        if self.now_s > 1_000.5:
            self.set_clock(0.0)


async def test_a_clock_that_is_set_back_prolongs_no_sleep(tmp_path: Path) -> None:
    fake = BegunAnew(HALL, pose=WEST)
    fake.set_clock(1_000.0)
    await guarded(fake, tmp_path, PIT).sleep(2.0)
    assert fake.now_s < 5.0
