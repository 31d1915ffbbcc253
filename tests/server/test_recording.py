"""What is recorded, and shown live, for Foxglove, as rosbags reads it."""

import json
import socket
import struct
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import anyio
import numpy as np
import pytest
from click.testing import CliRunner
from mcp.client import Client
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

from fakes import FakeRobot, two_rooms
from guarding import make_guard
from mapspeak.cli import cli
from mapspeak.errors import ConfigError
from mapspeak.memory import SemanticMapStore
from mapspeak.server.app import build_server
from mapspeak.server.view.calls import CallFeed
from mapspeak.server.view.recording import Recorder, SessionRecord, record_to, serve_foxglove
from mapspeak.session import Session

pytestmark = pytest.mark.anyio

PATIENCE_S = 60.0
TOPICS = {
    "/map": "nav_msgs/msg/OccupancyGrid",
    "/pose": "geometry_msgs/msg/PoseStamped",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/camera/compressed": "sensor_msgs/msg/CompressedImage",
    "/mapspeak/markers": "visualization_msgs/msg/MarkerArray",
    "/mapspeak/calls": "rcl_interfaces/msg/Log",
    "/mapspeak/audit": "rcl_interfaces/msg/Log",
}
LAYOUT = Path(__file__).parents[2] / "docs" / "layouts" / "mapspeak-foxglove.json"


class Noting(Recorder):
    """Tells a test what has been written."""

    def __init__(self) -> None:
        super().__init__()
        self.written: list[str] = []

    def write(self, topic: str, *args: Any, **named: Any) -> None:  # noqa: ANN401 - as it is
        super().write(topic, *args, **named)
        self.written.append(topic)


@asynccontextmanager
async def recorded(
    folder: Path, *recorders: Recorder, name: str = ""
) -> AsyncGenerator[tuple[Client, Callable[[str], Any]]]:
    """Gives a client of a robot that is recorded, and what waits for a topic to be written."""
    noting = Noting()
    memory = SemanticMapStore(folder / "map.yaml")
    session = Session(FakeRobot(two_rooms()), memory, lease_s=60.0, guard=make_guard(folder))
    calls = CallFeed()
    record = SessionRecord(session, [*recorders, noting], calls, name=name)
    server = build_server(session, toolsets=("look", "drive"), call_log=calls)

    async def until_written(topic: str) -> None:
        while topic not in noting.written:  # noqa: ASYNC110 - nobody tells
            await anyio.sleep(0.01)

    with anyio.fail_after(PATIENCE_S):
        async with Client(server) as client, anyio.create_task_group() as tasks:
            tasks.start_soon(record.run)
            yield client, until_written
            tasks.cancel_scope.cancel()


def read_all(path: Path) -> dict[str, list[Any]]:
    with AnyReader([path]) as reader:
        assert {each.topic: each.msgtype for each in reader.connections} == TOPICS
        messages: dict[str, list[Any]] = {topic: [] for topic in TOPICS}
        for connection, _, raw in reader.messages():
            messages[connection.topic].append(reader.deserialize(raw, connection.msgtype))
    return messages


async def test_a_recording_holds_all_of_it_for_other_programs(tmp_path: Path) -> None:
    path, grid = tmp_path / "run.mcap", two_rooms()
    with record_to(path) as recorder:
        async with recorded(tmp_path, recorder) as (client, until_written):
            await client.call_tool("get_robot_pose", {})
            await client.call_tool("navigate_to", {"x": 6.0, "y": 1.4})
            await client.call_tool("navigate_to", {"place": "nowhere \u202e\x00 at all"})
            for topic in TOPICS:
                await until_written(topic)
    messages = read_all(path)
    (map_message,) = messages["/map"]
    assert (map_message.data.reshape(grid.cells.shape) == grid.cells).all()
    assert messages["/pose"][0].pose.position.x == 1.5
    assert messages["/tf"][0].transforms[0].child_frame_id == "base_footprint"
    assert bytes(messages["/camera/compressed"][0].data[:2]) == b"\xff\xd8"
    names = {marker.ns for marker in messages["/mapspeak/markers"][0].markers}
    assert names >= {"rooms", "doors"}
    pose, drive, lost = messages["/mapspeak/calls"]
    assert (pose.name, pose.level) == ("get_robot_pose", 20)
    assert json.loads(drive.msg.splitlines()[0]) == {"x": 6.0, "y": 1.4}
    assert lost.level == 30
    decisions = [json.loads(each.msg) for each in messages["/mapspeak/audit"]]
    assert {each["event"] for each in decisions} >= {"decision"}


