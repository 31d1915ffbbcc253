"""What the ROS tools tell for a diagnosis: who is where, how often, how late, what is silent."""

import re
from pathlib import Path
from typing import Any

import pytest

from fakes import two_rooms
from mapspeak.ros.listening import Heard
from mapspeak.ros.messages.fields import Dialect, write_header
from mapspeak.ros.messages.grids import write_grid
from mapspeak.server.text.ros.listening import say_rate, say_stamp
from rosbridge_robot import ScriptedRobot
from rosserved import at_time, on_our_server, on_script, publishing

pytestmark = pytest.mark.anyio
NODES: dict[str, dict[str, list[str]]] = {
    "/base": {"publishing": ["/odom", "/tf"], "subscribing": ["/cmd_vel"], "services": ["/lamp"]},
    "/slam": {"publishing": ["/map", "/tf"], "subscribing": ["/scan"], "services": ["/slam/save"]},
    "/rosbridge_websocket": {"publishing": [], "subscribing": ["/tf", "/map"], "services": []},
}


def with_nodes(scripted: ScriptedRobot, *, mute: str = "") -> ScriptedRobot:
    """Gives a robot whose rosapi tells what its nodes do."""
    scripted.topics |= {
        "/odom": "nav_msgs/msg/Odometry",
        "/scan": "sensor_msgs/msg/LaserScan",
        "/map": "nav_msgs/msg/OccupancyGrid",
    }
    told = {node: details for node, details in NODES.items() if node != mute}
    scripted.services |= {
        "/rosapi/nodes": lambda _: {"nodes": list(NODES)},
        "/rosapi/node_details": lambda call: told.get(call["args"]["node"], {}),
    }
    return scripted


def heard(*, n: int, period_s: float | None, age_s: float = 0.0) -> Heard:
    return Heard(
        messages=(), n_received=n, listened_s=2.0, age_s=age_s, known_for_s=2.0, period_s=period_s
    )


# --- who is where


async def test_topics_are_counted_by_their_ends_in_one_call(tmp_path: Path) -> None:
    scripted = with_nodes(ScriptedRobot())
    async with at_time(scripted, tmp_path, 0.0) as (client, caller):
        client.subscribe("/tf")
        text = await caller.ask("ros_topics", ends=True)
    lines = text.splitlines()
    assert "/tf tf2_msgs/msg/TFMessage published by 2, heard by mapspeak alone" in lines
    assert "/cmd_vel geometry_msgs/msg/Twist published by nobody, heard by 1" in lines
    # Of the topic that another client of rosbridge hears, we are no hearer.
    assert "/map nav_msgs/msg/OccupancyGrid published by 1, heard by 1" in lines
    assert "published by nobody: /cmd_vel, /scan, /tf_static" in lines
    assert "heard by nobody: /odom, /tf_static" in lines
    assert "heard by mapspeak alone: /tf" in lines
    asked = [call["service"] for call in scripted.server.asked("call_service")]
    assert asked.count("/rosapi/node_details") == len(NODES)
    assert "/rosapi/publishers" not in asked


async def test_a_node_that_does_not_tell_is_named_and_not_taken_for_an_idle_one(
    tmp_path: Path,
) -> None:
    async with on_script(with_nodes(ScriptedRobot(), mute="/slam"), tmp_path) as caller:
        text = await caller.ask("ros_topics", ends=True)
    assert "not counted, they did not answer: /slam" in text


@pytest.mark.parametrize("dialect", Dialect)
async def test_the_ends_are_told_by_our_own_server_too(dialect: Dialect, tmp_path: Path) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        text = await caller.ask("ros_topics", filter="/cmd_vel", ends=True)
    assert "published by nobody, heard by 1" in text


async def test_the_services_that_every_node_has_are_a_line(tmp_path: Path) -> None:
    scripted = with_nodes(ScriptedRobot())
    own = ["/slam/save", "/lamp", "/slam/serialize_parameters"]
    common = [
        f"{node}/{last}"
        for node in NODES
        for last in ("list_parameters", "get_parameter_types", "set_parameters_atomically")
    ]
    everything = [*own, *common, "/rosapi/nodes", "/slam/get_type_description"]
    scripted.services["/rosapi/services"] = lambda _: {"services": everything}
    async with on_script(scripted, tmp_path) as caller:
        text = await caller.ask("ros_services")
        asked = await caller.ask("ros_services", filter="parameter")
    assert text.splitlines() == [
        "services: 3 of 14",
        *sorted(own),
        '9 more of parameters: ask with filter "parameter"',
        '1 more of types: ask with filter "type_description"',
        '1 more of rosapi: ask with filter "rosapi"',
    ]
    assert "/base/list_parameters" in asked


