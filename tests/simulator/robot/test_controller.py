import math

import numpy as np
import pytest

from mapspeak.geometry import Point, Pose
from mapspeak.simulator.robot.controller import Obstacles
from mapspeak.simulator.robot.physics import BodyVelocity
from mapspeak.simulator.worlds.world import BODY_RADIUS_M

AHEAD = BodyVelocity(0.8, 0.0)


def points(*places: tuple[float, float]) -> np.ndarray[tuple[int, int]]:
    return np.array(places, dtype=float).reshape(-1, 2)


def wall_ahead(distance_m: float) -> Obstacles:
    return Obstacles(points(*[(distance_m, y) for y in np.linspace(-1.0, 1.0, 41)]))


def test_nothing_near_limits_nothing() -> None:
    assert Obstacles(points()).limit(AHEAD) == AHEAD
    assert wall_ahead(2.0).limit(AHEAD) == AHEAD
    assert Obstacles(points()).room_m == math.inf


def test_before_a_wall_the_robot_slows_down_and_then_stands() -> None:
    assert 0 < wall_ahead(BODY_RADIUS_M + 0.15).limit(AHEAD).speed_mps < AHEAD.speed_mps
    assert wall_ahead(BODY_RADIUS_M + 0.03).limit(AHEAD).speed_mps == 0


def test_turning_on_the_spot_and_leaving_are_always_allowed() -> None:
    too_near = wall_ahead(BODY_RADIUS_M + 0.005)

    assert too_near.limit(BodyVelocity(0.0, 1.0)) == BodyVelocity(0.0, 1.0)
    assert too_near.limit(BodyVelocity(-0.15, 0.0)) == BodyVelocity(-0.15, 0.0)


def test_a_blocked_arc_leaves_its_turn() -> None:
    assert wall_ahead(BODY_RADIUS_M).limit(BodyVelocity(0.8, 0.5)) == BodyVelocity(0.0, 0.5)


def test_a_way_is_free_when_the_body_fits_all_along_it() -> None:
    beside = Obstacles(points((0.5, BODY_RADIUS_M + 0.05)))
    in_the_way = Obstacles(points((0.5, BODY_RADIUS_M - 0.05)))

    assert beside.is_way_free(Point(1.0, 0.0))
    assert not in_the_way.is_way_free(Point(1.0, 0.0))
    assert in_the_way.is_way_free(Point(-1.0, 0.0))


def test_a_sidestep_goes_round_what_is_in_the_way_on_the_free_side() -> None:
    left_is_blocked = Obstacles(points((0.35, 0.1), (0.3, 0.25), (0.2, 0.35)))

    step = left_is_blocked.sidestep(Point(0.15, 0.0))

    assert step.y < 0
    assert math.hypot(step.x, step.y) == pytest.approx(0.15)


def test_points_are_moved_along_as_the_robot_moves_on() -> None:
    now_from_then = Pose(0.5, 0.0, math.pi / 2).inverse()

    moved = Obstacles.seen_from(points((0.5, 1.0)), now_from_then)

    assert not moved.is_way_free(Point(1.0, 0.0))
    assert moved.room_m == pytest.approx(1.0 - BODY_RADIUS_M)
