"""The websocket under the rosbridge server: pieces, pings, compression, and what is too long."""

import contextlib
import json

import anyio
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed

from bridging import SteppedRobot, bridge
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.grids import read_grid
from mapspeak.spatial import OccupancyGrid

pytestmark = pytest.mark.anyio


async def test_an_operation_may_come_in_pieces() -> None:
    operation = {"op": "call_service", "id": "1", "service": "/rosapi/topics"}
    text = json.dumps(operation)
    async with bridge(Dialect.ROS2) as (_, connect), connect() as client:
        await client.connection.send([text[:10], text[10:20], text[20:]])
        assert (await client.receive())["result"] is True


async def test_a_ping_is_answered_while_a_goal_holds_the_socket_up() -> None:
    async with bridge(Dialect.ROS2) as (_, connect), connect() as client:
        goal = {"action": "/navigate_to_pose", "action_type": "nav2_msgs/action/NavigateToPose"}
        pose = {"header": {"frame_id": "map"}, "pose": {"position": {"x": 2.0, "y": 1.4}}}
        await client.send(op="send_action_goal", id="1", **goal, args={"pose": pose})
        with anyio.fail_after(5):
            await (await client.connection.ping())


@pytest.mark.parametrize("compression", [None, "deflate"])
async def test_a_map_longer_than_a_frame_arrives_whole(compression: str | None) -> None:
    cells = np.random.default_rng(1).integers(-1, 101, (900, 1100)).astype(np.int8)
    robot = SteppedRobot(OccupancyGrid(cells=cells, resolution_m=0.05))
    async with (
        bridge(Dialect.ROS2, robot) as (_, connect),
        connect(compression=compression) as client,
    ):
        for form in ("cbor", "none"):
            await client.send(op="subscribe", id=form, topic="/map", compression=form)
            assert np.array_equal(read_grid(await client.next_on("/map")).cells, cells)
            await client.send(op="unsubscribe", id=form, topic="/map")


async def test_an_operation_that_is_too_long_costs_its_own_connection_alone() -> None:
    async with bridge(Dialect.ROS2) as (_, connect), connect() as other:
        client = await connect(compression=None).__aenter__()
        with contextlib.suppress(ConnectionClosed):
            await client.send(op="publish", topic="/news", msg={"data": "x" * 11_000_000})
        with pytest.raises(ConnectionClosed):
            await client.receive()
        assert (await other.ask("topics"))["topics"]


async def test_a_server_that_ends_says_goodbye() -> None:
    async with bridge(Dialect.ROS2) as (_, connect):
        client = await connect().__aenter__()
    with pytest.raises(ConnectionClosed) as goodbye:
        await client.receive()
    assert goodbye.value.rcvd is not None
    assert goodbye.value.rcvd.code == 1001
