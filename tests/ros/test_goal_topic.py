"""Goals on a topic: their end is judged by the robot's own pose."""

import math

import pytest

from mapspeak.geometry import Pose
from mapspeak.links.rosbridge import RobotAddress, open_client
from mapspeak.robot import GoalState, StampedPose
from mapspeak.ros.discovery.profile import RobotProfile
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.robot.driving import GoalTopicDriver
from rosbridge_script import ScriptedServer, running

pytestmark = pytest.mark.anyio
ROBOT = RobotProfile(name="robot", dialect=Dialect.ROS2)


@pytest.mark.parametrize("obeys_headings", [True, False])
async def test_a_turn_has_ended_when_the_robot_has_turned_or_stands_for_a_while(
    obeys_headings: bool,  # noqa: FBT001 - a parameter of pytest
) -> None:
    here, now_s = Pose(1.0, 1.0, 0.0), 0.0

    async def fetch_pose() -> StampedPose:
        return StampedPose(here, now_s)

    server = ScriptedServer()
    async with running(server), open_client(RobotAddress(url=server.url)) as client:
        driver = GoalTopicDriver(
            client,
            "/goal_pose",
            profile=lambda: ROBOT,
            fetch_pose=fetch_pose,
            now_s=lambda: now_s,
        )
        record = await driver.send(Pose(1.0, 1.0, math.pi / 2))
        told: list[GoalState] = []
        for _ in range(4):
            await driver.look_at(record)
            now_s += 0.5
        told.append(record.status.state)
        if obeys_headings:
            here = Pose(1.0, 1.0, 1.5)
        for _ in range(3 if obeys_headings else 12):
            await driver.look_at(record)
            now_s += 0.5
        told.append(record.status.state)
    assert told == [GoalState.DRIVING, GoalState.ARRIVED]


async def test_a_robot_at_its_goal_has_arrived_though_its_clock_was_set_back() -> None:
    """A simulation that is found after the drive has begun has a clock of its own."""
    here, now_s = Pose(1.0, 1.0), 9_000.0

    async def fetch_pose() -> StampedPose:
        return StampedPose(here, now_s)

    server = ScriptedServer()
    async with running(server), open_client(RobotAddress(url=server.url)) as client:
        driver = GoalTopicDriver(
            client, "/goal_pose", profile=lambda: ROBOT, fetch_pose=fetch_pose, now_s=lambda: now_s
        )
        record = await driver.send(here)
        await driver.look_at(record)
        now_s = 3.0
        await driver.look_at(record)
        now_s = 4.0
        await driver.look_at(record)
    assert record.status.state is GoalState.ARRIVED
