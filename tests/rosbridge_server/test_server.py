"""The rosbridge server's topics and its manners: what it answers, and where it keeps silent."""

import base64
import contextlib
import io
import json
import math
from typing import Any

import anyio
import numpy as np
import pytest
from PIL import Image

from bridging import SteppedRobot, bridge
from fakes import two_rooms
from mapspeak.errors import ConfigError
from mapspeak.geometry import Point, Pose
from mapspeak.robot import NavigationLook, NavigationPart
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.grids import read_grid
from mapspeak.ros.messages.pictures import read_compressed_image
from mapspeak.ros.messages.poses import read_pose_stamped, read_transforms, read_twist
from mapspeak.rosbridge_server import open_rosbridge_server
from mapspeak.spatial import OccupancyGrid

pytestmark = pytest.mark.anyio
both = pytest.mark.parametrize("dialect", Dialect)


def pieces_together(pieces: list[dict[str, Any]]) -> dict[str, Any]:
    ordered = sorted(pieces, key=lambda piece: int(piece["num"]))
    whole: dict[str, Any] = json.loads("".join(piece["data"] for piece in ordered))
    return whole


async def answer_to(port: int, request: bytes) -> bytes:
    """Gives all that a server sends back before it hangs up."""
    answer = b""
    async with await anyio.connect_tcp("127.0.0.1", port) as stream:
        await stream.send(request)
        with anyio.fail_after(5), contextlib.suppress(anyio.EndOfStream):
            while True:
                answer += await stream.receive()
    return answer


@both
@pytest.mark.parametrize("compression", ["none", "cbor"])
async def test_a_map_comes_at_once_to_whoever_subscribes(
    dialect: Dialect, compression: str
) -> None:
    async with bridge(dialect) as (robot, connect), connect() as client:
        await client.send(op="subscribe", topic="/map", compression=compression)
        grid = read_grid(await client.next_on("/map"))
    assert robot.grid is not None
    assert np.array_equal(grid.cells, robot.grid.cells)
    assert grid.resolution_m == 0.25


async def test_ros_1_hides_a_map_in_a_png() -> None:
    async with bridge(Dialect.ROS1) as (robot, connect), connect() as client:
        await client.send(op="subscribe", topic="/map", compression="png")
        packed = await client.receive()
    assert packed["op"] == "png"
    with Image.open(io.BytesIO(base64.b64decode(packed["data"]))) as picture:
        grid = read_grid(json.loads(picture.tobytes())["msg"])
    assert robot.grid is not None
    assert np.array_equal(grid.cells, robot.grid.cells)


@both
async def test_a_changed_map_is_published_again(dialect: Dialect) -> None:
    async with bridge(dialect) as (robot, connect), connect() as client:
        await client.send(op="subscribe", topic="/map")
        await client.next_on("/map")
        robot.grid = OccupancyGrid(cells=np.zeros((3, 4), dtype=np.int8), resolution_m=0.1)
        await robot.let_pass(1.1)
        assert read_grid(await client.next_on("/map")).cells.shape == (3, 4)
        await robot.let_pass(3.0)
        assert await client.all_before() == []


@both
async def test_transforms_lead_from_the_map_to_the_robot(dialect: Dialect) -> None:
    async with bridge(dialect) as (robot, connect), connect() as client:
        await client.send(op="subscribe", topic="/tf")
        await client.all_before()
        await robot.let_pass(0.05)
        found = [read_transforms(await client.next_on("/tf"))[0] for _ in range(2)]
        await client.send(op="subscribe", topic="/tf_static")
        fixed = read_transforms(await client.next_on("/tf_static"))
    chain = {each.parent: each.child for each in (*found, *fixed)}
    assert chain["map"] == "odom"
    assert chain[chain["odom"]] == "base_link"
    whole = found[0].parent_from_child @ found[1].parent_from_child
    assert (whole.x, whole.y) == (robot.pose.x, robot.pose.y)


async def test_odometry_says_how_fast_the_robot_goes() -> None:
    async with bridge(Dialect.ROS2) as (robot, connect), connect() as client:
        await client.send(op="subscribe", topic="/odom")
        await client.all_before()
        await robot.send_goal(robot.pose @ Pose(1.0, 0.0))
        await robot.let_pass(0.15)
        await client.next_on("/odom")
        message = await client.next_on("/odom")
    assert read_twist(message["twist"]).forward_mps == pytest.approx(1.0)
    assert message["child_frame_id"] == "base_footprint"


