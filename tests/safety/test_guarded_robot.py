from collections.abc import Awaitable, Callable
from datetime import time
from pathlib import Path

import anyio
import pytest

from causes import code_of, quote_of
from drawing import grid_from_text
from fakes import FakeRobot, scan_of, two_rooms
from guarding import WallClock, audit_of, corners, make_guard, rectangle
from mapspeak.errors import GoalError, LinkError, PolicyError
from mapspeak.geometry import Pose
from mapspeak.installation import shell_command
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import CauseCode, GoalState, StampedPose
from mapspeak.safety import (
    Approval,
    ApprovalNeededError,
    AreaRule,
    Caller,
    CommandKind,
    GuardedRobot,
    Hours,
    MapReviser,
    Otherwise,
    Policy,
    calling,
)
from mapspeak.safety.monitor import KEEP_M
from mapspeak.session import Session
from mapspeak.worldmodel.keepout import ClosedArea

pytestmark = pytest.mark.anyio

NEAR, FAR = Pose(2.5, 1.4), Pose(6.0, 1.4)
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
FINE_HALL = grid_from_text("\n".join("." * 90 for _ in range(40)), resolution_m=0.05)
WEST, EAST = Pose(1.5, 2.25), Pose(9.5, 2.25)
MIDDLE = rectangle("pit", (5.0, 1.5), (6.0, 3.0))
AREA = ClosedArea(name="pit", outline=MIDDLE.outline)


def guarded(
    robot: FakeRobot, folder: Path, policy: Policy | None = None, clock: WallClock | None = None
) -> GuardedRobot:
    guard = make_guard(folder, policy, clock=clock)
    reviser = MapReviser(guard.policy.areas, wall_clock=guard.wall_clock)
    return GuardedRobot(robot, guard=guard, reviser=reviser)


async def refusal_of(robot: GuardedRobot, goal: Pose) -> str:
    with pytest.raises((GoalError, PolicyError)) as raised:
        await robot.send_goal(goal)
    return str(raised.value)


async def test_a_drive_is_noted_as_decided_answered_and_ended(tmp_path: Path) -> None:
    robot = guarded(FakeRobot(two_rooms()), tmp_path)
    with calling(Caller(client="tester", tool="navigate_to")):
        goal_id = await robot.send_goal(NEAR)
    await robot.sleep(5.0)
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.ARRIVED
    lines = audit_of(tmp_path)
    assert [line.event for line in lines] == ["decision", "result", "ended"]
    assert {line.number for line in lines} == {1}
    assert (lines[0].client, lines[0].tool, lines[0].verdict) == (
        "tester",
        "navigate_to",
        "allowed",
    )
    assert lines[0].details["x"] == 2.5
    assert lines[1].said == "accepted as fake-1"
    assert lines[2].said == "arrived"


async def test_what_the_laser_meets_passes_the_guard(tmp_path: Path) -> None:
    fake = FakeRobot(two_rooms())
    robot = guarded(fake, tmp_path)
    assert await robot.fetch_scan() is None
    fake.scan = scan_of(two_rooms(), fake.pose)
    assert await robot.fetch_scan() is fake.scan
    assert robot.description.has_laser


@pytest.mark.parametrize(
    "goal", [Pose(0.1, 0.1), Pose(40, 40), Pose(float("nan"), 0), Pose(1e300, 0)]
)
async def test_a_goal_that_no_way_leads_to_never_reaches_the_robot(
    tmp_path: Path, goal: Pose
) -> None:
    fake = FakeRobot(two_rooms())
    await refusal_of(guarded(fake, tmp_path), goal)
    assert not fake.goals
    (line,) = audit_of(tmp_path)
    assert (line.event, line.verdict) == ("decision", "refused")
    assert line.said.startswith("goals: ")


async def test_a_goal_in_a_keep_out_area_is_refused_with_its_name_and_another_pose(
    tmp_path: Path,
) -> None:
    fake = FakeRobot(HALL, pose=WEST)
    said = await refusal_of(guarded(fake, tmp_path, Policy(areas=(MIDDLE,))), Pose(5.5, 2.25))
    assert "lies in the keep-out area 'pit'" in said
    assert "The nearest pose that works is" in said
    assert not fake.goals


async def test_the_other_pose_is_one_that_is_allowed(tmp_path: Path) -> None:
    fake = FakeRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    said = await refusal_of(robot, Pose(5.5, 2.25))
    x, y = (float(word.strip(".,").partition("=")[2]) for word in said.split() if "=" in word)
    await robot.send_goal(Pose(x, y))
    assert fake.goals