@pytest.mark.parametrize(("service", "node"), [("/slam/save", "/slam"), ("/lamp", "/base")])
async def test_a_service_is_told_with_the_node_that_offers_it(
    tmp_path: Path, service: str, node: str
) -> None:
    scripted = with_nodes(ScriptedRobot())
    scripted.services["/rosapi/service_type"] = lambda _: {"type": "std_srvs/srv/Trigger"}
    async with on_script(scripted, tmp_path) as caller:
        text = await caller.ask("ros_service", service=service)
    assert text.splitlines()[:2] == [f"{service} std_srvs/srv/Trigger", f"offered by: {node}"]


# --- how late


LATE = " - LATE: 5.0 s old when it came, though one comes every 1 s"
SCAN = {
    "angle_min": 0.0, "angle_increment": 0.1, "range_min": 0.1, "range_max": 9.0, "ranges": [2.0],
}  # fmt: skip
PATH: dict[str, Any] = {"poses": []}


@pytest.mark.parametrize(
    ("type_name", "fields"),
    [
        ("sensor_msgs/msg/LaserScan", SCAN),
        ("nav_msgs/msg/Path", PATH),
        ("sensor_msgs/msg/BatteryState", {"percentage": 0.5}),
        ("nav_msgs/msg/OccupancyGrid", write_grid(two_rooms(), dialect=Dialect.ROS2)),
    ],
)
async def test_every_stamped_message_is_told_with_its_age(
    tmp_path: Path, type_name: str, fields: dict[str, Any]
) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/seen"] = type_name
    header = write_header("laser", 88.0, dialect=Dialect.ROS2)
    scripted.latched["/seen"] = {**fields, "header": header}
    async with at_time(scripted, tmp_path, 100.0) as (_, caller):
        text = await caller.ask("ros_read", topic="/seen")
    assert "\nstamp 88.000 s, 12.00 s behind robot time" in text
    assert "old when it came: kept for latecomers, or late" in text


async def test_a_map_that_a_service_gives_is_told_with_its_age(tmp_path: Path) -> None:
    async with on_our_server(Dialect.ROS2, tmp_path) as (_, caller):
        result = await caller.client.call_tool("ros_call", {"service": "/slam_toolbox/dynamic_map"})
    assert "stamp " in result.content[0].text  # type: ignore[union-attr]