def test_every_panel_of_the_layout_for_foxglove_shows_a_topic_of_its_kind() -> None:
    layout = json.loads(LAYOUT.read_text(encoding="utf-8"))
    shown = {
        panel: [
            *config.get("topics", ()),
            *filter(
                None, [config.get("topicToRender"), config.get("imageMode", {}).get("imageTopic")]
            ),
        ]
        for panel, config in layout["configById"].items()
    }
    assert {panel: [TOPICS[topic] for topic in topics] for panel, topics in shown.items()} == {
        "3D!map": [TOPICS["/map"], TOPICS["/mapspeak/markers"], TOPICS["/pose"]],
        "Image!camera": ["sensor_msgs/msg/CompressedImage"],
        "RosOut!calls": ["rcl_interfaces/msg/Log"],
        "RosOut!audit": ["rcl_interfaces/msg/Log"],
    }


async def test_of_several_robots_each_has_topics_of_its_own(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with record_to(path) as recorder:
        async with recorded(tmp_path, recorder, name="hall") as (client, until_written):
            await client.call_tool("get_robot_pose", {})
            for topic in ("/hall/map", "/mapspeak/hall/markers", "/mapspeak/hall/calls"):
                await until_written(topic)
    with AnyReader([path]) as reader:
        assert {"/hall/map", "/hall/pose"} <= {each.topic for each in reader.connections}


def test_a_file_that_is_there_is_not_recorded_over(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(b"dear")
    with pytest.raises(ConfigError, match="cannot be recorded to"), record_to(path):
        pass
    assert path.read_bytes() == b"dear"


async def channels_of(page: ClientConnection, n_wanted: int) -> dict[str, int]:
    found: dict[str, int] = {}
    while len(found) < n_wanted:
        said = json.loads(await page.recv())
        if said["op"] == "advertise":
            found |= {each["topic"]: each["id"] for each in said["channels"]}
    return found


async def test_foxglove_is_shown_what_was_latched_before_it_came(
    tmp_path: Path,
) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    grid, store = two_rooms(), get_typestore(Stores.ROS2_KILTED)
    with serve_foxglove("127.0.0.1", port) as recorder:
        async with recorded(tmp_path, recorder) as (_, until_written):
            await until_written("/map")
            url, protocol = f"ws://127.0.0.1:{port}", Subprotocol("foxglove.sdk.v1")
            async with connect(url, subprotocols=[protocol]) as page:
                channels = await channels_of(page, 1)
                while "/map" not in channels:
                    channels |= await channels_of(page, 1)
                wanted = {"id": 7, "channelId": channels["/map"]}
                await page.send(json.dumps({"op": "subscribe", "subscriptions": [wanted]}))
                while isinstance(data := await page.recv(), str):
                    pass
    opcode, subscription = struct.unpack_from("<BI", data)
    assert (opcode, subscription) == (1, 7)
    message: Any = store.deserialize_cdr(data[13:], "nav_msgs/msg/OccupancyGrid")
    assert np.array_equal(message.data.reshape(grid.cells.shape), grid.cells)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--markers"], "needs a robot with ROS"),
        (["--foxglove", "0.0.0.0:8765"], "can be reached from other machines"),
        (["--record", "/nowhere/at/all.mcap"], "cannot be recorded to"),
    ],
)
def test_what_cannot_be_drawn_is_said_before_anything_is_served(
    options: list[str], said: str
) -> None:
    ended = CliRunner().invoke(cli, ["serve", *options])
    assert ended.exit_code != 0
    assert said in f"{ended.exception!r} {ended.output}"