async def test_a_goal_whose_only_way_is_closed_is_refused(tmp_path: Path) -> None:
    door = rectangle("door", (3.2, 0.0), (3.6, 2.75))
    fake = FakeRobot(two_rooms())
    said = await refusal_of(guarded(fake, tmp_path, Policy(areas=(door,))), FAR)
    assert "every known way to" in said
    assert "leads over the keep-out area 'door'" in said
    assert not fake.goals


async def test_a_robot_that_stands_in_a_closed_area_is_told_so(tmp_path: Path) -> None:
    hall = rectangle("hall", (0.0, 0.0), (11.0, 4.5))
    robot = guarded(FakeRobot(HALL, pose=WEST), tmp_path, Policy(areas=(hall,)))
    assert "lies in the keep-out area 'hall'" in await refusal_of(robot, EAST)
    west = rectangle("west", (0.0, 0.0), (5.0, 4.5))
    robot = guarded(FakeRobot(HALL, pose=WEST), tmp_path, Policy(areas=(west,)))
    said = await refusal_of(robot, EAST)
    assert "the robot itself stands in the keep-out area 'west'" in said


async def test_an_area_is_closed_at_its_hours_only(tmp_path: Path) -> None:
    hours = Hours(begins=time(8), ends=time(14))
    outline = corners((5.0, 0.0), (7.0, 2.75))
    clock = WallClock()
    fake = FakeRobot(two_rooms())
    policy = Policy(areas=(AreaRule(name="east", outline=outline, hours=hours),))
    robot = guarded(fake, tmp_path, policy, clock)
    assert "area 'east', closed until 14:00" in await refusal_of(robot, FAR)
    clock.now = clock.now.replace(hour=14)
    await robot.send_goal(FAR)
    assert fake.goals


async def test_a_region_is_closed_by_its_id(tmp_path: Path) -> None:
    fake = FakeRobot(two_rooms())
    policy = Policy(areas=(AreaRule(name="the east room", region_id="R1"),))
    robot = guarded(fake, tmp_path, policy)
    assert "the east room" in await refusal_of(robot, FAR)
    await robot.send_goal(NEAR)
    assert len(fake.goals) == 1


async def test_a_robot_whose_navigation_knows_no_areas_is_led_round_them_in_legs(
    tmp_path: Path,
) -> None:
    fake = FakeRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    pit = ClosedArea(name="pit", outline=MIDDLE.outline)
    goal_id = await robot.send_goal(EAST)
    lengths_m, nearest_m = [], 99.0
    while not (status := await robot.fetch_goal_status(goal_id)).state.is_final:
        lengths_m.append(status.distance_left_m or 0.0)
        nearest_m = min(nearest_m, pit.distance_to(fake.pose.point))
        await robot.sleep(0.2)
    assert status.state is GoalState.ARRIVED
    assert fake.pose == EAST
    assert nearest_m >= fake.description.radius_m + KEEP_M
    assert lengths_m == sorted(lengths_m, reverse=True)
    assert lengths_m[0] > 8.0
    n_legs = [line.event for line in audit_of(tmp_path)].count("leg")
    assert n_legs == len(fake.goals) - 1 > 0
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.ARRIVED


async def test_legs_go_on_though_nobody_asks_how_the_drive_stands(tmp_path: Path) -> None:
    fake = FakeRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    await robot.send_goal(EAST)
    await robot.sleep(30.0)
    assert fake.pose == EAST


@pytest.mark.parametrize("how", ["stop", "cancel_goal", "hold"])
async def test_a_drive_in_legs_that_is_ended_goes_no_further(tmp_path: Path, how: str) -> None:
    fake = FakeRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    goal_id = await robot.send_goal(EAST)
    await robot.sleep(0.5)
    match how:
        case "stop":
            await robot.stop()
        case "cancel_goal":
            await robot.cancel_goal(goal_id)
        case _:
            guard = make_guard(tmp_path)
            guard.hold.put("a test", at=guard.wall_clock())
    await robot.sleep(30.0)
    assert len(fake.goals) == 1
    assert fake.pose.x < 3.0
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.CANCELLED


class LegRefusingRobot(FakeRobot):
    """Does not take the second leg, and lets a test break the line for stops too."""

    hears_stops = True

    async def send_goal(self, goal: Pose) -> str:
        if len(self.goals) == 1:
            raise LinkError("The line is dead.", hint="Wait.")
        return await super().send_goal(goal)

    async def stop(self) -> None:
        if not self.hears_stops:
            raise LinkError("The line is dead.", hint="Wait.")
        await super().stop()


