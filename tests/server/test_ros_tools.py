"""The tools of the `ros` toolset that look: what there is, what it looks like, what is said."""

import base64
import io
from pathlib import Path
from typing import Any

import anyio
import numpy as np
import pytest
from PIL import Image

from bridging import SteppedRobot
from drawing import grid_from_text
from fakes import FakeRobot, two_rooms
from mapspeak.links.rosbridge import RobotAddress, open_client
from mapspeak.ros.link import Patience
from mapspeak.ros.listening import hear
from mapspeak.ros.messages.fields import Dialect, write_header
from mapspeak.spatial import OccupancyGrid
from rosbridge_robot import ScriptedRobot
from rosbridge_script import running
from rosserved import QUICK, on_our_server, on_script, served, time_passing
from served import pictures_of, text_of

pytestmark = pytest.mark.anyio
both = pytest.mark.parametrize("dialect", Dialect)


# --- what there is


@both
async def test_the_overview_names_what_a_model_looks_for(dialect: Dialect, tmp_path: Path) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        text = await caller.ask("ros_overview")
    assert text.startswith("ROS 1" if dialect is Dialect.ROS1 else "ROS 2 jazzy")
    assert "maps: /map" in text
    assert "velocities: /cmd_vel" in text
    assert "/move_base" in text if dialect is Dialect.ROS1 else "/navigate_to_pose" in text


@both
async def test_topics_are_found_by_name_by_type_and_by_pattern(
    dialect: Dialect, tmp_path: Path
) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        everything = await caller.ask("ros_topics")
        by_type = await caller.ask("ros_topics", filter="twist")
        by_pattern = await caller.ask("ros_topics", filter="/tf*")
        none = await caller.ask("ros_topics", filter="/arm")
    assert f"/map {dialect.type_name('nav_msgs/OccupancyGrid')}" in everything
    assert by_type.splitlines()[1:] == [f"/cmd_vel {dialect.type_name('geometry_msgs/Twist')}"]
    assert [line.split()[0] for line in by_pattern.splitlines()[1:]] == ["/tf", "/tf_static"]
    assert none.startswith("topics: 0 of ")


