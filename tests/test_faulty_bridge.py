"""The faulty robot that other tests measure on fails as it is told, seen by a plain client."""

import math
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from typing import Any

import anyio
import pytest
from websockets.asyncio.client import connect

from bridging import RawClient
from faulty import Faults
from faulty_bridge import NEXT_ROOM, FaultyBridge, open_faulty_bridge
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.poses import FramedPose, write_pose_stamped

pytestmark = pytest.mark.anyio

PATIENCE_S = 60.0
RATE = 20.0
CLOSE_BY = 0.3


@asynccontextmanager
async def talking(bridge: FaultyBridge) -> AsyncGenerator[RawClient]:
    async with connect(bridge.url, max_size=None) as connection:
        yield RawClient(connection)


@asynccontextmanager
async def running(
    dialect: Dialect = Dialect.ROS1,
    **faults: Any,  # noqa: ANN401
) -> AsyncGenerator[tuple[FaultyBridge, RawClient]]:
    with anyio.fail_after(PATIENCE_S):
        async with (
            open_faulty_bridge(dialect, rate=RATE, faults=Faults(**faults)) as bridge,
            talking(bridge) as client,
        ):
            yield bridge, client


def goal_message(goal_id: str) -> dict[str, Any]:
    framed = FramedPose(pose=NEXT_ROOM, frame_id="map", stamp_s=0.0)
    pose = write_pose_stamped(framed, dialect=Dialect.ROS1)
    return {"goal_id": {"id": goal_id}, "goal": {"target_pose": pose}}


async def send_goal(client: RawClient, goal_id: str = "ours") -> None:
    kind = "move_base_msgs/MoveBaseActionGoal"
    await client.send(op="advertise", topic="/move_base/goal", type=kind)
    await client.send(op="publish", topic="/move_base/goal", msg=goal_message(goal_id))


async def cancel(client: RawClient, goal_id: str = "ours") -> None:
    kind = "actionlib_msgs/GoalID"
    await client.send(op="advertise", topic="/move_base/cancel", type=kind)
    await client.send(op="publish", topic="/move_base/cancel", msg={"id": goal_id})


async def watch(client: RawClient, topic: str) -> None:
    await client.send(op="subscribe", topic=topic)


async def result(client: RawClient) -> int:
    return int((await client.next_on("/move_base/result"))["status"]["status"])


async def until(is_so: Any) -> None:  # noqa: ANN401
    while not is_so():  # noqa: ASYNC110 - the robot tells nobody
        await anyio.sleep(0.002)


async def test_a_goal_is_driven_to_over_the_velocity_topic() -> None:
    async with running() as (bridge, client):
        await watch(client, "/move_base/result")
        await watch(client, "/cmd_vel")
        await send_goal(client)
        assert (await client.next_on("/cmd_vel"))["linear"]["x"] > 0.0
        assert await result(client) == 3
        base = bridge.robot.base
        assert base.pose.point.distance_to(NEXT_ROOM.point) < CLOSE_BY
        assert base.driven_m == pytest.approx(4.5, abs=CLOSE_BY)


async def test_a_goal_accepted_late_does_not_know_the_cancel_that_came_before() -> None:
    async with running(acceptance_s=3.0) as (bridge, client):
        await send_goal(client)
        await cancel(client)
        await client.all_before()
        assert not bridge.robot.sent
        await until(lambda: bridge.robot.base.driven_m > 0.5)
        await watch(client, "/move_base/result")
        await cancel(client)
        assert await result(client) == 2


async def test_navigation_that_dies_leaves_a_base_without_watchdog_driving() -> None:
    async with running(has_watchdog=False) as (bridge, client):
        await send_goal(client)
        await until(lambda: bridge.robot.base.driven_m > 0.2)
        bridge.ros.kill(bridge.ros.navigator)
        driven_m = bridge.robot.base.driven_m
        await until(lambda: bridge.robot.base.driven_m > driven_m + 1.0)