@pytest.mark.parametrize("hears_stops", [True, False])
async def test_a_drive_whose_next_leg_cannot_be_sent_has_not_arrived_and_goes_no_further(
    tmp_path: Path,
    hears_stops: bool,  # noqa: FBT001 - a parameter of pytest
) -> None:
    fake = LegRefusingRobot(HALL, pose=WEST)
    fake.hears_stops = hears_stops
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    goal_id = await robot.send_goal(EAST)
    with pytest.raises(LinkError):
        await robot.sleep(30.0)
    fake.hears_stops = True
    await robot.sleep(30.0)
    status = await robot.fetch_goal_status(goal_id)
    assert (status.state, code_of(status)) == (GoalState.BLOCKED, CauseCode.NOT_SENT_ON)
    assert "The line is dead" in quote_of(status)
    assert len(fake.goals) == 1
    assert fake.pose.x < 5.0


class SwervingRobot(FakeRobot):
    """Drives east wherever it is sent."""

    async def send_goal(self, goal: Pose) -> str:
        assert goal.is_finite()
        return await super().send_goal(EAST)


async def test_a_robot_that_goes_another_way_is_stopped_before_it_enters_an_area(
    tmp_path: Path,
) -> None:
    fake = SwervingRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    goal_id = await robot.send_goal(EAST)
    await robot.sleep(20.0)
    status = await robot.fetch_goal_status(goal_id)
    assert status.state is GoalState.BLOCKED
    assert status.cause is not None
    assert status.cause.code is CauseCode.NAVIGATION_AT_AREA
    assert status.cause.name == "keep-out area 'pit'"
    assert fake.pose.x < 5.0 - fake.description.radius_m
    # It was led on once from there.
    assert fake.n_stops == 2
    assert [line.event for line in audit_of(tmp_path)][-2:] == ["stop", "ended"]


@pytest.mark.parametrize("sleep_s", [0.03, 0.1, 0.2, 0.25, 5.0])
async def test_a_drive_is_watched_however_short_the_waits_for_it_are(
    tmp_path: Path, sleep_s: float
) -> None:
    fake = SwervingRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    await robot.send_goal(EAST)
    while robot.now_s < 10.0:
        await robot.sleep(sleep_s)
    assert fake.n_stops == 2
    assert fake.pose.x < 5.0 - fake.description.radius_m


async def test_a_robot_inside_an_area_may_leave_it(tmp_path: Path) -> None:
    at_the_edge = Pose(5.1, 2.25)
    fake = FakeRobot(HALL, pose=at_the_edge)
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    goal_id = await robot.send_goal(WEST)
    await robot.sleep(20.0)
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.ARRIVED


async def test_a_robot_whose_own_way_would_graze_an_area_is_led_further_off(
    tmp_path: Path,
) -> None:
    start = Pose(1.0, 1.0)
    fake = FakeRobot(FINE_HALL, pose=start)
    pit = rectangle("pit", (2.0, 0.0), (2.5, 0.76))
    robot = guarded(fake, tmp_path, Policy(areas=(pit,)))
    await robot.send_goal(Pose(3.5, 1.0))
    nearest_m = 99.0
    for _ in range(60):
        nearest_m = min(
            nearest_m, ClosedArea(name="", outline=pit.outline).distance_to(fake.pose.point)
        )
        await robot.sleep(0.1)
    assert fake.pose == Pose(3.5, 1.0)
    assert nearest_m >= fake.description.radius_m + KEEP_M
    # It stops at the end of each leg.
    assert 2 <= len(fake.goals) <= 8


async def test_a_robot_beside_an_area_may_turn_where_it_stands(tmp_path: Path) -> None:
    beside = Pose(5.0 - 0.25, 2.25)
    fake = FakeRobot(HALL, pose=beside)
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    goal_id = await robot.send_goal(Pose(beside.x, beside.y, 2.0))
    await robot.sleep(2.0)
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.ARRIVED


async def test_a_robot_that_is_partly_over_an_area_may_not_even_turn(tmp_path: Path) -> None:
    over = Pose(5.0 - 0.15, 2.25)
    robot = guarded(FakeRobot(HALL, pose=over), tmp_path, Policy(areas=(MIDDLE,)))
    assert "keep-out area 'pit'" in await refusal_of(robot, Pose(over.x, over.y, 2.0))


async def test_a_robot_is_stopped_before_an_area_while_a_map_is_slow_to_come(
    tmp_path: Path,
) -> None:
    fake = SwervingRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    await robot.send_goal(EAST)
    fake.may_give_map = anyio.Event()
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(robot.watch_map)
        with anyio.fail_after(20.0):
            while not fake.n_stops:
                await fake.sleep(0.1)
                await robot.watch()
        tasks.cancel_scope.cancel()
    assert fake.pose.x < 5.0 - fake.description.radius_m


async def test_a_map_that_does_not_come_ends_no_drive(tmp_path: Path) -> None:
    fake = FakeRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path)
    goal_id = await robot.send_goal(EAST)
    fake.grid = None
    await robot.sleep(20.0)
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.ARRIVED


