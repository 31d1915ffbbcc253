"""A server that only looks publishes nothing; what it does all the same is marked as its own."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from mcp.client import Client

from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.memory import SemanticMapStore
from mapspeak.server.app import build_server
from mapspeak.session import Session
from rosbridge_robot import ScriptedRobot
from rosbridge_script import running
from rosserved import QUICK, Caller

pytestmark = pytest.mark.anyio
ZERO = {"x": 0.0, "y": 0.0, "z": 0.0}


@asynccontextmanager
async def serving(
    scripted: ScriptedRobot, folder: Path, *, is_read_only: bool
) -> AsyncGenerator[Caller]:
    """Serves the robot itself, with its brake and its way of driving."""
    async with (
        running(scripted.server) as server,
        open_rosbridge_robot(server.url, patience=QUICK) as robot,
    ):
        memory = SemanticMapStore(folder / "semantic_map.yaml")
        session = Session(robot, memory, lease_s=60.0, ros=robot.connection)
        built = build_server(session, toolsets=("drive", "ros"), is_read_only=is_read_only)
        async with Client(built) as client:
            yield Caller(client)


def advertised(scripted: ScriptedRobot) -> set[str]:
    """Gives the topics that the robot believes us to publish."""
    topics: set[str] = set()
    for operation in scripted.server.operations:
        if operation["op"] == "advertise":
            topics.add(operation["topic"])
        elif operation["op"] == "unadvertise":
            topics.discard(operation["topic"])
    return topics


def published(scripted: ScriptedRobot, topic: str) -> list[dict[str, Any]]:
    return [each["msg"] for each in scripted.server.asked("publish") if each["topic"] == topic]


@pytest.mark.parametrize("ros", [1, 2])
async def test_a_server_that_only_looks_is_no_publisher(tmp_path: Path, ros: int) -> None:
    scripted = ScriptedRobot(ros=ros)
    async with serving(scripted, tmp_path, is_read_only=True) as caller:
        await caller.ask("ros_topics")
        await scripted.until(lambda: not advertised(scripted))
        await caller.ask("ros_read", topic="/tf")
        assert advertised(scripted) == set()
        assert scripted.server.asked("publish") == []


async def test_one_that_may_drive_says_so_at_once_for_a_prompt_stop(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    async with serving(scripted, tmp_path, is_read_only=False) as caller:
        await caller.ask("ros_topics")
        await scripted.until(lambda: "/cmd_vel" in advertised(scripted))


async def test_a_stop_works_all_the_same_and_is_said_until_the_robot_has_noticed(
    tmp_path: Path,
) -> None:
    scripted = ScriptedRobot()
    async with serving(scripted, tmp_path, is_read_only=True) as caller:
        await caller.ask("stop_robot")
        # Three are the brake's own; those of the next second outlast the robot's noticing.
        await scripted.until(lambda: len(published(scripted, "/cmd_vel")) > 12)
        assert advertised(scripted) == {"/cmd_vel"}
    stands = published(scripted, "/cmd_vel")
    assert all(each == {"linear": ZERO, "angular": ZERO} for each in stands)
    names = [each["op"] for each in scripted.server.operations]
    assert names.index("advertise") < names.index("publish")


async def test_a_stop_of_move_base_cancels_what_others_have_sent(tmp_path: Path) -> None:
    scripted = ScriptedRobot(ros=1)
    async with serving(scripted, tmp_path, is_read_only=True) as caller:
        await caller.ask("stop_robot")
        await scripted.until(lambda: published(scripted, "/move_base/cancel"))
        assert advertised(scripted) == {"/cmd_vel", "/move_base/cancel"}
    assert published(scripted, "/move_base/cancel")[0]["id"] == ""


async def test_our_own_ends_are_marked_and_those_of_others_are_not(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    ours = "/rosbridge_websocket"
    scripted.services["/rosapi/publishers"] = lambda _: {"publishers": [ours, "/twist_mux"]}
    scripted.services["/rosapi/subscribers"] = lambda _: {"subscribers": [ours, "/base"]}
    async with serving(scripted, tmp_path, is_read_only=False) as caller:
        velocity = await caller.ask("ros_topic", topic="/cmd_vel")
        frames = await caller.ask("ros_topic", topic="/tf")
    assert f"published by: {ours} (mapspeak), /twist_mux" in velocity
    # Another client of the same rosbridge listens there.
    assert f"heard by: /base, {ours}\n" in velocity
    assert f"published by: {ours}, /twist_mux" in frames
    assert f"heard by: /base, {ours} (mapspeak)" in frames
