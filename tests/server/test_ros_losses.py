"""The ROS tools while the connection is lost, and after it is back: nothing old told as new."""

import re
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import anyio
import anyio.lowlevel
import pytest

from fakes import FakeRobot, two_rooms
from mapspeak.links.rosbridge import RobotAddress, RosbridgeClient, open_client
from rosbridge_robot import ScriptedRobot
from rosbridge_script import running
from rosserved import QUICK, Caller, served

pytestmark = pytest.mark.anyio
ACTION = "/navigate_to_pose"
GOAL = {"pose": {"pose": {"position": {"x": 1.0}}}}
IMPATIENT = replace(QUICK, answer_s=0.3, attempt_s=0.01)


@asynccontextmanager
async def losing(
    scripted: ScriptedRobot, folder: Path
) -> AsyncGenerator[tuple[RosbridgeClient, Caller]]:
    async with (
        running(scripted.server) as server,
        open_client(RobotAddress(url=server.url), patience=IMPATIENT) as client,
        served(FakeRobot(two_rooms()), client, folder) as caller,
    ):
        yield client, caller


async def lose(scripted: ScriptedRobot, client: RosbridgeClient) -> None:
    scripted.server.hangs_up = True
    await scripted.server.drop_all()
    while client.lost_for_s is None:
        await anyio.lowlevel.checkpoint()


async def come_back(scripted: ScriptedRobot, client: RosbridgeClient) -> None:
    scripted.server.hangs_up = False
    while client.lost_for_s is not None:
        await anyio.lowlevel.checkpoint()


async def test_right_after_the_start_no_connection_was_lost(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    async with losing(scripted, tmp_path) as (_, caller):
        listed = await caller.ask("ros_goal_status", action=ACTION)
    assert "lost" not in listed


async def test_a_goals_state_is_told_with_the_loss_of_the_connection(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    async with losing(scripted, tmp_path) as (client, caller):
        whole = await caller.ask("ros_send_goal", action=ACTION, fields=GOAL, wait_s=0)
        await lose(scripted, client)
        lost = await caller.ask("ros_goal_status")
        listed = await caller.ask("ros_goal_status", action=ACTION)
        await come_back(scripted, client)
        back = await caller.ask("ros_goal_status")
    assert "connection" not in whole
    assert "The connection was lost 0." in lost
    assert "is not back yet: this is as old as that" in lost
    assert "The connection was lost 0." in listed
    assert "was lost meanwhile and is back since 0." in back


async def test_what_was_read_before_a_loss_is_told_as_old(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/lamp"] = "std_msgs/msg/Bool"
    scripted.latched["/lamp"] = {"data": True}
    async with losing(scripted, tmp_path) as (client, caller):
        kept = client.subscribe("/lamp", type_name="std_msgs/msg/Bool")
        whole = await caller.ask("ros_read", topic="/lamp")
        del scripted.latched["/lamp"]
        await lose(scripted, client)
        lost = await caller.ask("ros_read", topic="/lamp")
        nothing = await caller.refuse("ros_read", topic="/tf_static", wait_s=0.1)
        await come_back(scripted, client)
        back = await caller.ask("ros_read", topic="/lamp")
        client.unsubscribe(kept)
    assert "connection" not in whole
    assert "is not back yet: this is as old as that.\ndata: true" in lost
    assert "No message came on /tf_static within 0.1 s. The connection was lost 0." in nothing
    assert "what came before may be old.\ndata: true" in back


async def test_a_lost_connection_is_told_by_how_long_it_has_been_lost(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    async with losing(scripted, tmp_path) as (client, caller):
        await lose(scripted, client)
        for _ in range(80):
            # A third of a second each would be more than a test may take.
            text = await caller.refuse("ros_overview")
    assert re.search(r"has been lost for [1-9]\d* s", text)


async def test_what_is_too_large_is_refused_before_it_cuts_the_connection(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    async with losing(scripted, tmp_path) as (client, caller):
        text = await caller.refuse(
            "ros_publish",
            topic="/chat",
            type="std_msgs/msg/String",
            fields={"data": "x" * 10_000_000},
        )
        await caller.ask("ros_topics")
        assert client.n_connections == 1
    assert "ros_publish was called with 10.0 MB of arguments; at most 1 MB are taken" in text
    assert scripted.server.asked("publish") == []


async def test_control_signs_of_a_robot_are_shown_and_do_nothing(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.topics |= {"/chat": "std_msgs/msg/String", "/odd": "odd_\x1b[2Jmsgs/msg/Odd"}
    scripted.latched["/chat"] = {"data": "a\x1b[31mb\u202e\nspeed: 9"}
    async with losing(scripted, tmp_path) as (_, caller):
        read = await caller.ask("ros_read", topic="/chat")
        listed = await caller.ask("ros_topics")
        scripted.services["/rosapi/nodes"] = lambda _: {"nodes": 1}
        scripted.services["/rosapi/service_type"] = lambda _: {"type": "a\x1b/b"}
        refused = await caller.refuse("ros_service", service="/lamp")
    assert 'data: "a\\u001b[31mb\\u202e\\nspeed: 9"' in read
    assert "odd_\\u001b[2Jmsgs" in listed
    assert "\x1b" not in refused
