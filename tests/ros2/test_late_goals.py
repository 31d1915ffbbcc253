"""Goals that a robot on real ROS 2 accepts too late do not drive it, over every link."""

from collections.abc import AsyncGenerator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager

import anyio
import pytest

from mapspeak.cli.shared.robots import read_network
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.links.rclpy import open_ros2_robot
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.robot import GoalState
from mapspeak.ros.link import Patience
from mapspeak.ros.robot import RosRobot
from ros2.robot_process import RobotProcess

pytestmark = [pytest.mark.ros2, pytest.mark.anyio]

NEXT_ROOM, NEARER = Pose(8.0, 2.25), Pose(3.0, 2.25)
SHORT = Patience(acceptance_s=0.5)
LATE_S = 2.0
PATIENCE_S = 30.0
SPEED_MPS = 2.0
"""The test robot's: four times that of the robots that the bounds are meant for."""
STILL_M = 0.4 * SPEED_MPS

OpenLink = Callable[[RobotProcess], AbstractAsyncContextManager[RosRobot]]


@asynccontextmanager
async def over_rclpy(_: RobotProcess) -> AsyncGenerator[RosRobot]:
    async with open_ros2_robot(patience=SHORT) as robot:
        yield robot


@asynccontextmanager
async def over_dds(process: RobotProcess) -> AsyncGenerator[RosRobot]:
    pytest.importorskip("cyclonedds", reason="has no wheel for this Python")
    from mapspeak.links.dds import open_dds_robot  # noqa: PLC0415 - optional

    async with open_dds_robot(read_network("", process.environment), patience=SHORT) as robot:
        yield robot


@pytest.fixture(params=["rclpy", "dds", "rosbridge"])
def open_link(request: pytest.FixtureRequest) -> OpenLink:
    if request.param != "rosbridge":
        return over_rclpy if request.param == "rclpy" else over_dds
    url = request.getfixturevalue("rosbridge_url")

    @asynccontextmanager
    async def over_rosbridge(_: RobotProcess) -> AsyncGenerator[RosRobot]:
        async with open_rosbridge_robot(url, patience=SHORT) as opened:
            yield opened

    return over_rosbridge


async def note_of(robot: RosRobot, goal_id: str) -> str:
    return (await robot.fetch_goal_status(goal_id)).afterwards


async def until_cancelled(robot: RosRobot, goal_id: str) -> None:
    with anyio.fail_after(PATIENCE_S):
        while "cancelled at once" not in await note_of(robot, goal_id):  # noqa: ASYNC110 - asked for
            await anyio.sleep(0.05)


@pytest.mark.parametrize("is_stopped", [False, True])
async def test_a_goal_that_was_called_rejected_does_not_drive_the_robot_later(
    robot: RobotProcess, open_link: OpenLink, *, is_stopped: bool
) -> None:
    robot.set_faults(acceptance_s=LATE_S)
    async with open_link(robot) as opened:
        goal_id = await opened.send_goal(NEXT_ROOM)
        state = (await opened.fetch_goal_status(goal_id)).state
        if is_stopped:
            await opened.stop()
        before_m = robot.driven_m
        await until_cancelled(opened, goal_id)
        await anyio.sleep(1.0)
        after_m = robot.driven_m
    assert state is GoalState.REJECTED
    assert not robot.is_driving
    assert after_m - before_m < STILL_M


async def test_a_goal_that_follows_a_rejected_one_is_told_as_it_truly_ends(
    robot: RobotProcess, open_link: OpenLink
) -> None:
    robot.set_faults(acceptance_s=LATE_S)
    async with open_link(robot) as opened:
        older = await opened.send_goal(NEXT_ROOM)
        assert (await opened.fetch_goal_status(older)).state is GoalState.REJECTED
        robot.set_faults(acceptance_s=0.0)
        newer = await opened.send_goal(NEARER)
        with anyio.fail_after(PATIENCE_S):
            while not (told := await opened.fetch_goal_status(newer)).state.is_final:  # noqa: ASYNC110
                await anyio.sleep(0.05)
        before_m = robot.driven_m
        left_m = robot.pose.point.distance_to(NEARER.point)
        await anyio.sleep(1.0)
        after_m = robot.driven_m
    assert (told.state is GoalState.ARRIVED) == (left_m < STILL_M)
    assert after_m - before_m < STILL_M


async def test_a_cancellation_that_navigation_refuses_is_told_as_refused(
    robot: RobotProcess, open_link: OpenLink
) -> None:
    robot.set_faults(ignores_cancels=True)
    async with open_link(robot) as opened:
        goal_id = await opened.send_goal(NEXT_ROOM)
        with pytest.raises(LinkError, match=r"refused to cancel|was told to end its goal"):
            await opened.cancel_goal(goal_id)
        robot.set_faults(ignores_cancels=False)
        await opened.stop()


async def test_a_robot_that_is_not_there_is_no_robot_to_stop(domain: dict[str, str]) -> None:
    assert domain
    with pytest.raises(LinkError, match="No other node"):
        async with open_ros2_robot(patience=SHORT):
            pass