async def test_a_clock_that_is_behind_is_called_late(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/scan"] = "sensor_msgs/msg/LaserScan"
    late = {**SCAN, "header": write_header("laser", 88.0, dialect=Dialect.ROS2)}
    async with (
        at_time(scripted, tmp_path, 100.0) as (_, caller),
        publishing(scripted, "/scan", late),
    ):
        text = await caller.ask("ros_read", topic="/scan", duration_s=0.3)
    assert re.search(r"12\.00 s behind robot time - LATE: 1[12]\.\d s old when it came", text)


@pytest.mark.parametrize(
    ("stamp_s", "period_s", "said"),
    [
        (99.9, 0.1, "0.10 s behind robot time"),
        (97.5, 1.0, "2.50 s behind robot time"),
        (95.0, 1.0, f"5.00 s behind robot time{LATE}"),
        (99.0, None, "1.00 s behind robot time"),
        (101.0, 0.1, "1.00 s ahead of robot time - AHEAD: 1.0 s in the future when it came"),
        (100.2, 0.1, "0.20 s ahead of robot time"),
    ],
)  # fmt: skip
def test_a_stamp_is_late_by_what_its_rate_does_not_explain(
    stamp_s: float, period_s: float | None, said: str
) -> None:
    message = {"header": write_header("base", stamp_s, dialect=Dialect.ROS1)}
    text = say_stamp(message, now_s=100.0, period_s=period_s)
    assert text == f"stamp {stamp_s:.3f} s, {said}"


def test_a_stamp_that_was_never_set_and_a_message_without_one_are_not_judged() -> None:
    unset = {"header": write_header("base", 0.0, dialect=Dialect.ROS2)}
    assert say_stamp(unset, now_s=100.0) == "stamp 0: not set"
    assert say_stamp({"data": 1}, now_s=100.0) == ""
    assert say_stamp({"header": {"stamp": "soon"}}, now_s=100.0) == ""


# --- how often


@pytest.mark.parametrize(
    ("rate_hz", "said"),
    [
        (13.5, "13.5 Hz"),
        (0.1, "0.100 Hz"),
        (7.5, "7.50 Hz"),
        (100.4, "100 Hz"),
        (1234.5, "1234 Hz"),
    ],
)
def test_a_rate_has_three_digits(rate_hz: float, said: str) -> None:
    assert say_rate(rate_hz) == said


def test_a_rate_is_told_by_the_times_between_messages() -> None:
    assert heard(n=27, period_s=1 / 13.5).rate_hz == pytest.approx(13.5)
    assert heard(n=1, period_s=None).rate_hz == 0.5
    assert heard(n=20, period_s=0.1, age_s=1.1).has_stopped
    assert not heard(n=2, period_s=1.0, age_s=2.5).has_stopped


async def test_several_topics_are_measured_in_one_call(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics |= {"/scan": "sensor_msgs/msg/LaserScan", "/sonar": "sensor_msgs/msg/Range"}
    scripted.services["/rosapi/publishers"] = lambda _: {"publishers": ["/sonar_node"]}
    fresh = {**SCAN, "header": write_header("laser", 99.9, dialect=Dialect.ROS2)}
    async with (
        at_time(scripted, tmp_path, 100.0) as (_, caller),
        publishing(scripted, "/scan", fresh),
    ):
        text = await caller.ask("ros_rates", topics=["/scan", "sonar", "/scann"], duration_s=0.4)
    head, scan, sonar, scann = text.splitlines()
    assert head == "listened for 0.4 s"
    assert re.match(
        r"/scan: [\d.]+ Hz, [\d,]+ messages, about [\d.]+ kB/s; stamp 99\.900 s, 0\.10 s behind",
        scan,
    )
    assert re.match(
        r"/sonar: SILENT, nothing came in the 0\.\d s since we listen; published", sonar
    )
    assert sonar.endswith("published by /sonar_node")
    assert scann.startswith("/scann: The robot has no topic '/scann'.")
    left = {each["topic"] for each in scripted.server.asked("unsubscribe")}
    assert left == {"/scan", "/sonar"}


# --- silence


async def test_a_topic_that_fell_silent_is_told_by_its_last_message(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/battery"] = "std_msgs/msg/Float32"
    scripted.services["/rosapi/publishers"] = lambda _: {"publishers": ["/bms"]}
    async with at_time(scripted, tmp_path, 0.0) as (client, caller):
        kept = client.subscribe("/battery", type_name="std_msgs/msg/Float32")
        await scripted.until(lambda: scripted.server.asked("subscribe"))
        await scripted.publish("/battery", {"data": 11.5})
        await kept.wait_for_more_than(0, timeout_s=5.0)
        once = await caller.refuse("ros_read", topic="/battery", duration_s=0.2)
    assert "It is published by /bms, yet the last message came 0." in once


async def test_a_topic_is_told_as_silent_since_we_listen(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/battery"] = "std_msgs/msg/Float32"
    scripted.services["/rosapi/publishers"] = lambda _: {"publishers": ["/bms"]}
    async with on_script(scripted, tmp_path) as caller:
        text = await caller.refuse("ros_read", topic="/battery", wait_s=0.2)
    assert re.search(r"yet nothing came in the 0\.\d s since we listen", text)


async def test_where_there_is_a_clock_robot_time_is_the_clocks(tmp_path: Path) -> None:
    scripted = with_nodes(ScriptedRobot())
    scripted.services["/rosapi/services"] = lambda _: {"services": []}
    scripted.services["/rosapi/get_time"] = lambda _: {"time": {"sec": 1795362623, "nanosec": 0}}
    async with at_time(scripted, tmp_path, 32.0) as (_, caller):
        assert "robot time 1795362623" in await caller.ask("ros_overview")
    scripted.topics["/clock"] = "rosgraph_msgs/msg/Clock"
    async with at_time(scripted, tmp_path, 32.0) as (_, caller):
        assert "robot time 32.0 s" in await caller.ask("ros_overview")


async def test_what_a_node_does_for_us_is_marked(tmp_path: Path) -> None:
    async with at_time(with_nodes(ScriptedRobot()), tmp_path, 0.0) as (client, caller):
        client.subscribe("/tf")
        ours = await caller.ask("ros_node", node="/rosbridge_websocket")
        others = await caller.ask("ros_node", node="/base")
    assert "hears: /map, /tf (mapspeak)" in ours
    assert "publishes: /odom, /tf\n" in others
