"""The `ros` toolset on real ROS 2 through the real rosbridge."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from fakes import FakeRobot, two_rooms
from mapspeak.errors import LinkError
from mapspeak.links.rosbridge import RobotAddress, RosbridgeClient, open_client
from ros2.robot_process import RobotProcess
from rosbridge_robot import eventually
from rosserved import Caller, served
from served import pictures_of

pytestmark = [pytest.mark.ros2, pytest.mark.anyio]

ACTION = "/navigate_to_pose"
BUSY_S = 90.0
"""For everything together: on a busy machine a goal may have to be sent several times."""


@asynccontextmanager
async def tools(url: str, folder: Path) -> AsyncGenerator[Caller]:
    async with (
        open_client(RobotAddress(url=url)) as client,
        served(FakeRobot(two_rooms()), client, folder, within_s=BUSY_S) as caller,
    ):
        # rosbridge itself may not have seen rosapi yet.
        await eventually(lambda: sees_rosapi(client))
        yield caller


async def sees_rosapi(client: RosbridgeClient) -> bool:
    try:
        return bool((await client.fetch_graph()).actions)
    except LinkError:
        return False


def pose(x: float, y: float) -> dict[str, Any]:
    place = {"position": {"x": x, "y": y}, "orientation": {"w": 1}}
    return {"pose": {"header": {"frame_id": "map"}, "pose": place}}


async def test_what_there_is_is_told(rosbridge_url: str, tmp_path: Path) -> None:
    async with tools(rosbridge_url, tmp_path) as caller:
        overview = await caller.ask("ros_overview")
        topic = await caller.ask("ros_topic", topic="/scan")
        service = await caller.ask("ros_service", service="/switch_motors")
        action = await caller.ask("ros_action", action=ACTION)
        node = await caller.ask("ros_node", node="/robot")
    assert overview.startswith("ROS 2 kilted")
    assert "published by: /robot" in topic
    assert "data: bool" in service
    assert "pose: geometry_msgs/PoseStamped" in action
    assert "hears: /cmd_vel" in node


async def test_topics_are_read(rosbridge_url: str, tmp_path: Path) -> None:
    async with tools(rosbridge_url, tmp_path) as caller:
        seen = await caller.client.call_tool("ros_read", {"topic": "/map"})
        scan = await caller.ask("ros_read", topic="/scan")
        odometry = await caller.ask("ros_read", topic="/odom", duration_s=0.5)
    assert len(pictures_of(seen)) == 1
    assert "72 beams" in scan
    assert " Hz; the latest:" in odometry


async def test_a_velocity_ends_with_a_stand(
    robot: RobotProcess, rosbridge_url: str, tmp_path: Path
) -> None:
    async with tools(rosbridge_url, tmp_path) as caller:
        message = {"linear": {"x": 0.2}}

        async def is_heard() -> bool:
            await caller.ask("ros_publish", topic="/cmd_vel", fields=message, duration_s=0.5)
            return (0.2, 0.0) in robot.velocities

        # Between rosbridge and the robot lies ROS, where a new publisher is not heard at once.
        await eventually(is_heard)
        await eventually(lambda: is_told_to_stand(robot))


async def is_told_to_stand(robot: RobotProcess) -> bool:
    return robot.velocities[-1:] == [(0.0, 0.0)]


async def send(caller: Caller, goal: dict[str, Any], *, wait_s: float) -> str:
    """Sends a goal until it arrives: rosbridge sends it also to a server it has not found yet."""
    while "gave no sign" in (
        said := await caller.ask("ros_send_goal", action=ACTION, fields=goal, wait_s=wait_s)
    ):
        pass
    return said


async def cancel_on_the_way(caller: Caller) -> str:
    """Cancels a drive before its end: a busy machine may be slower than the robot."""
    for x in (1, 4) * 5:
        going = await send(caller, pose(x, 2.25), wait_s=0)
        said = await caller.ask("ros_cancel_goal", goal_id=handle_of(going))
        if "succeeded" not in said:
            break
    return said


def handle_of(said: str) -> str:
    return said.partition(" ")[0]


async def test_goals_are_told_apart_by_how_they_end(rosbridge_url: str, tmp_path: Path) -> None:
    async with tools(rosbridge_url, tmp_path) as caller:
        arrived = await send(caller, pose(3, 2.25), wait_s=15)
        blocked = await send(caller, pose(5.25, 3), wait_s=15)
        cancelled = await cancel_on_the_way(caller)
        later = await caller.ask("ros_goal_status", goal_id=handle_of(blocked))
    assert "succeeded" in arrived
    assert "aborted" in blocked
    assert "The way is blocked." in blocked
    assert "cancelled" in cancelled
    assert later == blocked


async def test_services_and_parameters_answer(rosbridge_url: str, tmp_path: Path) -> None:
    async with tools(rosbridge_url, tmp_path) as caller:
        called = await caller.ask("ros_call", service="/switch_motors", fields={"data": True})
        said = await caller.ask(
            "ros_set_parameter", node="/robot", parameter="robot_radius", value=0.3
        )
        listed = await caller.ask("ros_parameters", node="/robot", filter="robot_radius")
    assert "success: true" in called
    assert "is 0.3 now" in said
    assert "robot_radius: 0.3 (double" in listed
