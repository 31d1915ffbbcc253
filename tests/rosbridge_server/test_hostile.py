"""Random and mutated operations: the server stays up, for this client and for the others."""

import json
import random
from typing import Any

import pytest

from bridging import SteppedRobot, bridge
from fakes import two_rooms
from mapspeak.geometry import Pose
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.poses import FramedPose, write_pose_stamped

pytestmark = pytest.mark.anyio

N_FRAMES = 2000
GOAL = write_pose_stamped(
    FramedPose(pose=Pose(2.0, 1.4), frame_id="map", stamp_s=0.0), dialect=Dialect.ROS2
)
OPERATIONS: list[dict[str, Any]] = [
    {"op": "subscribe", "id": "1", "topic": "/tf", "throttle_rate": 10, "queue_length": 3},
    {"op": "subscribe", "topic": "/map", "compression": "cbor", "fragment_size": 5000},
    {"op": "unsubscribe", "id": "1", "topic": "/tf"},
    {"op": "advertise", "topic": "/news", "type": "std_msgs/String", "latch": True},
    {"op": "publish", "topic": "/news", "msg": {"data": "x"}},
    {"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 0.0}}},
    {"op": "publish", "topic": "/goal_pose", "msg": GOAL},
    {"op": "publish", "topic": "/move_base/goal", "msg": {"goal": {"target_pose": GOAL}}},
    {"op": "publish", "topic": "/move_base/cancel", "msg": {"id": "1"}},
    {"op": "unadvertise", "topic": "/news"},
    {"op": "call_service", "id": "c", "service": "/rosapi/topic_type", "args": {"topic": "/map"}},
    {"op": "call_service", "service": "/rosapi/node_details", "args": {"node": "/camera"}},
    {"op": "call_service", "service": "/rosapi/set_param", "args": {"name": "a", "value": "1"}},
    {
        "op": "call_service",
        "service": "/navigate_to_pose/_action/cancel_goal",
        "args": {"goal_info": {"goal_id": {"uuid": [1] * 16}}},
    },
    {
        "op": "send_action_goal",
        "id": "g",
        "action": "/navigate_to_pose",
        "action_type": "nav2_msgs/action/NavigateToPose",
        "args": {"pose": GOAL},
        "feedback": True,
    },
    {"op": "cancel_action_goal", "id": "g", "action": "/navigate_to_pose"},
]
HOSTILE: list[Any] = [
    None, True, -1, 0, 1e308, 10**30, float("nan"), float("inf"), "", "/", "\ud800", "x" * 3000,
    [], [None], [[1]], {}, {"x": {}}, [10**30] * 16, {"secs": 1}, {"id": {}},
]  # fmt: skip


def changed(chance: random.Random, value: Any) -> Any:  # noqa: ANN401
    """Gives a value with something in it replaced, added or taken away."""
    if not isinstance(value, dict) or not value or chance.random() < 0.2:
        return chance.choice(HOSTILE)
    name = chance.choice(list(value))
    kind = chance.random()
    if kind < 0.1:
        return {each: value[each] for each in value if each != name}
    if kind < 0.2:
        return {**value, "extra": chance.choice(HOSTILE)}
    return {**value, name: changed(chance, value[name])}


@pytest.mark.parametrize("dialect", Dialect)
async def test_no_mutated_operation_brings_the_server_down(
    dialect: Dialect, caplog: pytest.LogCaptureFixture
) -> None:
    chance = random.Random(20)  # noqa: S311
    robot = SteppedRobot(two_rooms())
    async with (
        bridge(dialect, robot, goals_in_new_thread=True) as (robot, connect),
        connect() as client,
        connect() as other,
    ):
        await other.send(op="subscribe", topic="/tf")
        for number in range(N_FRAMES):
            operation = changed(chance, chance.choice(OPERATIONS))
            text = bytearray(json.dumps(operation).encode())
            if chance.random() < 0.1:
                text[chance.randrange(len(text))] = chance.randrange(256)
            await client.connection.send(bytes(text))
            if number % 50 == 0:
                await client.send(op="call_service", id="still there", service="/rosapi/get_time")
                await client.until(lambda each: each.get("id") == "still there")
                await robot.let_pass(0.1)
        await other.next_on("/tf")
        assert (await other.ask("topic_type", topic="/map"))["type"]
    assert caplog.records == []