async def test_a_drive_along_an_area_is_not_stopped(tmp_path: Path) -> None:
    fake = FakeRobot(HALL, pose=Pose(1.5, 0.75))
    pit = rectangle("pit", (5.0, 1.6), (6.0, 3.0))
    robot = guarded(fake, tmp_path, Policy(areas=(pit,)))
    goal_id = await robot.send_goal(Pose(9.5, 0.75))
    await robot.sleep(20.0)
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.ARRIVED


async def test_a_drive_is_led_round_what_closes_on_its_way_without_a_stop(tmp_path: Path) -> None:
    clock = WallClock()
    pit = AreaRule(name="pit", outline=MIDDLE.outline, hours=Hours(begins=time(13)))
    fake = FakeRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(pit,)), clock)
    goal_id = await robot.send_goal(EAST)
    await robot.sleep(1.0)
    clock.now = clock.now.replace(hour=13)
    nearest_m = 99.0
    while not (status := await robot.fetch_goal_status(goal_id)).state.is_final:
        nearest_m = min(nearest_m, AREA.distance_to(fake.pose.point))
        await robot.sleep(0.2)
    assert status.state is GoalState.ARRIVED
    assert fake.pose == EAST
    assert fake.n_stops == 0
    assert nearest_m >= fake.description.radius_m + KEEP_M


async def test_a_drive_is_led_the_short_way_again_once_that_is_open(tmp_path: Path) -> None:
    clock = WallClock()
    pit = AreaRule(name="pit", outline=MIDDLE.outline, hours=Hours(ends=time(13)))
    fake = FakeRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(pit,)), clock)
    await robot.send_goal(EAST)
    await robot.sleep(0.5)
    clock.now = clock.now.replace(hour=13)
    await robot.sleep(2.0)
    assert list(fake.goals.values())[-1] == EAST


async def test_a_drive_that_no_other_way_is_left_for_ends_before_what_closed(
    tmp_path: Path,
) -> None:
    clock = WallClock()
    outline = corners((5.0, 0.0), (6.0, 4.5))
    wall = AreaRule(name="wall", outline=outline, hours=Hours(begins=time(13)))
    fake = FakeRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(wall,)), clock)
    goal_id = await robot.send_goal(EAST)
    await robot.sleep(1.0)
    clock.now = clock.now.replace(hour=13)
    await robot.sleep(20.0)
    status = await robot.fetch_goal_status(goal_id)
    assert (status.state, code_of(status)) == (GoalState.BLOCKED, CauseCode.NO_WAY_ROUND)
    assert fake.pose.x < 5.0 - fake.description.radius_m


class OnceSwervingRobot(FakeRobot):
    """Drives its own way to the first place that it is sent to."""

    async def send_goal(self, goal: Pose) -> str:
        return await super().send_goal(goal if self.goals else EAST)


async def test_a_robot_that_was_stopped_before_an_area_is_led_round_it(tmp_path: Path) -> None:
    fake = OnceSwervingRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    goal_id = await robot.send_goal(EAST)
    states = set()
    while not (status := await robot.fetch_goal_status(goal_id)).state.is_final:
        states.add(status.state)
        await robot.sleep(0.1)
    assert (status.state, fake.pose, fake.n_stops) == (GoalState.ARRIVED, EAST, 1)
    assert states == {GoalState.DRIVING}


@pytest.mark.parametrize("how", ["stop", "cancel_goal"])
async def test_a_drive_that_is_ended_while_the_robot_waits_before_an_area_goes_no_further(
    tmp_path: Path, how: str
) -> None:
    fake = OnceSwervingRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    goal_id = await robot.send_goal(EAST)
    while fake.n_stops == 0:
        await fake.sleep(0.1)
        await robot.watch()
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.DRIVING
    await (robot.stop() if how == "stop" else robot.cancel_goal(goal_id))
    await robot.sleep(20.0)
    assert len(fake.goals) == 1
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.CANCELLED


async def test_a_drive_ends_when_its_goal_is_closed_meanwhile(tmp_path: Path) -> None:
    clock = WallClock()
    outline = corners((8.0, 0.5), (10.5, 4.0))
    east = AreaRule(name="east", outline=outline, hours=Hours(begins=time(13), ends=time(14)))
    robot = guarded(FakeRobot(HALL, pose=WEST), tmp_path, Policy(areas=(east,)), clock)
    goal_id = await robot.send_goal(EAST)
    await robot.sleep(1.0)
    clock.now = clock.now.replace(hour=13)
    await robot.sleep(3.0)
    status = await robot.fetch_goal_status(goal_id)
    assert status.state is GoalState.BLOCKED
    assert status.cause is not None
    assert status.cause.code is CauseCode.GOAL_CLOSED
    assert "closed until 14:00" in status.cause.name


