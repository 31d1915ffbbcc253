"""What every link promises, whatever robot is behind it."""

import io
import math
import os
from collections.abc import AsyncGenerator, Callable, Iterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager, contextmanager
from pathlib import Path

import anyio
import numpy as np
import pytest
from PIL import Image

from fakes import FakeRobot, scan_of, two_rooms
from mapspeak.cli.shared.robots import read_network
from mapspeak.errors import MapspeakError
from mapspeak.geometry import Point, Pose
from mapspeak.links.rclpy import open_ros2_robot
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.links.simulated import Clock, open_simulated_robot
from mapspeak.robot import GoalState, GoalStatus, Robot
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server import open_rosbridge_server
from mapspeak.simulator import Simulation, load_world
from mapspeak.spatial import OccupancyGrid
from ros2.conftest import START, TWO_ROOMS, import_what_warns
from ros2.robot_process import open_robot_process, ros_environment
from ros2.rosbridge_process import open_rosbridge
from rosbridge_script import PATIENCE_S

pytestmark = pytest.mark.anyio

SPEED_MPS = 0.4
"""Of the robot on real ROS 2: a drive of a metre must not be over before it is looked at."""

OpenRobot = Callable[[], AbstractAsyncContextManager[Robot]]


@asynccontextmanager
async def open_fake() -> AsyncGenerator[Robot]:
    robot = FakeRobot(two_rooms())
    robot.scan = scan_of(two_rooms(), robot.pose)
    yield robot


@asynccontextmanager
async def open_simulated() -> AsyncGenerator[Robot]:
    simulation = Simulation(load_world("warehouse"), seed=1)
    async with open_simulated_robot(simulation, clock=Clock.VIRTUAL, has_detector=True) as robot:
        yield robot


@asynccontextmanager
async def open_over_rosbridge(dialect: Dialect) -> AsyncGenerator[Robot]:
    async with (
        open_simulated() as simulated,
        open_rosbridge_server(simulated, dialect=dialect) as server,
        open_rosbridge_robot(server.url) as robot,
    ):
        yield robot


def open_ros1() -> AbstractAsyncContextManager[Robot]:
    return open_over_rosbridge(Dialect.ROS1)


def open_ros2() -> AbstractAsyncContextManager[Robot]:
    return open_over_rosbridge(Dialect.ROS2)


@contextmanager
def real_ros2_robot() -> Iterator[dict[str, str]]:
    """A robot on real ROS 2, as a process of its own; gives what its domain is named by."""
    import_what_warns()
    environment = ros_environment()
    with (
        pytest.MonkeyPatch.context() as patch,
        open_robot_process(TWO_ROOMS, pose=START, speed_mps=SPEED_MPS, environment=environment),
    ):
        for name, value in environment.items():
            patch.setenv(name, value)
        yield environment


@asynccontextmanager
async def open_over_rclpy() -> AsyncGenerator[Robot]:
    with real_ros2_robot():
        async with open_ros2_robot() as robot:
            yield robot


@asynccontextmanager
async def open_over_dds() -> AsyncGenerator[Robot]:
    pytest.importorskip("cyclonedds", reason="has no wheel for this Python")
    from mapspeak.links.dds import open_dds_robot  # noqa: PLC0415 - optional

    with real_ros2_robot() as environment:
        async with open_dds_robot(read_network("", environment)) as robot:
            yield robot


@asynccontextmanager
async def open_over_real_rosbridge() -> AsyncGenerator[Robot]:
    source = os.environ.get("MAPSPEAK_ROSBRIDGE_SOURCE")
    if not source:
        pytest.skip("not run: MAPSPEAK_ROSBRIDGE_SOURCE names no folder with rosbridge_suite")
    with real_ros2_robot() as environment, open_rosbridge(Path(source), environment) as url:
        async with open_rosbridge_robot(url) as robot:
            yield robot


@pytest.fixture(
    params=[
        pytest.param(open_fake, id="fake"),
        pytest.param(open_simulated, id="simulated"),
        pytest.param(open_ros1, id="rosbridge-ros1"),
        pytest.param(open_ros2, id="rosbridge-ros2"),
        pytest.param(open_over_rclpy, id="rclpy", marks=pytest.mark.ros2),
        pytest.param(open_over_dds, id="dds", marks=pytest.mark.ros2),
        pytest.param(open_over_real_rosbridge, id="real-rosbridge", marks=pytest.mark.ros2),
    ],
)
def open_robot(request: pytest.FixtureRequest) -> OpenRobot:
    chosen: OpenRobot = request.param
    return chosen


async def ahead(robot: Robot, distance_m: float) -> Pose:
    here = (await robot.fetch_pose()).pose
    return here @ Pose(distance_m, 0.0)


async def until_over(robot: Robot, goal_id: str) -> GoalStatus:
    deadline_s = robot.now_s + 60.0
    status = await robot.fetch_goal_status(goal_id)
    while not status.state.is_final and robot.now_s < deadline_s:
        await robot.sleep(0.2)
        status = await robot.fetch_goal_status(goal_id)
    return status


