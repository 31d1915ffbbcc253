import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapspeak.geometry import Pose
from mapspeak.simulator.robot.physics import (
    MAX_ACCELERATION_MPS2,
    MAX_SPEED_MPS,
    MAX_TURN_RADPS,
    BodyVelocity,
    DifferentialDrive,
    Odometry,
    RobotBody,
    move_along_arc,
)
from mapspeak.simulator.worlds.slices import Slice
from mapspeak.simulator.worlds.world import BODY_RADIUS_M

TICK_S = 0.05
WALL_AT_2_M = Slice((np.array([[2.0, -5.0], [2.2, -5.0], [2.2, 5.0], [2.0, 5.0]]),))
speeds = st.floats(-MAX_SPEED_MPS, MAX_SPEED_MPS)
turns = st.floats(-MAX_TURN_RADPS, MAX_TURN_RADPS)


def drive(body: RobotBody, command: BodyVelocity, n_ticks: int) -> None:
    for _ in range(n_ticks):
        body.move(command, TICK_S)


@given(speeds, turns, st.floats(0.01, 1.0))
def test_an_arc_in_two_halves_is_the_whole_arc(speed: float, turn: float, duration: float) -> None:
    velocity, start = BodyVelocity(speed, turn), Pose(1.0, -2.0, 0.7)

    whole = move_along_arc(start, velocity, duration)
    halves = move_along_arc(move_along_arc(start, velocity, duration / 2), velocity, duration / 2)

    assert (halves.x, halves.y) == pytest.approx((whole.x, whole.y), abs=1e-9)
    assert math.cos(halves.yaw_rad - whole.yaw_rad) == pytest.approx(1.0)


def test_a_quarter_circle_ends_where_geometry_says() -> None:
    end = move_along_arc(Pose(0.0, 0.0), BodyVelocity(math.pi / 2, math.pi / 2), 1.0)

    assert (end.x, end.y, end.yaw_rad) == pytest.approx((1.0, 1.0, math.pi / 2))


def test_the_drive_gains_speed_no_faster_than_it_can_and_keeps_to_its_limits() -> None:
    drive = DifferentialDrive()

    first = drive.follow(BodyVelocity(5.0, -9.0), TICK_S)
    for _ in range(100):
        drive.follow(BodyVelocity(5.0, -9.0), TICK_S)

    assert first.speed_mps == pytest.approx(MAX_ACCELERATION_MPS2 * TICK_S)
    assert drive.velocity == BodyVelocity(MAX_SPEED_MPS, -MAX_TURN_RADPS)


def test_a_wall_stops_the_body_and_the_bump_is_counted_once() -> None:
    body = RobotBody(WALL_AT_2_M, Pose(0.0, 0.0))

    drive(body, BodyVelocity(1.0, 0.0), 100)

    assert body.n_collisions == 1
    assert body.world_from_base.x < 2.0 - BODY_RADIUS_M
    assert body.driven_m == pytest.approx(body.world_from_base.x)


def test_a_body_that_has_bumped_can_turn_back_off_and_bump_again() -> None:
    body = RobotBody(WALL_AT_2_M, Pose(0.0, 0.0))

    drive(body, BodyVelocity(1.0, 0.0), 100)
    drive(body, BodyVelocity(-0.5, 0.0), 40)
    assert body.world_from_base.x < 1.2
    drive(body, BodyVelocity(1.0, 0.0), 100)

    assert body.n_collisions == 2


def drive_odometry(seed: int, n_ticks: int) -> tuple[Pose, Pose]:
    """Drives a wide circle; gives where odometry and where truth end."""
    odometry = Odometry(random=np.random.default_rng(seed))
    true, step = Pose(0.0, 0.0), move_along_arc(Pose(0.0, 0.0), BodyVelocity(0.8, 0.2), TICK_S)
    for _ in range(n_ticks):
        true = true @ step
        odometry.record(step)
    return odometry.odom_from_base, true


def test_odometry_is_good_over_a_step_and_drifts_by_metres_over_a_long_run() -> None:
    short = [drive_odometry(seed, 10) for seed in range(8)]
    long = [drive_odometry(seed, 4000) for seed in range(8)]

    assert max(odom.point.distance_to(true.point) for odom, true in short) < 0.05
    assert max(odom.point.distance_to(true.point) for odom, true in long) > 1.0


def test_odometry_depends_on_its_seed_alone() -> None:
    assert drive_odometry(3, 100) == drive_odometry(3, 100)
    assert drive_odometry(3, 100) != drive_odometry(4, 100)


def test_wheels_that_stand_still_report_nothing() -> None:
    odometry = Odometry(random=np.random.default_rng(0))

    odometry.record(Pose(0.0, 0.0, 0.0))

    assert odometry.odom_from_base == Pose(0.0, 0.0, 0.0)