async def test_navigation_that_dies_takes_the_names_along_that_no_one_else_hears() -> None:
    async with running() as (bridge, client):
        await watch(client, "/move_base/status")
        bridge.ros.kill(bridge.ros.navigator)
        topics = (await client.ask("topics"))["topics"]
        publishers = await client.ask("publishers", topic="/move_base/status")
    assert "/move_base/status" in topics
    assert "/move_base/goal" not in topics
    assert publishers == {"publishers": []}


async def test_navigation_that_comes_back_knows_no_goal_and_takes_new_ones() -> None:
    async with running() as (bridge, client):
        await send_goal(client, "old")
        await until(lambda: bridge.robot.sent)
        bridge.ros.kill(bridge.ros.navigator)
        bridge.ros.start(bridge.ros.navigator)
        await watch(client, "/move_base/status")
        assert (await client.next_on("/move_base/status"))["status_list"] == []
        await watch(client, "/move_base/result")
        await send_goal(client, "new")
        assert await result(client) == 3


async def test_a_rosbridge_that_is_killed_comes_back_while_the_robot_drives() -> None:
    async with running() as (bridge, client):
        await send_goal(client)
        await until(lambda: bridge.robot.base.driven_m > 0.1)
        await bridge.close()
        driven_m = bridge.robot.base.driven_m
        await until(lambda: bridge.robot.base.driven_m > driven_m + 0.5)
        await bridge.open()
        async with talking(bridge) as again:
            await watch(again, "/move_base/status")
            statuses = (await again.next_on("/move_base/status"))["status_list"]
    assert [each["goal_id"]["id"] for each in statuses] == ["ours"]


async def test_slam_that_dies_takes_the_map_frame_along_and_nothing_else() -> None:
    async with running() as (bridge, client):
        bridge.ros.kill(bridge.ros.slam)
        await watch(client, "/tf")
        parents = {
            (await client.next_on("/tf"))["transforms"][0]["header"]["frame_id"] for _ in range(6)
        }
    assert parents == {"odom"}


async def test_a_silent_topic_keeps_its_publisher() -> None:
    async with running() as (bridge, client):
        bridge.robot.faults.silent.add("/move_base/status")
        await watch(client, "/move_base/status")
        await until(lambda: bridge.robot.now_s > 102.0)
        assert not [each for each in await client.all_before() if "topic" in each]
        publishers = await client.ask("publishers", topic="/move_base/status")
    assert publishers == {"publishers": ["/move_base"]}


async def test_a_clock_stands_and_jumps_back() -> None:
    async with running() as (bridge, client):
        await watch(client, "/clock")
        await client.next_on("/clock")
        bridge.robot.faults.is_paused = True
        await client.all_before()
        standing_s = bridge.robot.now_s
        bridge.ros.jump_to(3.0)
        bridge.robot.faults.is_paused = False
        jumped_s = (await client.next_on("/clock"))["clock"]["secs"]
    assert standing_s > 100.0
    assert jumped_s == 3


async def test_over_ros_2_a_late_goal_blocks_its_socket_and_drives() -> None:
    async with running(Dialect.ROS2, acceptance_s=math.inf) as (bridge, client):
        framed = FramedPose(pose=NEXT_ROOM, frame_id="map", stamp_s=0.0)
        await client.send(
            op="send_action_goal",
            id="goal",
            action="/navigate_to_pose",
            action_type="nav2_msgs/action/NavigateToPose",
            args={"pose": write_pose_stamped(framed, dialect=Dialect.ROS2)},
            feedback=True,
        )
        async with talking(bridge) as other:
            service = "/navigate_to_pose/_action/cancel_goal"
            assert (await other.call(service))["values"]["goals_canceling"] == []
            bridge.robot.faults.acceptance_s = 0.0
            await client.until(lambda each: each.get("op") == "action_feedback")
            assert len((await other.call(service))["values"]["goals_canceling"]) == 1
            end = await client.until(lambda each: each.get("op") == "action_result")
    assert end["status"] == 5