async def test_a_drive_ends_when_an_obstacle_stays_on_its_goal(tmp_path: Path) -> None:
    fake = FakeRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path)
    goal_id = await robot.send_goal(EAST)
    await robot.sleep(0.5)
    fake.grid = grid_from_text(("#" * 22 + "\n") * 9, resolution_m=0.5)
    await robot.sleep(7.0)
    status = await robot.fetch_goal_status(goal_id)
    assert status.state is GoalState.BLOCKED
    assert code_of(status) is CauseCode.GOAL_OCCUPIED


async def test_an_obstacle_that_passes_over_the_goal_ends_nothing(tmp_path: Path) -> None:
    fake = FakeRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path)
    goal_id = await robot.send_goal(EAST)
    await robot.sleep(0.5)
    fake.grid = grid_from_text(("#" * 22 + "\n") * 9, resolution_m=0.5)
    await robot.sleep(3.0)
    fake.grid = HALL
    await robot.sleep(7.0)
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.ARRIVED


async def test_a_hold_stops_the_robot_and_answers(tmp_path: Path) -> None:
    fake = FakeRobot(two_rooms())
    robot = guarded(fake, tmp_path)
    guard = make_guard(tmp_path)
    goal_id = await robot.send_goal(FAR)
    await robot.sleep(0.3)
    guard.hold.put("somebody fell", at=guard.wall_clock())
    await robot.obey_hold()
    assert fake.n_stops == 1
    assert guard.hold.answers() == ("fake robot",)
    status = await robot.fetch_goal_status(goal_id)
    assert status.state is GoalState.CANCELLED
    assert code_of(status) is CauseCode.HELD
    assert "somebody fell" in quote_of(status)
    assert "somebody fell" in await refusal_of(robot, NEAR)
    assert guard.hold.lift()
    await robot.send_goal(NEAR)


async def test_a_hold_stops_a_robot_that_drives_by_other_means_too(tmp_path: Path) -> None:
    fake = FakeRobot(two_rooms())
    guard = make_guard(tmp_path)
    guard.hold.put("by hand", at=guard.wall_clock())
    robot = guarded(fake, tmp_path)
    await robot.obey_hold()
    await robot.obey_hold()
    assert fake.n_stops == 1


async def test_a_held_robot_that_moves_again_is_stopped_again(tmp_path: Path) -> None:
    fake = FakeRobot(two_rooms())
    guard = make_guard(tmp_path)
    reviser = MapReviser((), wall_clock=guard.wall_clock)
    robot = GuardedRobot(fake, guard=guard, reviser=reviser, repeat_s=0.0)
    guard.hold.put("by hand", at=guard.wall_clock())
    for _ in range(3):
        await robot.obey_hold()
    assert fake.n_stops == 1
    await fake.send_goal(FAR)  # by another client
    await fake.sleep(0.2)
    await robot.obey_hold()
    assert fake.n_stops == 2
    assert list(fake.ended) == ["fake-1"]
    for _ in range(3):
        await robot.obey_hold()
    assert fake.n_stops == 2


async def test_a_held_robot_whose_pose_is_not_known_is_stopped_again_and_again(
    tmp_path: Path,
) -> None:
    fake = BlindRobot(two_rooms())
    fake.is_blind = True
    guard = make_guard(tmp_path)
    reviser = MapReviser((), wall_clock=guard.wall_clock)
    robot = GuardedRobot(fake, guard=guard, reviser=reviser, repeat_s=0.0)
    guard.hold.put("by hand", at=guard.wall_clock())
    for _ in range(4):
        await robot.obey_hold()
    assert fake.n_stops == 4
    guard.hold.lift()
    await robot.obey_hold()
    assert fake.n_stops == 4


async def test_stops_of_a_held_robot_are_repeated_no_faster_than_said(tmp_path: Path) -> None:
    fake = BlindRobot(two_rooms())
    fake.is_blind = True
    guard = make_guard(tmp_path)
    reviser = MapReviser((), wall_clock=guard.wall_clock)
    robot = GuardedRobot(fake, guard=guard, reviser=reviser, repeat_s=3600.0)
    guard.hold.put("by hand", at=guard.wall_clock())
    for _ in range(20):
        await robot.obey_hold()
    assert fake.n_stops == 2


async def test_a_goal_of_another_client_is_stopped_before_an_area(tmp_path: Path) -> None:
    fake = FakeRobot(FINE_HALL, pose=Pose(0.5, 1.0))
    robot = guarded(fake, tmp_path, Policy(areas=(rectangle("pit", (2.0, 0.5), (3.0, 1.5)),)))
    await fake.send_goal(Pose(4.0, 1.0))
    await robot.sleep(10.0)
    assert fake.n_stops == 1
    assert 2.0 - fake.pose.x >= 0.2 + KEEP_M
    assert "others_at_area (keep-out area 'pit'" in audit_of(tmp_path)[-1].said