async def test_the_robot_stands_on_free_floor_of_its_own_map(open_robot: OpenRobot) -> None:
    async with open_robot() as robot:
        grid = await robot.fetch_map()
        cell = grid.cell_at((await robot.fetch_pose()).pose.point)
    assert grid.contains(cell)
    assert grid.free[cell.row, cell.col]


async def test_a_drive_ends_where_it_was_sent(open_robot: OpenRobot) -> None:
    async with open_robot() as robot:
        goal = await ahead(robot, 1.0)
        status = await until_over(robot, await robot.send_goal(goal))
        pose = (await robot.fetch_pose()).pose
    assert status.state is GoalState.ARRIVED
    assert pose.point.distance_to(goal.point) < 0.25


async def test_a_drive_says_how_far_is_left_while_it_goes_on(open_robot: OpenRobot) -> None:
    async with open_robot() as robot:
        goal_id = await robot.send_goal(await ahead(robot, 1.0))
        await robot.sleep(0.3)
        status = await robot.fetch_goal_status(goal_id)
    assert not status.state.is_final
    assert status.distance_left_m == pytest.approx(0.9, abs=0.25)


async def test_a_cancelled_drive_leaves_the_robot_standing(open_robot: OpenRobot) -> None:
    async with open_robot() as robot:
        goal_id = await robot.send_goal(await ahead(robot, 1.5))
        await robot.sleep(0.5)
        await robot.cancel_goal(goal_id)
        await robot.sleep(1.0)
        before = (await robot.fetch_pose()).pose
        await robot.sleep(1.0)
        after = (await robot.fetch_pose()).pose
        status = await robot.fetch_goal_status(goal_id)
    assert status.state is GoalState.CANCELLED
    assert after.point.distance_to(before.point) < 0.02


async def test_stopping_ends_the_drive_under_way(open_robot: OpenRobot) -> None:
    async with open_robot() as robot:
        goal_id = await robot.send_goal(await ahead(robot, 1.5))
        await robot.sleep(0.5)
        await robot.stop()
        status = await robot.fetch_goal_status(goal_id)
    assert status.state is GoalState.CANCELLED


async def test_a_new_goal_ends_the_one_before(open_robot: OpenRobot) -> None:
    async with open_robot() as robot:
        first = await robot.send_goal(await ahead(robot, 1.5))
        second = await robot.send_goal(await ahead(robot, 0.5))
        replaced = await robot.fetch_goal_status(first)
        status = await until_over(robot, second)
    assert replaced.state in (GoalState.CANCELLED, GoalState.PREEMPTED)
    assert status.state is GoalState.ARRIVED


async def test_a_goal_that_nobody_sent_is_an_error(open_robot: OpenRobot) -> None:
    async with open_robot() as robot:
        with pytest.raises(MapspeakError):
            await robot.fetch_goal_status("no such goal")


async def test_robot_time_passes_while_one_sleeps(open_robot: OpenRobot) -> None:
    async with open_robot() as robot:
        before_s = robot.now_s
        await robot.sleep(1.0)
        passed_s = robot.now_s - before_s
    # A real clock goes on until a busy machine wakes us.
    assert 0.94 < passed_s < 3.0


async def test_a_scan_ends_at_what_the_map_has_ahead(open_robot: OpenRobot) -> None:
    async with open_robot() as robot:
        scan = None
        with anyio.fail_after(PATIENCE_S):
            # A link that has just begun to listen may miss the first ones.
            while scan is None:
                scan = await robot.fetch_scan()
        grid, here = await robot.fetch_map(), (await robot.fetch_pose()).pose
        assert robot.description.has_laser
    assert scan.pose.point.distance_to(here.point) < 0.1
    is_met = np.isfinite(scan.ranges_m)
    ends = [
        (scan.pose @ Pose(0.0, 0.0, angle_rad)).transform(Point(range_m, 0.0))
        for angle_rad, range_m in zip(scan.angles_rad[is_met], scan.ranges_m[is_met], strict=True)
    ]
    is_kept = [is_obstacle_beside(grid, end) for end in ends]
    assert is_met.sum() > 20
    assert np.mean(is_kept) > 0.9


def is_obstacle_beside(grid: OccupancyGrid, point: Point) -> bool:
    cell, n_beside = grid.cell_at(point), math.ceil(0.15 / grid.resolution_m)
    low_row, low_col = max(cell.row - n_beside, 0), max(cell.col - n_beside, 0)
    around = grid.occupied[low_row : cell.row + n_beside + 1, low_col : cell.col + n_beside + 1]
    return bool(around.any())


async def test_a_picture_is_as_large_as_it_says(open_robot: OpenRobot) -> None:
    async with open_robot() as robot:
        picture = await robot.fetch_picture()
    decoded = Image.open(io.BytesIO(picture.data))
    assert decoded.size == (picture.width_px, picture.height_px)
