"""Velocities of `ros_publish`: one at a time, never against a drive, and honest about their end."""

from pathlib import Path

import anyio
import pytest

from mapspeak.ros.messages.fields import Dialect
from rosbridge_robot import ScriptedRobot
from rosserved import Caller, at_time, on_our_server, on_script

pytestmark = pytest.mark.anyio
FORWARD = {"linear": {"x": 0.2}}
STAND = {"linear": {"x": 0.0}}


def is_moving(scripted: ScriptedRobot) -> bool:
    return any(each["msg"] == FORWARD for each in scripted.server.asked("publish"))


async def move(caller: Caller, said: list[str], duration_s: float = 20.0) -> None:
    result = await caller.client.call_tool(
        "ros_publish",
        {"topic": "/cmd_vel", "fields": FORWARD, "duration_s": duration_s, "rate_hz": 50},
    )
    said.append(result.content[0].text)  # type: ignore[union-attr]


async def test_a_second_velocity_is_refused_while_the_first_moves_the_robot(
    tmp_path: Path,
) -> None:
    scripted, said = ScriptedRobot(), list[str]()
    async with on_script(scripted, tmp_path) as caller, anyio.create_task_group() as tasks:
        tasks.start_soon(move, caller, said)
        await scripted.until(lambda: is_moving(scripted))
        second = await caller.refuse("ros_publish", topic="/cmd_vel", fields=FORWARD, duration_s=1)
        stand = await caller.ask("ros_publish", topic="/cmd_vel", fields=STAND)
        await caller.ask("stop_robot")
    assert "Another publication moves the robot on /cmd_vel for 1" in second
    assert "stop_robot ends it" in second
    assert "Published once on /cmd_vel. Another publication goes on there for 1" in stand
    assert "until the robot was stopped, then a stand on /cmd_vel." in said[0]


async def test_a_velocity_on_another_topic_is_refused_too(tmp_path: Path) -> None:
    scripted, said = ScriptedRobot(), list[str]()
    scripted.topics["/cmd_vel_teleop"] = "geometry_msgs/msg/Twist"
    async with on_script(scripted, tmp_path) as caller, anyio.create_task_group() as tasks:
        tasks.start_soon(move, caller, said)
        await scripted.until(lambda: is_moving(scripted))
        second = await caller.refuse(
            "ros_publish", topic="/cmd_vel_teleop", fields=FORWARD, duration_s=1
        )
        await caller.ask("stop_robot")
    assert "Another publication moves the robot on /cmd_vel for 1" in second


async def test_a_velocity_is_refused_during_a_drive_of_our_own(tmp_path: Path) -> None:
    async with on_our_server(Dialect.ROS2, tmp_path) as (_, caller):
        await caller.ask("navigate_to", x=2.0, y=1.0, wait_s=0)
        text = await caller.refuse("ros_publish", topic="/cmd_vel", fields=FORWARD, duration_s=1)
        await caller.ask("cancel_goal")
        later = await caller.ask("ros_publish", topic="/cmd_vel", fields=FORWARD, duration_s=0.1)
    assert "G1 to " in text
    assert "is under way: a velocity on /cmd_vel would work against it" in text
    assert "Published once in 0.1" in later


async def test_a_drive_that_begins_ends_a_velocity(tmp_path: Path) -> None:
    scripted, said = ScriptedRobot(), list[str]()
    async with on_script(scripted, tmp_path) as caller, anyio.create_task_group() as tasks:
        tasks.start_soon(move, caller, said)
        await scripted.until(lambda: is_moving(scripted))
        await caller.ask("navigate_to", x=2.0, y=1.0, wait_s=0)
    assert "until G1 began, which drives the robot now, then a stand" in said[0]


async def test_a_connection_lost_meanwhile_is_told_with_what_was_sent(tmp_path: Path) -> None:
    scripted, said = ScriptedRobot(), list[str]()
    async with on_script(scripted, tmp_path) as caller, anyio.create_task_group() as tasks:
        tasks.start_soon(move, caller, said)
        await scripted.until(lambda: is_moving(scripted))
        scripted.server.hangs_up = True
        await scripted.server.drop_all()
    assert "Published " in said[0]
    assert "on /cmd_vel, then the connection was lost. The stand could not be sent" in said[0]
    assert "whether the robot stands is not known" in said[0]
    assert "stop it by hand" in said[0]


async def test_a_connection_that_comes_back_at_once_brings_the_stand(tmp_path: Path) -> None:
    scripted, said = ScriptedRobot(), list[str]()
    async with on_script(scripted, tmp_path) as caller, anyio.create_task_group() as tasks:
        tasks.start_soon(move, caller, said)
        await scripted.until(lambda: is_moving(scripted))
        scripted.server.hangs_up = True
        await scripted.server.drop_all()
        await scripted.until(lambda: scripted.server.n_sent_away > 30)
        scripted.server.hangs_up = False
    assert "then the connection was lost; it is back, and a stand was sent" in said[0]
    assert scripted.server.asked("publish")[-1]["msg"] == STAND


async def test_a_publication_that_is_refused_changes_nothing_of_what_a_stop_sends(
    tmp_path: Path,
) -> None:
    scripted = ScriptedRobot()
    odd = {"topic": "/odd/cmd_vel", "duration_s": 0.1}
    async with at_time(scripted, tmp_path, 1.0) as (client, caller):
        await caller.ask("ros_publish", **odd, fields=FORWARD, type="geometry_msgs/msg/Twist")
        stamped = {"twist": FORWARD}
        refused = await caller.refuse(
            "ros_publish", **odd, fields=stamped, type="geometry_msgs/msg/TwistStamped"
        )
        assert "twist" not in client.started.velocities["/odd/cmd_vel"]
    assert "was advertised as geometry_msgs/msg/Twist" in refused