async def test_a_robot_that_others_drive_away_from_areas_is_left_alone(tmp_path: Path) -> None:
    fake = FakeRobot(FINE_HALL, pose=Pose(1.72, 1.0))
    robot = guarded(fake, tmp_path, Policy(areas=(rectangle("pit", (2.0, 0.5), (3.0, 1.5)),)))
    await fake.send_goal(Pose(0.5, 1.0))
    await robot.sleep(5.0)
    assert fake.n_stops == 0
    assert fake.pose.x == 0.5


async def test_an_area_that_closes_later_is_watched_too(tmp_path: Path) -> None:
    clock = WallClock()
    hours = Hours(begins=time(13))
    outline = corners((2.0, 0.5), (3.0, 1.5))
    fake = FakeRobot(FINE_HALL, pose=Pose(0.5, 1.0))
    policy = Policy(areas=(AreaRule(name="lab", outline=outline, hours=hours),))
    robot = guarded(fake, tmp_path, policy, clock)
    await robot.sleep(5.0)
    clock.now = clock.now.replace(hour=13)
    await fake.send_goal(Pose(1.0, 1.0))
    await robot.sleep(2.0)
    await fake.send_goal(Pose(4.0, 1.0))
    await robot.sleep(10.0)
    assert fake.n_stops == 1
    assert fake.pose.x < 1.8


async def test_a_clients_stop_latches_where_the_policy_says_so(tmp_path: Path) -> None:
    robot = guarded(FakeRobot(two_rooms()), tmp_path, Policy(latches_on_stop=True))
    await robot.stop()
    await robot.send_goal(NEAR)
    with calling(Caller(client="tester", tool="stop_robot")):
        await robot.stop()
    assert "stop_robot stopped it" in await refusal_of(robot, NEAR)


async def test_a_clients_stop_does_not_latch_by_default(tmp_path: Path) -> None:
    robot = guarded(FakeRobot(two_rooms()), tmp_path)
    with calling(Caller(client="tester", tool="stop_robot")):
        await robot.stop()
    await robot.send_goal(NEAR)


async def test_an_audit_log_that_cannot_be_written_lets_nothing_move_but_stops(
    tmp_path: Path,
) -> None:
    (tmp_path / "audit.jsonl").mkdir()
    fake = FakeRobot(two_rooms())
    robot = guarded(fake, tmp_path)
    assert "audit log" in await refusal_of(robot, NEAR)
    assert not fake.goals
    await robot.stop()
    await robot.cancel_goal("any")
    assert fake.n_stops == 1


async def test_stopping_is_never_refused(tmp_path: Path) -> None:
    policy = Policy(is_read_only=True, rates=dict.fromkeys(CommandKind, 0))
    fake = FakeRobot(two_rooms())
    robot = guarded(fake, tmp_path, policy)
    for _ in range(50):
        await robot.stop()
    assert fake.n_stops == 50
    assert [line.event for line in audit_of(tmp_path)] == ["stop"] * 50


async def test_drives_are_counted_by_robot_time(tmp_path: Path) -> None:
    robot = guarded(FakeRobot(two_rooms()), tmp_path, Policy(rates={CommandKind.DRIVE: 2}))
    await robot.send_goal(NEAR)
    await robot.send_goal(FAR)
    assert "allows 2" in await refusal_of(robot, NEAR)
    await robot.sleep(61.0)
    await robot.send_goal(NEAR)


async def test_the_robot_keeps_its_clearance(tmp_path: Path) -> None:
    fake = FakeRobot(two_rooms())
    robot = guarded(fake, tmp_path, Policy(clearance_m=0.4))
    assert robot.description.radius_m == pytest.approx(0.6)
    assert "no known way" in await refusal_of(robot, FAR)


async def test_without_a_person_who_can_be_asked_a_drive_that_needs_one_is_refused(
    tmp_path: Path,
) -> None:
    fake = FakeRobot(two_rooms())
    robot = guarded(fake, tmp_path, Policy(approval=Approval(kinds=frozenset({CommandKind.DRIVE}))))
    said = await refusal_of(robot, NEAR)
    assert "May the robot drive to (2.50, 1.40)" in said
    assert not fake.goals
    assert audit_of(tmp_path)[0].verdict == "needs approval"


