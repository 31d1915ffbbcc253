"""mapspeak drives a robot on real ROS 1: rosbridge, rosapi, actionlib and rospy are real."""

import math
from collections.abc import Awaitable, Callable

import anyio
import pytest

from mapspeak.geometry import Pose
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.robot import GoalState, GoalStatus, Robot
from mapspeak.ros.link import Patience
from ros2.robot_process import RobotProcess

pytestmark = [pytest.mark.ros1, pytest.mark.anyio]

PATIENCE_S = 60.0
NEXT_ROOM = Pose(6.0, 1.4)
BRIEF = Patience(acceptance_s=1.0)
STANDS_M = 0.2


async def until(is_so: Callable[[], Awaitable[object]]) -> None:
    with anyio.fail_after(PATIENCE_S):
        while not await is_so():  # noqa: ASYNC110 - what happens, happens in other programs
            await anyio.sleep(0.05)


async def until_over(robot: Robot, goal_id: str) -> GoalStatus:
    async def is_over() -> bool:
        return (await robot.fetch_goal_status(goal_id)).state.is_final

    await until(is_over)
    return await robot.fetch_goal_status(goal_id)


async def test_a_robot_is_found_and_drives(robot: RobotProcess, rosbridge_url: str) -> None:
    async with open_rosbridge_robot(rosbridge_url) as link:
        assert (await link.fetch_map()).n_cols == 30
        status = await until_over(link, await link.send_goal(NEXT_ROOM))
    assert status.state is GoalState.ARRIVED
    assert robot.pose.point.distance_to(NEXT_ROOM.point) < 0.25


async def test_a_stop_ends_the_drive_and_zeroes_the_wheels(
    robot: RobotProcess, rosbridge_url: str
) -> None:
    async with open_rosbridge_robot(rosbridge_url) as link:
        goal_id = await link.send_goal(NEXT_ROOM)
        await link.stop()
        assert (await until_over(link, goal_id)).state is GoalState.CANCELLED
        assert not robot.is_driving
    assert robot.driven_m < STANDS_M
    assert (0.0, 0.0) in robot.velocities


async def test_a_newer_goal_replaces_the_one_before(
    robot: RobotProcess, rosbridge_url: str
) -> None:
    async with open_rosbridge_robot(rosbridge_url) as link:
        first = await link.send_goal(NEXT_ROOM)
        second = await link.send_goal(Pose(2.5, 1.4))
        assert (await link.fetch_goal_status(first)).state is GoalState.PREEMPTED
        assert (await until_over(link, second)).state is GoalState.ARRIVED
    assert robot.pose.x == pytest.approx(2.5, abs=0.25)


@pytest.mark.parametrize("has_stopped", [True, False])
async def test_a_goal_called_rejected_does_not_drive_when_it_comes_late(
    robot: RobotProcess, rosbridge_url: str, *, has_stopped: bool
) -> None:
    async def has_come() -> bool:
        return bool(robot.tell()["n_goals"]) and not robot.is_driving

    robot.set_faults(acceptance_s=math.inf)
    async with open_rosbridge_robot(rosbridge_url, patience=BRIEF) as link:
        status = await until_over(link, await link.send_goal(NEXT_ROOM))
        assert status.state is GoalState.REJECTED
        if has_stopped:
            await link.stop()
        robot.set_faults(acceptance_s=0.0)
        await until(has_come)
    assert robot.driven_m < STANDS_M


async def test_navigation_that_falls_silent_leaves_no_drive_that_is_told_as_over(
    robot: RobotProcess, rosbridge_url: str
) -> None:
    async with open_rosbridge_robot(rosbridge_url) as link:
        goal_id = await link.send_goal(NEXT_ROOM)
        robot.set_faults(hangs=True, has_watchdog=False, silent=["/move_base/status"])
        status = await until_over(link, goal_id)
        driven_m = robot.driven_m

        async def stands() -> bool:
            return robot.velocities[-1:] == [(0.0, 0.0)]

        await until(stands)
    assert status.state is GoalState.LOST
    assert robot.driven_m - driven_m < STANDS_M