@pytest.mark.parametrize(
    ("dialect", "topic"), [(Dialect.ROS1, "/amcl_pose"), (Dialect.ROS2, "/pose")]
)
async def test_the_estimated_pose_is_in_the_map(dialect: Dialect, topic: str) -> None:
    async with bridge(dialect) as (robot, connect), connect() as client:
        await client.send(op="subscribe", topic=topic)
        await client.all_before()
        await robot.let_pass(0.6)
        framed = read_pose_stamped(await client.next_on(topic))
    assert (framed.pose, framed.frame_id) == (robot.pose, "map")


@both
async def test_a_camera_gives_pictures_while_somebody_looks(dialect: Dialect) -> None:
    async with bridge(dialect) as (robot, connect), connect() as client:
        await client.send(op="subscribe", topic="/camera/image_raw/compressed")
        await client.send(op="subscribe", topic="/camera/camera_info")
        await client.all_before()
        await robot.let_pass(0.3)
        picture = read_compressed_image(await client.next_on("/camera/image_raw/compressed"))
        info = await client.next_on("/camera/camera_info")
    assert (picture.width_px, picture.height_px) == (info["width"], info["height"]) == (64, 48)


@both
async def test_a_second_camera_has_topics_and_a_frame_of_its_own(dialect: Dialect) -> None:
    robot = SteppedRobot(two_rooms())
    robot.cameras = ("front", "rear")
    async with bridge(dialect, robot) as (robot, connect), connect() as client:
        await client.send(op="subscribe", topic="/rear_camera/image_raw/compressed")
        await client.all_before()
        await robot.let_pass(0.3)
        await client.next_on("/rear_camera/image_raw/compressed")
        await client.send(op="subscribe", topic="/tf_static")
        fixed = read_transforms(await client.next_on("/tf_static"))
    (rear,) = (each for each in fixed if each.child == "rear_camera_link")
    assert abs(rear.parent_from_child.yaw_rad) == pytest.approx(math.pi)


@pytest.mark.parametrize(
    ("dialect", "plan", "footprint"),
    [
        (Dialect.ROS1, "/move_base/NavfnROS/plan", "/move_base/local_costmap/footprint"),
        (Dialect.ROS2, "/plan", "/local_costmap/published_footprint"),
    ],
)
async def test_the_planned_path_and_the_footprint_are_published_while_somebody_listens(
    dialect: Dialect, plan: str, footprint: str
) -> None:
    robot = SteppedRobot(two_rooms())
    line = (Point(1.0, 1.0), Point(2.0, 1.0), Point(1.0, 1.0))
    robot.navigation = tuple(
        NavigationLook(part=part, age_s=0.0, lines=(line,))
        for part in (NavigationPart.PLAN, NavigationPart.FOOTPRINT)
    )
    async with bridge(dialect, robot) as (robot, connect), connect() as client:
        for topic in (plan, footprint):
            await client.send(op="subscribe", topic=topic)
        await client.all_before()
        await robot.let_pass(0.6)
        path = await client.next_on(plan)
        ring = await client.next_on(footprint)
    assert [each["pose"]["position"]["x"] for each in path["poses"]] == [1.0, 2.0, 1.0]
    assert [each["x"] for each in ring["polygon"]["points"]] == [1.0, 2.0]


async def test_a_robot_without_a_camera_or_map_publishes_neither() -> None:
    robot = SteppedRobot(None, has_camera=False)
    async with bridge(Dialect.ROS2, robot) as (robot, connect), connect() as client:
        topics = (await client.ask("topics"))["topics"]
        await client.send(op="subscribe", topic="/map")
        await robot.let_pass(1.1)
        assert await client.all_before() == []
    assert not [topic for topic in topics if "camera" in topic]


async def test_what_one_client_publishes_the_others_hear() -> None:
    async with bridge(Dialect.ROS2) as (_, connect), connect() as one, connect() as other:
        await other.send(op="subscribe", topic="/news", type="std_msgs/String")
        await other.all_before()
        await one.send(op="advertise", topic="/news", type="std_msgs/msg/String")
        await one.send(op="publish", topic="/news", msg={"data": "hello"})
        assert await other.next_on("/news") == {"data": "hello"}
        assert (await one.ask("topic_type", topic="/news"))["type"] == "std_msgs/msg/String"
        await other.send(op="unsubscribe", topic="/news")
        await one.send(op="unadvertise", topic="/news")
        await other.all_before()
        assert "/news" not in (await one.ask("topics"))["topics"]


