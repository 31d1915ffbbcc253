"""skills.yaml over a ROS system of both dialects: called, bounded, judged, approved."""

from pathlib import Path
from typing import Any

import pytest

from exposing import NODE, exposed, tool_system, watched
from fakes import FakeRobot, two_rooms
from guarding import make_guard
from mapspeak.links.rosbridge import RobotAddress, open_client
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server.hub import Topic
from mapspeak.safety import Approval, Otherwise, Policy
from mapspeak.skills.skillsfile import OwnersEntry, load_skills
from rosbridge_robot import ScriptedRobot
from rosbridge_script import running
from rosserved import QUICK

pytestmark = pytest.mark.anyio
both = pytest.mark.parametrize("dialect", Dialect)
BATTERY = "sensor_msgs/BatteryState"
WRITTEN = """
skills:
- name: light
  sentence: Switches the light of the lab
  service: /lab/light
  arguments:
  - {name: is_on, sets: data, kind: flag}
  needs: {battery_above: 0.3}
- name: light_off
  service: /lab/light
  fixed: {data: false}
  succeeded_when: {field: message, is: dark}
- name: place_robot
  publish: /initialpose
  arguments:
  - {name: x, sets: pose_pose_position_x, unit: m, least: -100, most: 100}
  approval: always
- name: gone
  service: /not/there
"""


def load(folder: Path) -> tuple[OwnersEntry, ...]:
    path = folder / "skills.yaml"
    path.write_text(WRITTEN)
    return load_skills(path)


def lab(dialect: Dialect, *, percentage: float) -> tuple[Any, list[Any], list[Any]]:
    """Gives a system with a light, a battery and a place for its pose, and what they hear."""
    asked: list[Any] = []
    poses: list[Any] = []

    def answer(values: dict[str, Any]) -> dict[str, Any]:
        asked.append(values["data"])
        return {"success": True, "message": "bright"}

    battery = Topic(name="/power", type=BATTERY, publishers=(NODE,), is_latched=True)
    pose = Topic(
        name="/initialpose", type="geometry_msgs/PoseWithCovarianceStamped", subscribers=(NODE,)
    )
    pose.takers.append(lambda publication: poses.append(publication.message))
    system = tool_system(dialect, battery, pose)
    system.hub.publish("/power", system.interfaces.fill(BATTERY, {"percentage": percentage}))
    system.offer_typed("/lab/light", "std_srvs/SetBool", node=NODE, answer=answer)
    return system, asked, poses


async def test_a_call_may_last_as_long_as_the_owner_says(tmp_path: Path) -> None:
    system, *_ = lab(Dialect.ROS2, percentage=0.8)
    light = OwnersEntry(name="light", service="/lab/light", timeout_s=3600.0)
    async with exposed(system, tmp_path, expose=(), skills=[light]) as caller:
        called = await caller.server.book.open_called(light)
    assert called.spec.timeout_s == 3600.0


@both
async def test_a_service_is_called_with_what_the_owner_allows(
    dialect: Dialect, tmp_path: Path
) -> None:
    system, asked, _ = lab(dialect, percentage=0.8)
    async with exposed(system, tmp_path, expose=(), skills=load(tmp_path)) as caller:
        tools = await caller.tools()
        assert set(tools["light"].input_schema["properties"]) == {"is_on", "wait_s"}
        assert set(tools["light_off"].input_schema["properties"]) == {"wait_s"}
        assert "succeeded" in await caller.ask("light", is_on=True)
        lied = await caller.ask("light_off")
        missing = await caller.refuse("gone")
    assert asked == [True, False]
    assert "condition of success did not hold" in lied
    assert "/not/there" in missing


@both
async def test_a_battery_topic_decides_whether_a_skill_is_begun(
    dialect: Dialect, tmp_path: Path
) -> None:
    system, asked, _ = lab(dialect, percentage=0.2)
    async with exposed(system, tmp_path, expose=(), skills=load(tmp_path)) as caller:
        told = await caller.ask("light", is_on=True)
        mission = await caller.ask(
            "run_mission", tree="fallback:\n- check: {battery_above: 0.5}\n- light_off\n"
        )
    assert "It needs the battery above 30 %" in told
    assert asked == [False]
    assert "not_achieved" in mission


async def test_a_persons_word_lets_a_skill_publish_what_is_usually_denied(tmp_path: Path) -> None:
    system, _, poses = lab(Dialect.ROS2, percentage=1.0)
    guard = make_guard(tmp_path, Policy(approval=Approval(otherwise=Otherwise.QUEUE)))
    async with exposed(system, tmp_path, expose=(), skills=load(tmp_path), guard=guard) as caller:
        asked = await caller.refuse("place_robot", x=2.5)
        assert poses == []
        (request,) = guard.approvals.room.list_waiting()
        guard.approvals.room.approve(request)
        await caller.ask("place_robot", x=2.5)
        again = await caller.refuse("place_robot", x=3.5)
    assert "run the skill place_robot (x=2.5)" in asked
    assert [each["pose"]["pose"]["position"]["x"] for each in poses] == [2.5]
    assert "A person must agree" in again


def at(x: float) -> dict[str, Any]:
    return {
        "header": {"frame_id": "map"},
        "pose": {"position": {"x": x, "y": 1.0}, "orientation": {"w": 1.0}},
    }


async def test_nav2_itself_drives_to_waypoints_once_a_person_agrees(tmp_path: Path) -> None:
    scripted = ScriptedRobot(actions=("/follow_waypoints",))
    kind = {"type": "nav2_msgs/action/FollowWaypoints"}
    scripted.services["/rosapi/action_type"] = lambda _: kind
    guard = make_guard(tmp_path, Policy(approval=Approval(otherwise=Otherwise.QUEUE)))
    async with (
        running(scripted.server) as server,
        open_client(RobotAddress(url=server.url), patience=QUICK) as client,
        watched(
            FakeRobot(two_rooms()),
            client,
            tmp_path,
            expose=(),
            guard=guard,
            skills=load_skills(Path("nav2")),
        ) as caller,
    ):
        poses = [at(1.0), at(2.0)]
        asked = await caller.refuse("follow_waypoints", poses=poses)
        (request,) = guard.approvals.room.list_waiting()
        guard.approvals.room.approve(request)
        text = await caller.ask("follow_waypoints", poses=poses, wait_s=0)
        await scripted.until(lambda: scripted.goals)
    assert "A person must agree" in asked
    assert "running" in text
    ((_, operation),) = scripted.goals
    assert operation["action"] == "/follow_waypoints"
    assert [each["pose"]["position"]["x"] for each in operation["args"]["poses"]] == [1.0, 2.0]
