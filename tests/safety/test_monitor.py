import gc
import itertools
import math
from collections.abc import Callable

import pytest

from drawing import grid_from_text
from fakes import FakeRobot
from guarding import corners
from mapspeak.geometry import Point, Pose
from mapspeak.robot import Cause, CauseCode, StampedPose
from mapspeak.safety.monitor import (
    AT_AREA,
    GoalMonitor,
    KeepOutMonitor,
    Mover,
    StandingCheck,
    follow_arc,
)
from mapspeak.worldmodel.keepout import MARGIN_M, ClosedArea
from mapspeak.worldmodel.revision import MapRevision

RADIUS_M = 0.3
PIT = ClosedArea(name="pit", outline=corners((5.0, 0.0), (6.0, 2.0)))
FLOOR = MapRevision(grid_from_text("....\n....", resolution_m=3.0), radius_m=RADIUS_M, areas=(PIT,))


def watching() -> Callable[..., Cause | None]:
    monitor = KeepOutMonitor()

    def watch(here: Pose, *, now_s: float, told_s: float | None = None) -> Cause | None:
        stamped = StampedPose(here, now_s if told_s is None else told_s)
        return monitor.judge(FLOOR, stamped, now_s=now_s, mover=Mover.OTHERS)

    return watch


def judge(
    start: Point,
    *,
    heading_rad: float,
    speed_mps: float,
    seconds: float,
    turn_radps: float = 0.0,
    every_s: float = 0.1,
) -> Point | None:
    """Gives where a robot that drives on is told to stop; None where it is not."""
    watch = watching()
    x, y = start.x, start.y
    for tick in range(round(seconds / 0.01)):
        yaw_rad = heading_rad + turn_radps * tick * 0.01
        is_look = tick % round(every_s / 0.01) == 0
        if is_look and watch(Pose(x, y, yaw_rad), now_s=tick * 0.01):
            return Point(x, y)
        x += 0.01 * speed_mps * math.cos(yaw_rad)
        y += 0.01 * speed_mps * math.sin(yaw_rad)
    return None


@pytest.mark.parametrize("every_s", [0.1, 0.3])
@pytest.mark.parametrize("speed_mps", [0.05, 0.2, 0.5, 1.0, 1.5])
def test_a_robot_is_stopped_early_enough_to_brake_and_not_much_earlier(
    speed_mps: float, every_s: float
) -> None:
    start = Point(1.0, 1.0)
    stopped = judge(start, heading_rad=0.0, speed_mps=speed_mps, seconds=90, every_s=every_s)
    assert stopped is not None
    # It hears of the stop a little later, and brakes then.
    left_m = PIT.distance_to(stopped) - 0.2 * speed_mps - speed_mps**2 / 2
    assert RADIUS_M <= left_m <= RADIUS_M + MARGIN_M + 2 * every_s * speed_mps


@pytest.mark.parametrize("n_looks", [2, 4, 10, 20])
@pytest.mark.parametrize("speed_mps", [0.1, 0.3, 0.5, 0.8])
def test_a_robot_that_tells_its_pose_rarely_is_stopped_as_well(
    speed_mps: float, n_looks: int
) -> None:
    watch = watching()
    for tick in range(10_000):
        told_s = tick // n_looks * n_looks * 0.05
        here = Pose(1.0 + speed_mps * told_s, 1.0)
        if watch(here, now_s=tick * 0.05, told_s=told_s):
            break
    stopped = Point(1.0 + speed_mps * tick * 0.05, 1.0)
    left_m = PIT.distance_to(stopped) - 0.2 * speed_mps - speed_mps**2 / 2
    assert RADIUS_M <= left_m <= RADIUS_M + MARGIN_M + 2 * n_looks * 0.05 * speed_mps


def test_areas_that_are_there_no_more_are_forgotten() -> None:
    monitor = KeepOutMonitor()
    here = StampedPose(Pose(1.0, 1.0), 0.0)
    for number in range(50):
        area = ClosedArea(name=f"pit {number}", outline=PIT.outline)
        revision = FLOOR.with_areas((area,), ())
        monitor.judge(revision, here, now_s=number / 10, mover=Mover.OTHERS)
        del area, revision
    # `isinstance` would ask objects that stand for others, dead ones too.
    known = [each for each in gc.get_objects() if type(each) is ClosedArea]
    assert sum(each.name.startswith("pit ") for each in known) == 1


def test_a_robot_that_comes_to_a_stand_where_goals_may_be_is_let_go() -> None:
    watch = watching()
    left_m = 2.0
    for tick in range(200):
        here = Pose(5.0 - RADIUS_M - MARGIN_M - left_m, 1.0, 0.0)
        assert watch(here, now_s=tick / 10) is None
        left_m -= min(0.1 * min(math.sqrt(left_m), 0.8), left_m)