async def test_what_is_left_out_of_a_message_has_its_default() -> None:
    async with bridge(Dialect.ROS1) as (_, connect), connect() as one, connect() as other:
        await other.send(op="subscribe", topic="/cmd_vel")
        await other.all_before()
        await one.send(op="publish", topic="/cmd_vel", msg={"linear": {"x": 0.1}})
        message = await other.next_on("/cmd_vel")
    assert message["linear"] == {"x": 0.1, "y": 0.0, "z": 0.0}
    assert message["angular"] == {"x": 0.0, "y": 0.0, "z": 0.0}


@both
async def test_a_zero_velocity_stops_the_robot_and_no_other_moves_it(dialect: Dialect) -> None:
    async with bridge(dialect) as (robot, connect), connect() as client:
        await client.send(op="publish", topic="/cmd_vel", msg={"linear": {"x": 0.5}})
        await client.all_before()
        await robot.let_pass(0.2)
        assert robot.n_stops == 0
        await client.send(op="publish", topic="/cmd_vel", msg={})
        await client.all_before()
        await robot.let_pass(0.05)
    assert robot.n_stops == 1


SILENT: list[dict[str, object]] = [
    {"op": "no such operation"},
    {"op": 7},
    {"no": "op"},
    {"op": "subscribe"},
    {"op": "subscribe", "topic": "/nowhere"},
    {"op": "subscribe", "topic": "/map", "type": "std_msgs/String"},
    {"op": "subscribe", "topic": "/odd", "type": "odd_msgs/Odd"},
    {"op": "subscribe", "topic": "/map", "throttle_rate": "often"},
    {"op": "unsubscribe", "topic": "/nowhere"},
    {"op": "advertise", "topic": "/odd", "type": "odd_msgs/Odd"},
    {"op": "publish", "topic": "/nowhere", "msg": {}},
    {"op": "publish", "topic": "/cmd_vel", "msg": {"linear": "fast"}},
    {"op": "publish", "topic": "/cmd_vel", "msg": {"speed": 1}},
    {"op": "publish", "topic": "/cmd_vel", "msg": []},
    {"op": "call_service", "id": "no service"},
    {"op": "send_action_goal", "id": "1", "action": "/navigate_to_pose"},
    {"op": "send_action_goal", "id": "2", "action": "/dance", "action_type": "a/action/Dance"},
    {"op": "cancel_action_goal", "id": "nobody's", "action": "/navigate_to_pose"},
]


@both
@pytest.mark.parametrize("operation", SILENT, ids=str)
async def test_most_errors_are_silent(dialect: Dialect, operation: dict[str, object]) -> None:
    async with bridge(dialect) as (robot, connect), connect() as client:
        await client.send(**operation)
        await robot.let_pass(0.1)
        assert await client.all_before() == []


@both
@pytest.mark.parametrize("frame", ["", "{", "[]", "null", "NaN", "\u2603", b"", b"\xff\xfe", b"{}"])
async def test_garbage_ends_neither_server_nor_connection(
    dialect: Dialect, frame: str | bytes
) -> None:
    async with bridge(dialect) as (_, connect), connect() as client:
        await client.connection.send(frame)
        assert await client.all_before() == []


async def test_ros_1_tells_errors_to_its_log() -> None:
    async with bridge(Dialect.ROS1) as (_, connect), connect() as client:
        await client.send(op="subscribe", topic="/rosout")
        await client.send(op="subscribe", topic="/nowhere", id="mine")
        entry = await client.next_on("/rosout")
    assert (entry["level"], entry["name"]) == (8, "/rosbridge_websocket")
    assert "[id: mine]" in entry["msg"]


@pytest.mark.parametrize("compression", ["png", "cbor"])
async def test_ros_2_cannot_compress_everything_and_says_nothing(compression: str) -> None:
    async with bridge(Dialect.ROS2) as (robot, connect), connect() as client:
        await client.send(op="subscribe", topic="/odom", compression=compression)
        await client.all_before()
        await robot.let_pass(0.2)
        assert await client.all_before() == []