async def test_long_lists_come_in_pages(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics = {f"/sensor_{number:04d}": "std_msgs/msg/Bool" for number in range(1000)}
    async with on_script(scripted, tmp_path) as caller:
        first = await caller.ask("ros_topics")
        last = await caller.ask("ros_topics", page=25)
    assert first.startswith("topics: 1000, page 1 of 25\n/sensor_0000 ")
    assert last.splitlines()[-1].startswith("/sensor_0999 ")
    assert len(first) < 2000


@both
async def test_a_topic_is_told_with_its_nodes_and_its_fields(
    dialect: Dialect, tmp_path: Path
) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        text = await caller.ask("ros_topic", topic="/cmd_vel")
    assert "heard by: /robot_base" in text
    assert "linear: geometry_msgs/Vector3 {x: float64, y: float64, z: float64}" in text


@both
@pytest.mark.parametrize(
    ("tool", "arguments", "said"),
    [
        ("ros_topic", {"topic": "/cmd_val"}, "/cmd_vel"),
        ("ros_read", {"topic": "/mapp"}, "/map"),
        ("ros_service", {"service": "/rosapi/nods"}, "/rosapi/nodes"),
        ("ros_call", {"service": "/rosapi/nods"}, "/rosapi/nodes"),
        ("ros_node", {"node": "/robot"}, "/robot_base"),
        ("ros_parameters", {"node": "/robot_bas"}, "/robot_base"),
    ],
)
async def test_a_name_that_is_not_there_is_answered_with_the_nearest(
    dialect: Dialect, tmp_path: Path, tool: str, arguments: dict[str, Any], said: str
) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        text = await caller.refuse(tool, **arguments)
    assert "The robot has no " in text
    assert said in text


@both
async def test_nodes_are_told_with_what_they_do(dialect: Dialect, tmp_path: Path) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        assert "/robot_base" in await caller.ask("ros_nodes")
        text = await caller.ask("ros_node", node="/robot_base")
    assert "publishes: /clock, /odom, /tf" in text
    assert "hears: /cmd_vel" in text


# --- what it looks like


@both
async def test_a_service_of_nested_types_is_described_down_to_its_numbers(
    dialect: Dialect, tmp_path: Path
) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        text = await caller.ask("ros_type", type="nav_msgs/srv/GetPlan")
    lines = text.splitlines()
    request = lines[lines.index("request:") + 1 : lines.index("response:")]
    assert request[0] == "  start: geometry_msgs/PoseStamped"
    assert any("position: geometry_msgs/Point {x: float64, y: float64" in each for each in request)
    assert any("orientation: geometry_msgs/Quaternion {x: float64" in each for each in request)
    assert request[-2:] == [
        "  goal: geometry_msgs/PoseStamped (as above)",
        "  tolerance: float32",
    ]
    assert "  plan: nav_msgs/Path" in lines
    assert len(text) < 2000


async def test_a_type_that_the_robot_describes_is_told_as_the_robot_says_it(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/arm"] = "arm_msgs/msg/Arm"
    asked: list[object] = []

    def describe(call: object) -> object:
        asked.append(call)
        text = 'Joint[<=6] joints # each\nstring<=8 name "left"\nuint8 FAST=3\n' + "=" * 80
        return {
            "types": ["arm_msgs/msg/Arm"],
            "typedefs_full_text": [f"{text}\nMSG: arm_msgs/Joint\nfloat64 angle\n"],
        }

    scripted.services["/rosapi/topics_and_raw_types"] = describe
    async with on_script(scripted, tmp_path) as caller:
        text = await caller.ask("ros_type", type="arm_msgs/msg/Arm")
        await caller.ask("ros_type", type="arm_msgs/Joint")
        await caller.ask("ros_type", type="geometry_msgs/msg/Twist")
        await caller.ask("ros_type", type="geometry_msgs/msg/Twist")
    assert "joints: arm_msgs/Joint[<=6] {angle: float64}" in text
    assert 'name: string<=8 = "left"' in text
    assert "FAST=3" in text
    assert len(asked) == 2, "once for the arm, once for the twist that it did not tell then"


async def test_ros_2_is_never_asked_for_what_ends_its_rosapi(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    async with on_script(scripted, tmp_path) as caller:
        await caller.refuse("ros_type", type="arm_msgs/srv/Grasp")
        await caller.ask("ros_type", type="std_srvs/srv/SetBool")
    asked = {call["service"] for call in scripted.server.asked("call_service")}
    assert not [name for name in asked if name.endswith(("_details", "get_param_names"))]


async def test_ros_1_describes_a_service_that_nobody_else_knows(tmp_path: Path) -> None:
    scripted = ScriptedRobot(ros=1)

    def part(name: str, fields: dict[str, str]) -> object:
        detail = {
            "type": name,
            "fieldnames": list(fields),
            "fieldtypes": list(fields.values()),
            "fieldarraylen": [-1] * len(fields),
        }
        return {"typedefs": [detail]}

    services = scripted.services
    services["/rosapi/service_request_details"] = lambda _: part("arm/GraspRequest", {"w": "int8"})
    services["/rosapi/service_response_details"] = lambda _: part(
        "arm/GraspResponse", {"f": "bool"}
    )
    async with on_script(scripted, tmp_path) as caller:
        text = await caller.ask("ros_type", type="arm/Grasp")
    assert text == "arm/Grasp\nrequest:\n  w: int8\nresponse:\n  f: bool"


async def test_a_type_that_nobody_knows_can_be_described_by_the_model(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.services["/rosapi/service_type"] = lambda _: {"type": "arm_msgs/srv/Grasp"}
    scripted.services["/grasp"] = lambda call: {"held": call["args"]["width_m"] < 1}
    async with on_script(scripted, tmp_path) as caller:
        text = await caller.refuse("ros_call", service="/grasp", fields={"width_m": 0.1})
        assert "Unknown type arm_msgs/srv/Grasp: neither the robot nor mapspeak" in text
        assert "ros_type takes it." in text
        definition = "float64 width_m\n---\nbool held"
        await caller.ask("ros_type", type="arm_msgs/srv/Grasp", definition=definition)
        answer = await caller.ask("ros_call", service="/grasp", fields={"width_m": 0.1})
        known = await caller.refuse("ros_type", type="std_msgs/msg/Bool", definition="int8 data")
    assert "held: true" in answer
    assert "known already" in known


# --- what is said


@both
async def test_a_map_is_a_picture_and_few_words(dialect: Dialect, tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    cells = rng.choice(np.array([-1, 0, 100], dtype=np.int8), (384, 384))
    robot = SteppedRobot(OccupancyGrid(cells=cells, resolution_m=0.05))
    async with on_our_server(dialect, tmp_path, robot) as (_, caller):
        result = await caller.client.call_tool("ros_read", {"topic": "/map"})
        again = await caller.client.call_tool("ros_read", {"topic": "/map"})
    assert len(text_of(result)) < 2000
    assert "Grid of 384 x 384 cells of 0.05 m" in text_of(result)
    (picture,) = pictures_of(result)
    with Image.open(io.BytesIO(base64.b64decode(picture.data))) as opened:
        assert max(opened.size) <= 1000
    assert pictures_of(again)[0].data == picture.data


@both
async def test_a_map_within_an_answer_is_a_picture_too(dialect: Dialect, tmp_path: Path) -> None:
    service = "/dynamic_map" if dialect is Dialect.ROS1 else "/slam_toolbox/dynamic_map"
    async with on_our_server(dialect, tmp_path) as (_, caller):
        result = await caller.client.call_tool("ros_call", {"service": service})
    assert "map: Grid of 30 x 11 cells of 0.25 m" in text_of(result)
    assert len(pictures_of(result)) == 1


async def read(scripted: ScriptedRobot, folder: Path, topic: str) -> tuple[str, int]:
    """Gives the text that reading a topic gives, and how many pictures came with it."""
    async with on_script(scripted, folder) as caller:
        result = await caller.client.call_tool("ros_read", {"topic": topic})
    assert not result.is_error, text_of(result)
    return text_of(result), len(pictures_of(result))


async def test_a_scan_is_told_by_what_is_near(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/scan"] = "sensor_msgs/msg/LaserScan"
    scripted.latched["/scan"] = {
        "header": write_header("laser", 1.0, dialect=Dialect.ROS2),
        "angle_min": -3.14159, "angle_increment": 0.0174533, "range_min": 0.1, "range_max": 10.0,
        "ranges": [2.0 + (0.5 if number == 180 else 1.0) for number in range(360)],
    }  # fmt: skip
    text, _ = await read(scripted, tmp_path, "/scan")
    assert "360 beams, 360 met something" in text
    assert "Nearest: 2.50 m at -0 deg" in text or "Nearest: 2.50 m at +0 deg" in text
    assert "ahead 2.50 m, left 3.00 m" in text


@pytest.mark.parametrize("order", ["<", ">"])
async def test_a_point_cloud_is_told_by_its_bounds_in_either_byte_order(
    tmp_path: Path, order: str
) -> None:
    points = np.array([[1, 2, 3], [4, -5, 6], [np.nan, 0, 0]], dtype=f"{order}f4")
    rows = points.tobytes()
    scripted = ScriptedRobot()
    scripted.topics["/points"] = "sensor_msgs/msg/PointCloud2"
    scripted.latched["/points"] = {
        "header": write_header("lidar", 1.0, dialect=Dialect.ROS2),
        "height": 1, "width": 3, "point_step": 12, "row_step": 36, "is_bigendian": order == ">",
        "fields": [
            {"name": name, "offset": 4 * number, "datatype": 7, "count": 1}
            for number, name in enumerate("xyz")
        ],
        "data": base64.b64encode(rows).decode(), "is_dense": False,
    }  # fmt: skip
    text, _ = await read(scripted, tmp_path, "/points")
    assert "3 points, 2 of them finite; fields x, y, z" in text
    assert "x 1.00 to 4.00 m, y -5.00 to 2.00 m, z 3.00 to 6.00 m" in text
    assert "Nearest: 3.74 m at 1.00, 2.00, 3.00" in text


def image(encoding: str, *, height: int = 4, width: int = 4, n_bytes: int = 1) -> dict[str, Any]:
    return {
        "header": write_header("camera", 1.0, dialect=Dialect.ROS2),
        "height": height, "width": width, "encoding": encoding, "is_bigendian": 0,
        "step": width * n_bytes, "data": base64.b64encode(bytes(height * width * n_bytes)).decode(),
    }  # fmt: skip


async def test_an_image_is_a_picture_that_a_model_takes_in(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/image"] = "sensor_msgs/msg/Image"
    scripted.latched["/image"] = image("rgb8", height=1500, width=2000, n_bytes=3)
    async with on_script(scripted, tmp_path) as caller:
        result = await caller.client.call_tool("ros_read", {"topic": "/image"})
    (picture,) = pictures_of(result)
    data = base64.b64decode(picture.data)
    with Image.open(io.BytesIO(data)) as opened:
        assert opened.size == (1000, 750)
    assert len(data) < 700_000


async def test_an_image_of_an_unknown_encoding_is_told_and_not_sent_as_text(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/image"] = "sensor_msgs/msg/Image"
    scripted.latched["/image"] = image("holographic", height=600, width=800)
    text, n_pictures = await read(scripted, tmp_path, "/image")
    assert n_pictures == 0
    assert "holographic" in text
    assert len(text) < 2000


async def test_no_answer_is_longer_than_a_model_can_take(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/names"] = "my_msgs/msg/Anything"
    scripted.latched["/names"] = {
        f"field_{number}": {"text": "word " * 500, "numbers": list(range(1000))}
        for number in range(300)
    }
    text, _ = await read(scripted, tmp_path, "/names")
    assert len(text) < 4000
    assert "cut: " in text


# --- slow topics, and none


async def test_a_slow_topic_is_read_however_seldom_it_speaks(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/battery"] = "std_msgs/msg/Float32"
    answers: list[str] = []
    async with on_script(scripted, tmp_path) as caller, anyio.create_task_group() as tasks:

        async def ask() -> None:
            answers.append(await caller.ask("ros_read", topic="/battery", n=2, wait_s=20))

        tasks.start_soon(ask)
        await scripted.until(lambda: scripted.server.asked("subscribe"))
        await scripted.publish("/battery", {"data": 11.5})
        await scripted.server.until(lambda: True)
        await scripted.publish("/battery", {"data": 11.25})
    assert "data: 11.5" in answers[0]
    assert "data: 11.25" in answers[0]
    assert len(scripted.server.asked("subscribe")) == 1
    assert len(scripted.server.visitors) == 2, "the two sockets of the connection, and no others"


async def test_a_latched_message_that_was_missed_is_asked_for_again() -> None:
    scripted = ScriptedRobot()
    scripted.latched["/map"] = scripted.map_message(grid_from_text("##\n##"))
    scripted.n_silent["/map"] = 2
    async with (
        running(scripted.server) as server,
        open_client(RobotAddress(url=server.url), patience=QUICK) as client,
    ):
        heard = await hear(
            client,
            "/map",
            type_name="nav_msgs/msg/OccupancyGrid",
            n=1,
            wait_s=20.0,
            duration_s=0.0,
            renew_s=(0.02, 0.02),
        )
        await client.call_service("/rosapi/get_time")
    assert len(heard.messages) == 1
    encodings = [each["compression"] for each in scripted.server.asked("subscribe")]
    assert encodings == ["cbor", "cbor", "none"]
    assert len(scripted.server.asked("unsubscribe")) == 3, "what was begun has been ended"


@both
async def test_listening_for_a_time_tells_the_rate(dialect: Dialect, tmp_path: Path) -> None:
    async with on_our_server(dialect, tmp_path) as (robot, caller), time_passing(robot):
        text = await caller.ask("ros_read", topic="/odom", duration_s=0.3, n=2)
    assert " Hz; the latest 2, the newest last:" in text
    assert "covariance: [36 numbers, all 0]" in text


async def test_a_topic_that_says_nothing_is_told_with_who_should_speak(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/battery"] = "std_msgs/msg/Float32"
    scripted.services["/rosapi/publishers"] = lambda _: {"publishers": ["/bms"]}
    async with on_script(scripted, tmp_path) as caller:
        slow = await caller.refuse("ros_read", topic="/battery", wait_s=0.1)
        scripted.services["/rosapi/publishers"] = lambda _: {"publishers": []}
        dead = await caller.refuse("ros_read", topic="/battery", wait_s=0.1)
    assert "No message came on /battery within 0.1 s. It is published by /bms" in slow
    assert "Nobody publishes it" in dead


# --- no ROS


@pytest.mark.parametrize("tool", ["ros_overview", "ros_topics", "ros_services", "ros_nodes"])
async def test_a_rosbridge_that_has_gone_is_an_error_and_no_empty_list(
    tmp_path: Path, tool: str
) -> None:
    scripted = ScriptedRobot()
    patience = Patience(first_pause_s=0.001, longest_pause_s=0.01, answer_s=0.1, goodbye_s=0.1)
    async with on_script(scripted, tmp_path, patience=patience) as caller:
        scripted.server.hangs_up = True
        await scripted.server.drop_all()
        text = await caller.refuse(tool)
    assert "connect" in text.lower()


async def test_a_robot_without_ros_says_so(tmp_path: Path) -> None:
    async with served(FakeRobot(two_rooms()), None, tmp_path) as caller:
        text = await caller.refuse("ros_topics")
    assert "no ROS robot" in text
    assert "simulate --rosbridge" in text


async def test_read_only_leaves_out_what_changes_something(tmp_path: Path) -> None:
    async with served(FakeRobot(two_rooms()), None, tmp_path, is_read_only=True) as caller:
        names = {tool.name for tool in (await caller.client.list_tools()).tools}
    assert {"ros_read", "ros_parameters", "ros_cancel_goal"} <= names
    changing = {"ros_publish", "ros_call", "ros_send_goal", "ros_set_parameter"}
    assert not changing & names


async def test_every_argument_of_the_ros_tools_is_described(tmp_path: Path) -> None:
    async with served(FakeRobot(two_rooms()), None, tmp_path) as caller:
        tools = (await caller.client.list_tools()).tools
    undescribed = [
        f"{tool.name}.{name}"
        for tool in tools
        for name, schema in tool.input_schema.get("properties", {}).items()
        if tool.name.startswith("ros_") and not schema.get("description")
    ]
    assert undescribed == []