async def test_a_drive_that_waits_for_a_persons_word_gets_it_once(tmp_path: Path) -> None:
    approval = Approval(kinds=frozenset({CommandKind.DRIVE}), otherwise=Otherwise.QUEUE)
    robot = guarded(FakeRobot(two_rooms()), tmp_path, Policy(approval=approval))
    room = make_guard(tmp_path).approvals.room
    with calling(Caller(client="tester")):
        assert shell_command("approve") in await refusal_of(robot, NEAR)
        (request_id,) = room.list_waiting()
        assert "tester" in room.list_waiting()[request_id]
        room.approve(request_id)
    with calling(Caller(client="another")), pytest.raises(ApprovalNeededError):
        await robot.send_goal(NEAR)
    with calling(Caller(client="tester")):
        with pytest.raises(ApprovalNeededError):
            await robot.send_goal(FAR)
        await robot.send_goal(NEAR)
        with pytest.raises(ApprovalNeededError):
            await robot.send_goal(NEAR)


class SlowRobot(FakeRobot):
    """Takes its time to accept a goal, and does something meanwhile."""

    meanwhile: Callable[[], Awaitable[None]]

    async def send_goal(self, goal: Pose) -> str:
        goal_id = await super().send_goal(goal)
        await self.meanwhile()
        return goal_id


async def test_a_stop_while_the_robot_accepts_a_goal_ends_that_goal(tmp_path: Path) -> None:
    fake = SlowRobot(two_rooms())
    robot = guarded(fake, tmp_path)
    fake.meanwhile = robot.stop
    assert "was stopped before" in await refusal_of(robot, NEAR)
    assert list(fake.ended) == ["fake-1"]


async def test_a_robot_that_may_have_taken_a_goal_is_stopped_when_it_does_not_answer(
    tmp_path: Path,
) -> None:
    async def hang_up() -> None:
        raise LinkError("The line is dead.", hint="Wait.")

    fake = SlowRobot(two_rooms())
    fake.meanwhile = hang_up
    with pytest.raises(LinkError):
        await guarded(fake, tmp_path).send_goal(NEAR)
    assert list(fake.ended) == ["fake-1"]
    assert "The line is dead" in audit_of(tmp_path)[1].said


async def test_who_gives_up_while_the_robot_accepts_a_goal_gives_up_the_goal(
    tmp_path: Path,
) -> None:
    fake = SlowRobot(two_rooms())
    with anyio.CancelScope() as scope:

        async def give_up() -> None:
            scope.cancel()
            await anyio.lowlevel.checkpoint()

        fake.meanwhile = give_up
        await guarded(fake, tmp_path).send_goal(NEAR)
    assert list(fake.ended) == ["fake-1"]


async def test_who_gives_up_asking_while_a_leg_is_sent_does_not_give_up_the_drive(
    tmp_path: Path,
) -> None:
    fake = SlowRobot(HALL, pose=WEST)
    fake.meanwhile = anyio.lowlevel.checkpoint
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    goal_id = await robot.send_goal(EAST)
    leg = fake.goals["fake-1"]
    while fake.pose.point.distance_to(leg.point) > 0.01:
        await fake.sleep(0.5)
    with anyio.CancelScope() as scope:

        async def give_up() -> None:
            scope.cancel()
            await anyio.lowlevel.checkpoint()

        fake.meanwhile = give_up
        await robot.fetch_goal_status(goal_id)
    fake.meanwhile = anyio.lowlevel.checkpoint
    await robot.sleep(30.0)
    assert fake.pose == EAST
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.ARRIVED


async def test_a_newer_goal_ends_the_older_one_in_the_log_too(tmp_path: Path) -> None:
    robot = guarded(FakeRobot(two_rooms()), tmp_path)
    await robot.send_goal(FAR)
    await robot.send_goal(NEAR)
    (ended,) = [line for line in audit_of(tmp_path) if line.event == "ended"]
    assert ended.number == 1
    assert "preempted" in ended.said


class BlindRobot(FakeRobot):
    """Loses its pose when a test says so."""

    is_blind = False

    async def fetch_pose(self) -> StampedPose:
        if self.is_blind:
            raise LinkError("No pose.", hint="Wait.")
        return await super().fetch_pose()


async def test_a_short_time_without_a_pose_ends_nothing(tmp_path: Path) -> None:
    fake = BlindRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    await robot.send_goal(Pose(3.0, 2.25))
    fake.is_blind = True
    await robot.watch()
    assert fake.n_stops == 0


async def test_a_hold_is_obeyed_while_the_robot_is_slow_to_tell_its_map(tmp_path: Path) -> None:
    fake = FakeRobot(HALL, pose=WEST)
    guard = make_guard(tmp_path)
    session = Session(fake, SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0, guard=guard)
    await session.robot.send_goal(EAST)
    fake.may_give_map = anyio.Event()
    fake.map_was_asked_for = anyio.Event()
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(session.keep_watch)
        with anyio.fail_after(20.0):
            await fake.map_was_asked_for.wait()
            guard.hold.put("a test", at=guard.wall_clock())
            while not fake.n_stops:
                await anyio.lowlevel.checkpoint()
        tasks.cancel_scope.cancel()