async def test_short_pieces_once_asked_for_are_asked_for_all() -> None:
    async with bridge(Dialect.ROS2) as (_, connect), connect() as client:
        await client.send(op="subscribe", topic="/map_metadata", fragment_size=100)
        await client.send(op="unsubscribe", topic="/map_metadata")
        await client.send(op="subscribe", topic="/map")
        first = await client.until(lambda piece: '"/map"' in str(piece))
        pieces = [first]
        while len(pieces) < int(first["total"]):
            pieces.append(await client.receive())
    assert isinstance(first["total"], float)
    assert all(len(piece["data"]) <= 100 for piece in pieces)
    assert read_grid(pieces_together(pieces)["msg"]).resolution_m == 0.25


async def test_a_map_too_long_for_one_frame_comes_in_pieces_and_not_at_all_as_cbor() -> None:
    wide = OccupancyGrid(cells=np.full((3200, 3200), 100, dtype=np.int8), resolution_m=0.05)
    async with bridge(Dialect.ROS2, SteppedRobot(wide)) as (_, connect), connect() as client:
        await client.send(op="subscribe", topic="/map", compression="cbor", id="as cbor")
        assert await client.all_before() == []
        await client.send(op="unsubscribe", topic="/map")
        await client.send(op="subscribe", topic="/map")
        first = await client.receive()
        pieces = [first]
        while len(pieces) < int(first["total"]):
            pieces.append(await client.receive())
    assert first["op"] == "fragment"
    assert read_grid(pieces_together(pieces)["msg"]).cells.shape == (3200, 3200)


async def test_a_client_that_reads_nothing_holds_nobody_up() -> None:
    big = np.zeros((2000, 2000), dtype=np.int8)
    robot = SteppedRobot(two_rooms())
    async with (
        bridge(Dialect.ROS1, robot) as (robot, connect),
        connect(compression=None, max_queue=1, close_timeout=0) as hanging,
        connect() as other,
    ):
        await hanging.send(op="subscribe", topic="/map", compression="cbor")
        await hanging.send(op="subscribe", topic="/tf")
        await other.send(op="subscribe", topic="/tf")
        await other.all_before()
        for shade in range(8):
            robot.grid = OccupancyGrid(cells=big + np.int8(shade), resolution_m=0.05)
            await robot.let_pass(1.05)
            read_transforms(await other.next_on("/tf"))
        assert (await other.ask("topic_type", topic="/map"))["type"] == "nav_msgs/OccupancyGrid"
        # What it did not read was not kept: it goes on with the latest.
        shades = [int(read_grid(await hanging.next_on("/map")).cells[0, 0])]
        while shades[-1] != 7:
            shades.append(int(read_grid(await hanging.next_on("/map")).cells[0, 0]))
    assert len(shades) < 8


async def test_a_client_that_is_gone_is_forgotten() -> None:
    async with bridge(Dialect.ROS2) as (robot, connect), connect() as other:
        async with connect() as client:
            await client.send(op="subscribe", topic="/tf")
            await client.all_before()
            assert (await other.ask("subscribers", topic="/tf"))["subscribers"]
        await robot.let_pass(0.2)
        assert (await other.ask("subscribers", topic="/tf"))["subscribers"] == []


async def test_who_is_no_websocket_client_is_told_so_or_hung_up_on() -> None:
    async with open_rosbridge_server(SteppedRobot(), dialect=Dialect.ROS2) as server:
        assert (await answer_to(server.port, b"GET / HTTP/1.1\r\nHost: me\r\n\r\n"))[:12] == (
            b"HTTP/1.1 426"
        )
        assert await answer_to(server.port, b"\x00\x01garbage\r\n\r\n") == b""


async def test_a_port_that_is_taken_is_an_error_with_a_hint() -> None:
    async with open_rosbridge_server(SteppedRobot(), dialect=Dialect.ROS2) as server:
        with pytest.raises(ConfigError, match="another port"):
            async with open_rosbridge_server(
                SteppedRobot(), dialect=Dialect.ROS2, port=server.port
            ):
                pass


async def test_what_is_published_again_and_again_goes_on_when_the_clock_is_set_back() -> None:
    async with bridge(Dialect.ROS1) as (robot, connect), connect() as client:
        await robot.let_pass(50.0)
        for topic in ("/move_base/status", "/amcl_pose"):
            await client.send(op="subscribe", topic=topic)
        await client.all_before()
        robot.set_back(49.0)
        await robot.let_pass(1.0)
        came = await client.all_before()
        assert {each["topic"] for each in came} >= {"/move_base/status", "/amcl_pose"}
