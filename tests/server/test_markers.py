"""What lies on the map in RViz and Foxglove: markers on the robot's ROS, and what is recorded."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import anyio
import anyio.lowlevel
import pytest
from ruamel.yaml import YAML

from drawing import grid_from_text
from fakes import TWO_ROOMS, FakeRobot, two_rooms
from mapspeak.geometry import Pose
from mapspeak.links.rosbridge import RobotAddress, RosbridgeClient, open_client
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.markers import MarkShape, write_markers
from mapspeak.server.view.marking import MarkerPublisher, marks_of, topic_for
from mapspeak.server.view.overlay import (
    ClosedView,
    DoorView,
    FrontierView,
    Overlay,
    RegionView,
    RememberedView,
)
from mapspeak.session import Session
from rosbridge_robot import ScriptedRobot
from rosbridge_script import PATIENCE_S, Operation, running
from rosserved import QUICK

pytestmark = pytest.mark.anyio

LAYOUTS = Path(__file__).parents[2] / "docs" / "layouts"
SQUARE = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]
HOSTILE = "fire\x00 \ud800\n<script>"
FULL = Overlay(
    regions=[RegionView(id="R1", kind="room", floor_m2=4.0, middle=(1.0, 1.0), outlines=[SQUARE])],
    doors=[DoorView(id="D1", at=(2.0, 1.0), joins=["R1"], width_m=0.9)],
    frontiers=[FrontierView(id="F1", at=(0.0, 1.0), border=[(0.0, 0.9)], promised_m2=3.0)],
    closed=[ClosedView(title="wet", outlines=[SQUARE], event_id="E1")],
    places=[RememberedView(id="W1", name=HOSTILE, at=(1.0, 1.5), yaw_deg=90.0)],
    things=[RememberedView(id="T1", name="exit", at=(0.5, 0.5), radius_m=0.4)],
)


def drawn(dialect: Dialect = Dialect.ROS2) -> list[dict[str, Any]]:
    marks = list(marks_of(FULL, path=[(0.0, 0.0), (1.0, 1.0)]))
    markers: list[dict[str, Any]] = write_markers(marks, frame_id="map", dialect=dialect)["markers"]
    return markers


def in_group(group: str) -> dict[str, Any]:
    return next(each for each in drawn() if each["ns"] == group)


def test_everything_on_the_map_is_drawn_in_a_group_of_its_own() -> None:
    erase, *others = drawn()
    assert erase["action"] == 3
    named = {"rooms", "doors", "frontiers", "closed", "places", "things"}
    assert {each["ns"] for each in others} == named | {f"{each} names" for each in named} | {"path"}
    assert len({each["id"] for each in others}) == len(others)


def test_sizes_and_places_are_those_of_the_map() -> None:
    assert in_group("doors")["scale"]["x"] == 0.9
    assert in_group("doors")["pose"]["position"]["x"] == 2.0
    assert in_group("things")["scale"]["y"] == 0.8
    corners = [(point["x"], point["y"]) for point in in_group("rooms")["points"]]
    assert corners == [*SQUARE, SQUARE[0]]
    assert [(point["x"], point["y"]) for point in in_group("frontiers")["points"]] == [(0.0, 0.9)]
    turned = in_group("places")["pose"]["orientation"]
    assert (turned["z"], turned["w"]) == pytest.approx((0.7071, 0.7071), abs=1e-3)
    assert in_group("path")["type"] == MarkShape.LINE


def test_names_are_shown_as_text_whatever_they_hold() -> None:
    assert in_group("places names")["text"] == "W1 fire <script>"
    assert in_group("rooms names")["text"] == "R1 4 m2"


def test_a_robot_with_a_name_has_markers_of_its_own() -> None:
    assert topic_for("") == "/mapspeak/markers"
    assert topic_for("hall-2") == "/mapspeak/hall_2/markers"


# --- on the robot's ROS


@asynccontextmanager
async def publishing(
    scripted: ScriptedRobot, folder: Path, robot: FakeRobot
) -> AsyncGenerator[tuple[MarkerPublisher, RosbridgeClient]]:
    session = Session(robot, SemanticMapStore(folder / "map.yaml"), lease_s=60.0)
    with anyio.fail_after(PATIENCE_S):
        async with (
            running(scripted.server) as server,
            open_client(RobotAddress(url=server.url), patience=QUICK) as client,
        ):
            yield MarkerPublisher(session, client), client


def published(scripted: ScriptedRobot) -> list[Operation]:
    return scripted.server.asked("publish")


@pytest.mark.parametrize("ros", [1, 2])
async def test_markers_are_latched_and_published_when_they_change(tmp_path: Path, ros: int) -> None:
    scripted, robot = ScriptedRobot(ros=ros), FakeRobot(two_rooms())
    async with publishing(scripted, tmp_path, robot) as (publisher, client):
        for _ in range(3):
            await publisher.look()
        robot.grid = grid_from_text(TWO_ROOMS.replace("#............................#", "#" * 30))
        await publisher.look()
        await client.call_service("/rosapi/get_time")
        await scripted.until(lambda: len(published(scripted)) == 2)
    kind = "visualization_msgs/MarkerArray" if ros == 1 else "visualization_msgs/msg/MarkerArray"
    (told,) = {
        (each["topic"], each["type"], each["latch"]) for each in scripted.server.asked("advertise")
    }
    assert told == ("/mapspeak/markers", kind, True)
    first = published(scripted)[0]["msg"]["markers"]
    assert {each["ns"] for each in first} >= {"rooms", "rooms names", "doors"}
    assert [each["text"] for each in first if each["ns"] == "doors names"] == ["D1"]


async def test_a_rosbridge_that_was_started_anew_is_told_all_again(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    async with publishing(scripted, tmp_path, FakeRobot(two_rooms())) as (publisher, client):
        await publisher.look()
        await scripted.until(lambda: published(scripted))
        n_connections = client.n_connections
        await scripted.server.drop_all()
        while client.n_connections == n_connections or client.connected_for_s is None:
            await anyio.lowlevel.checkpoint()
        await publisher.look()
        await scripted.until(lambda: len(published(scripted)) == 2)


async def test_the_path_is_drawn_while_the_robot_drives_it(tmp_path: Path) -> None:
    scripted, robot = ScriptedRobot(), FakeRobot(two_rooms())
    async with publishing(scripted, tmp_path, robot) as (publisher, _):
        session = publisher._session
        goal = await session.find_goal(place=None, x=6.0, y=1.4, yaw_deg=None)
        with session.drives.preparing() as ticket:
            await session.drives.start(goal.pose, place="there", ticket=ticket)
        await publisher.look()
        await scripted.until(lambda: published(scripted))
    path = [each for each in published(scripted)[0]["msg"]["markers"] if each["ns"] == "path"]
    last = path[0]["points"][-1]
    assert Pose(last["x"], last["y"]).point.distance_to(goal.pose.point) < 0.3


# --- layouts


@pytest.mark.parametrize("name", ["mapspeak-ros1.rviz", "mapspeak-ros2.rviz"])
def test_the_layouts_for_rviz_show_what_is_published(name: str) -> None:
    layout = YAML(typ="safe").load((LAYOUTS / name).read_text(encoding="utf-8"))
    displays = {each["Name"]: each for each in layout["Visualization Manager"]["Displays"]}
    shown = displays["mapspeak"]
    latched = {**shown.get("Topic", {})}
    assert shown.get("Marker Topic", latched.get("Value")) == topic_for("")
    assert latched.get("Durability Policy", "Transient Local") == "Transient Local"
    assert set(shown["Namespaces"]) == {each["ns"] for each in drawn()[1:]}