class DeafRobot(FakeRobot):
    """Does not hear the first stop."""

    async def stop(self) -> None:
        await super().stop()
        if self.n_stops == 1:
            raise LinkError("The line is dead.", hint="Wait.")


async def test_a_stop_for_a_hold_that_failed_is_tried_again(tmp_path: Path) -> None:
    fake = DeafRobot(two_rooms())
    robot = guarded(fake, tmp_path)
    guard = make_guard(tmp_path)
    guard.hold.put("a test", at=guard.wall_clock())
    with pytest.raises(LinkError):
        await robot.obey_hold()
    assert guard.hold.answers() == ()
    assert guard.hold.failures() == (("fake robot", "The line is dead. Wait."),)
    await robot.obey_hold()
    assert fake.n_stops == 2
    assert guard.hold.answers() == ("fake robot",)
    assert guard.hold.failures() == ()


async def test_a_stop_before_an_area_that_failed_is_tried_again(tmp_path: Path) -> None:
    class DeafSwervingRobot(DeafRobot, SwervingRobot):
        """Goes its own way, and does not hear the first stop."""

    fake = DeafSwervingRobot(HALL, pose=WEST)
    robot = guarded(fake, tmp_path, Policy(areas=(MIDDLE,)))
    goal_id = await robot.send_goal(EAST)
    with pytest.raises(LinkError):
        await robot.sleep(20.0)
    await robot.sleep(5.0)
    assert fake.n_stops >= 1
    assert (await robot.fetch_goal_status(goal_id)).state.is_final


async def test_two_reasons_to_stop_at_once_while_no_stop_is_heard_break_no_watch(
    tmp_path: Path,
) -> None:
    class MuteRobot(SwervingRobot):
        """Hears no stop while a test says so, and takes its time not to."""

        is_mute = True

        async def stop(self) -> None:
            for _ in range(3):
                await anyio.lowlevel.checkpoint()
            if self.is_mute:
                raise LinkError("The line is dead.", hint="Wait.")
            await super().stop()

    fake = MuteRobot(HALL, pose=WEST)
    robot, guard = guarded(fake, tmp_path, Policy(areas=(MIDDLE,))), make_guard(tmp_path)
    goal_id = await robot.send_goal(EAST)
    while fake.pose.x < 4.0:
        await fake.sleep(0.1)
    await robot.watch()
    await fake.sleep(0.3)
    guard.hold.put("a test", at=guard.wall_clock())
    errors: list[LinkError] = []

    async def look(watch: Callable[[], Awaitable[None]]) -> None:
        try:
            await watch()
        except LinkError as error:
            errors.append(error)

    async with anyio.create_task_group() as tasks:
        tasks.start_soon(look, robot.obey_hold)
        tasks.start_soon(look, robot.watch)
    assert len(errors) == 2
    assert (await robot.fetch_goal_status(goal_id)).state is GoalState.DRIVING
    fake.is_mute = False
    await robot.obey_hold()
    assert (await robot.fetch_goal_status(goal_id)).state.is_final


async def test_a_session_that_ends_leaves_nothing_waiting_for_approval(tmp_path: Path) -> None:
    approval = Approval(kinds=frozenset({CommandKind.DRIVE}), otherwise=Otherwise.QUEUE)
    guard = make_guard(tmp_path, Policy(approval=approval))
    memory = SemanticMapStore(tmp_path / "m.yaml")
    session = Session(FakeRobot(two_rooms()), memory, lease_s=60.0, guard=guard)
    with pytest.raises(ApprovalNeededError):
        await session.robot.send_goal(NEAR)
    assert guard.approvals.room.list_waiting()
    await session.close()
    assert not guard.approvals.room.list_waiting()


async def test_an_approval_is_for_the_pose_that_was_asked_for(tmp_path: Path) -> None:
    approval = Approval(kinds=frozenset({CommandKind.DRIVE}), otherwise=Otherwise.QUEUE)
    robot = guarded(FakeRobot(two_rooms()), tmp_path, Policy(approval=approval))
    room = make_guard(tmp_path).approvals.room
    with calling(Caller(client="tester")):
        await refusal_of(robot, NEAR)
        (request_id,) = room.list_waiting()
        room.approve(request_id)
        for other in (Pose(NEAR.x + 0.2, NEAR.y), Pose(NEAR.x, NEAR.y, 0.5)):
            with pytest.raises(ApprovalNeededError):
                await robot.send_goal(other)
        await robot.send_goal(Pose(NEAR.x + 0.05, NEAR.y, 0.1))