def test_a_robot_that_drives_along_an_area_is_let_go() -> None:
    start = Point(1.0, 2.0 + RADIUS_M + MARGIN_M)
    assert judge(start, heading_rad=0.0, speed_mps=1.0, seconds=10) is None


def test_a_robot_that_turns_away_from_an_area_in_time_is_let_go() -> None:
    start = Point(4.0, 1.0)
    way = {"heading_rad": 0.0, "speed_mps": 0.5, "seconds": 3.0}
    assert judge(start, turn_radps=1.0, **way) is None
    assert judge(start, turn_radps=0.1, **way) is not None


def test_a_robot_that_turns_towards_an_area_beside_it_is_stopped_in_time() -> None:
    start = Point(5.5, 2.0 + RADIUS_M + MARGIN_M)
    stopped = judge(start, heading_rad=math.pi, speed_mps=0.5, turn_radps=1.0, seconds=3.0)
    assert stopped is not None
    assert PIT.distance_to(stopped) >= RADIUS_M


@pytest.mark.parametrize("turned_rad", [-3.0, -0.4, 0.4, 3.0])
def test_a_robot_that_turned_on_the_spot_is_expected_to_go_straight_on(turned_rad: float) -> None:
    watch = watching()
    for pose, now_s in ((Pose(5.5, 2.6, turned_rad), 0.0), (Pose(5.6, 2.6, 0.0), 0.1)):
        assert watch(pose, now_s=now_s) is None


def test_a_robot_that_turns_towards_an_area_as_it_backs_is_stopped_in_time() -> None:
    watch = watching()
    backwards = (Pose(6.0, 2.6, 0.0), Pose(5.9, 2.595, 0.1), Pose(5.801, 2.58, 0.2))
    said = [watch(pose, now_s=tick / 10) for tick, pose in enumerate(backwards)]
    assert said[-1] is not None


def test_a_robot_that_cuts_a_corner_of_an_area_is_stopped() -> None:
    assert judge(Point(4.0, 2.9), heading_rad=-0.7, speed_mps=0.5, seconds=10) is not None


def test_a_robot_that_leaves_an_area_is_let_go() -> None:
    start = Point(5.2, 1.0)
    assert judge(start, heading_rad=math.pi, speed_mps=0.5, seconds=10) is None


def test_a_robot_that_has_left_an_area_may_not_come_back_to_where_it_began() -> None:
    watch = watching()
    for tick, x in enumerate((4.8, 4.7, 4.6, 4.5)):
        assert watch(Pose(x, 1.0, math.pi), now_s=tick / 10) is None
    assert watch(Pose(4.6, 1.0, math.pi), now_s=0.4) is not None


def test_a_robot_that_goes_deeper_into_an_area_is_stopped() -> None:
    start = Point(5.05, 1.0)
    assert judge(start, heading_rad=0.0, speed_mps=0.5, seconds=10) is not None


@pytest.mark.parametrize("x", [4.6, 4.7, 4.75])
def test_a_robot_that_stands_beside_an_area_may_turn_and_its_pose_may_waver(x: float) -> None:
    watch = watching()
    for tick in range(40):
        here = Pose(x + 0.004 * (-1) ** tick, 1.0, 0.1 * tick)
        assert watch(here, now_s=tick / 10) is None


@pytest.mark.parametrize("x", [4.6, 4.7, 4.75])
def test_a_robot_that_stands_beside_an_area_may_not_go_nearer(x: float) -> None:
    assert judge(Point(x, 1.0), heading_rad=0.0, speed_mps=0.2, seconds=3) is not None


def test_a_robot_in_an_area_that_was_not_seen_for_long_is_stopped() -> None:
    watch = watching()
    assert watch(Pose(4.0, 1.0, 0.0), now_s=0.0) is None
    assert watch(Pose(4.9, 1.0, 0.0), now_s=9.0) is not None


def test_a_pose_that_localisation_corrects_is_no_speed() -> None:
    watch = watching()
    assert watch(Pose(1.0, 1.0, 0.0), now_s=0.0) is None
    assert watch(Pose(2.0, 1.0, 0.0), now_s=0.1) is None
    assert watch(Pose(4.9, 1.0, 0.0), now_s=0.2) is not None


