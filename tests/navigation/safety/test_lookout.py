import math

import pytest

from drawing import grid_from_text
from guarding import corners
from mapspeak.geometry import Point, Pose
from mapspeak.navigation.closures import ClosedArea
from mapspeak.navigation.revision import MapRevision
from mapspeak.navigation.safety.lookout import Lookout

RADIUS_M = 0.3
PIT = ClosedArea(name="pit", outline=corners((5.0, 0.0), (6.0, 2.0)))
FLOOR = MapRevision(grid_from_text("....\n....", resolution_m=3.0), radius_m=RADIUS_M, areas=(PIT,))


def judge(start: Point, *, heading_rad: float, speed_mps: float, seconds: float) -> Point | None:
    """Gives where a robot that drives straight on is told to stop; None where it is not."""
    lookout = Lookout(goal=Pose(11.0, 5.0), radius_m=RADIUS_M)
    for tick in range(int(seconds * 10)):
        way_m = speed_mps * tick / 10
        here = Point(
            start.x + way_m * math.cos(heading_rad), start.y + way_m * math.sin(heading_rad)
        )
        if lookout.judge_motion(FLOOR, here, now_s=tick / 10):
            return here
    return None


@pytest.mark.parametrize("speed_mps", [0.05, 0.2, 0.5, 1.0, 1.5])
def test_a_robot_is_stopped_early_enough_to_brake_and_not_much_earlier(speed_mps: float) -> None:
    stopped = judge(Point(1.0, 1.0), heading_rad=0.0, speed_mps=speed_mps, seconds=120)
    assert stopped is not None
    braking_m = speed_mps**2 / 2
    left_m = PIT.distance_to(stopped) - braking_m
    assert RADIUS_M - 0.06 <= left_m <= RADIUS_M + 0.35 * speed_mps


def test_a_robot_that_drives_along_an_area_is_let_go() -> None:
    start = Point(1.0, 2.0 + RADIUS_M)
    assert judge(start, heading_rad=0.0, speed_mps=1.0, seconds=10) is None


def test_a_robot_that_cuts_a_corner_of_an_area_is_stopped() -> None:
    assert judge(Point(4.0, 2.9), heading_rad=-0.7, speed_mps=0.5, seconds=10) is not None


def test_a_robot_that_leaves_an_area_is_let_go() -> None:
    start = Point(5.2, 1.0)
    assert judge(start, heading_rad=math.pi, speed_mps=0.5, seconds=10) is None


def test_a_robot_that_goes_deeper_into_an_area_is_stopped() -> None:
    start = Point(5.05, 1.0)
    assert judge(start, heading_rad=0.0, speed_mps=0.5, seconds=10) is not None


def test_a_robot_that_stands_is_not_stopped() -> None:
    start = Point(4.75, 1.0)
    assert judge(start, heading_rad=0.0, speed_mps=0.0, seconds=10) is None


def test_a_clock_that_jumps_back_still_asks_for_the_map() -> None:
    lookout = Lookout(goal=Pose(1.0, 1.0), radius_m=RADIUS_M)
    assert lookout.is_map_due(1000.0)
    assert not lookout.is_map_due(1000.5)
    assert lookout.is_map_due(3.0)
