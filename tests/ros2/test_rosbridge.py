"""mapspeak drives a robot on real ROS 2 through the real rosbridge."""

import anyio
import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.geometry import Pose
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.robot import GoalState, GoalStatus, Robot
from ros2.conftest import START, TWO_ROOMS
from ros2.robot_process import RobotProcess

pytestmark = [pytest.mark.ros2, pytest.mark.anyio]

PATIENCE_S = 30.0
NEXT_ROOM = Pose(8.0, 2.25)
INSIDE_THE_WALL = Pose(5.25, 3.0)


async def until_over(robot: Robot, goal_id: str) -> GoalStatus:
    with anyio.fail_after(PATIENCE_S):
        while True:
            status = await robot.fetch_goal_status(goal_id)
            if status.state.is_final:
                return status
            await robot.sleep(0.1)


async def test_map_and_pose_are_the_robots(rosbridge_url: str) -> None:
    async with open_rosbridge_robot(rosbridge_url) as robot:
        assert np.array_equal((await robot.fetch_map()).cells, grid_from_text(TWO_ROOMS).cells)
        pose = (await robot.fetch_pose()).pose
        assert (pose.x, pose.y) == pytest.approx((START.x, START.y))


async def test_goals_arrive_and_walls_stop_them(robot: RobotProcess, rosbridge_url: str) -> None:
    async with open_rosbridge_robot(rosbridge_url) as linked:
        arrived = await until_over(linked, await linked.send_goal(NEXT_ROOM))
        assert arrived.state is GoalState.ARRIVED
        assert robot.pose.x == pytest.approx(NEXT_ROOM.x)
        blocked = await until_over(linked, await linked.send_goal(INSIDE_THE_WALL))
        assert blocked.state is GoalState.BLOCKED


async def test_stop_ends_a_drive(robot: RobotProcess, rosbridge_url: str) -> None:
    async with open_rosbridge_robot(rosbridge_url) as linked:
        goal_id = await linked.send_goal(NEXT_ROOM)
        await linked.stop()
        assert (await until_over(linked, goal_id)).state is GoalState.CANCELLED
        assert not robot.is_driving