def test_a_robot_whose_clock_was_set_back_is_stopped_early_enough_to_brake() -> None:
    watch = watching()
    assert watch(Pose(1.0, 1.0, 0.0), now_s=9_000.0) is None
    told = [watch(Pose(3.0 + 0.1 * look, 1.0, 0.0), now_s=5.0 + 0.1 * look) for look in range(15)]
    assert next(look for look, fault in enumerate(told) if fault) <= 12


def test_a_pose_that_is_told_again_is_no_new_one_though_it_is_silent_for_longer() -> None:
    """A robot of 1.2 m/s whose frames come twice a second, and that is looked at ten times."""
    monitor = KeepOutMonitor()
    for look in range(30):
        n_frames, n_since = divmod(look, 5)
        pose = Pose(1.8 + 0.6 * n_frames, 1.0, 0.0)
        stamped = StampedPose(pose, 0.5 * n_frames, silent_s=0.1 * n_since)
        if monitor.judge(FLOOR, stamped, now_s=0.1 * look, mover=Mover.OTHERS):
            break
    assert pose.x <= 3.6


@pytest.mark.parametrize("mover", Mover)
def test_who_is_told_of_a_stop_is_told_what_drove_the_robot(mover: Mover) -> None:
    monitor = KeepOutMonitor()
    monitor.begin_at(StampedPose(Pose(4.6, 1.0), 0.0), now_s=0.0)
    here = StampedPose(Pose(4.68, 1.0), 0.2)
    said = monitor.judge(FLOOR, here, now_s=0.2, mover=mover)
    assert said is not None
    assert (said.code, said.name) == (AT_AREA[mover], "keep-out area 'pit'")


def test_a_goal_that_closes_or_fills_up_is_no_goal_any_more() -> None:
    closed = GoalMonitor(goal=Pose(5.5, 1.0), radius_m=RADIUS_M).judge(FLOOR, now_s=0.0)
    assert closed == Cause(code=CauseCode.GOAL_CLOSED, name="keep-out area 'pit'")
    off = GoalMonitor(goal=Pose(-3.0, 1.0), radius_m=RADIUS_M)
    assert off.judge(FLOOR, now_s=0.0) is None
    assert off.judge(FLOOR, now_s=6.0) == Cause(code=CauseCode.GOAL_OFF_MAP)


@pytest.mark.anyio
@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, math.pi, -2.0])
async def test_a_robot_stands_whatever_its_heading_until_it_moves_or_turns(yaw_rad: float) -> None:
    robot = FakeRobot(pose=Pose(1.0, 1.0, yaw_rad))
    robot.set_clock(500.0)
    check = StandingCheck(robot)
    assert [await check.is_standing() for _ in range(3)] == [True] * 3
    robot.pose = Pose(1.0, 1.0, yaw_rad + 0.1)
    assert [await check.is_standing() for _ in range(2)] == [False, True]
    robot.pose = Pose(1.05, 1.0, yaw_rad + 0.1)
    assert not await check.is_standing()


@pytest.mark.anyio
async def test_a_robot_whose_pose_is_old_is_not_known_to_stand() -> None:
    robot = FakeRobot(pose=Pose(1.0, 1.0))
    check = StandingCheck(robot)
    assert await check.is_standing()
    stale = await robot.fetch_pose()
    robot.set_clock(stale.stamp_s + 1.5)
    robot.fetch_pose = lambda: at_once(stale)  # type: ignore[method-assign]
    assert not await check.is_standing()


async def at_once(stamped: StampedPose) -> StampedPose:
    return stamped


@pytest.mark.parametrize("quarters", [1, 2, 3])
@pytest.mark.parametrize("turn_radps", [-1.0, 0.0, 0.4])
def test_an_arc_that_is_turned_leads_to_the_same_places_turned(
    quarters: int, turn_radps: float
) -> None:
    turn = Pose(0.0, 0.0, quarters * math.pi / 2)
    plain = follow_arc(Point(1.0, 2.0), 0.3, turn_radps, 2.0, n_steps=16)
    turned = follow_arc(
        turn.transform(Point(1.0, 2.0)), 0.3 + turn.yaw_rad, turn_radps, 2.0, n_steps=16
    )
    for here, there in zip(plain, turned, strict=True):
        assert turn.transform(here).distance_to(there) < 1e-9
    steps = [a.distance_to(b) for a, b in itertools.pairwise([Point(1.0, 2.0), *plain])]
    assert steps == pytest.approx([2.0 / 16] * 16)
    if turn_radps:
        middle = Pose(1.0, 2.0, 0.3).transform(Point(0.0, 1 / turn_radps))
        off_m = [each.distance_to(middle) - 1 / abs(turn_radps) for each in plain]
        assert off_m == pytest.approx([0.0] * 16, abs=0.01)
