"""The simulated robot's skills and its battery as a ROS offers them, and as typed tools over it."""

import json
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from exposing import Watched, watched
from fakes import FakeRobot, two_rooms
from mapspeak.geometry import Pose
from mapspeak.links.rosbridge import RobotAddress, open_client
from mapspeak.links.simulated import SimulatedRobot
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server import open_rosbridge_server
from mapspeak.simulator import Simulation, StateRecord
from mapspeak.skills.skillsfile import load_skills
from rosserved import QUICK
from skilledworld import make_workshop

pytestmark = pytest.mark.anyio
both = pytest.mark.parametrize("dialect", Dialect)
SKILLS = {"dock", "open_door", "lift_pallet", "lower_pallet", "speak", "read_battery"}
PATIENCE_S = 60.0


@asynccontextmanager
async def workshop(dialect: Dialect, folder: Path) -> AsyncGenerator[tuple[Simulation, str]]:
    """Gives a robot before a shut door, and the address of its rosbridge."""
    simulation = Simulation(make_workshop(folder), seed=1, start=Pose(4.9, 1.5))
    robot = SimulatedRobot(simulation, has_detector=False)
    async with open_rosbridge_server(robot, dialect=dialect, skilled=robot) as server:
        yield simulation, server.url


@asynccontextmanager
async def tools_of(url: str, folder: Path, *names: str) -> AsyncGenerator[Watched]:
    """Gives a client for which the robot's own names are tools."""
    async with (
        open_client(RobotAddress(url=url), patience=QUICK) as client,
        watched(FakeRobot(two_rooms()), client, folder, expose=names) as caller,
    ):
        yield caller


@both
async def test_each_skill_is_a_service(dialect: Dialect, tmp_path: Path) -> None:
    async with (
        workshop(dialect, tmp_path) as (simulation, url),
        open_client(RobotAddress(url=url)) as client,
    ):
        for skill in SKILLS:
            kind = await client.fetch_service_type(f"/robot_skills/{skill}")
            assert kind is not None
            has_own = skill in ("dock", "speak")
            assert kind.startswith("robot_skills/" if has_own else "std_srvs/")
        said = await client.call_service("/robot_skills/speak", {"text": "Mind the step."})
        opened = await client.call_service("/robot_skills/open_door")
        again = await client.call_service("/robot_skills/open_door")
    assert said["success"]
    assert json.loads(opened["message"]) == {"width_m": 1.1}
    assert (again["success"], again["message"]) == (False, "No shut door answers within 1.8 m.")
    assert StateRecord.of(simulation).deeds == ("speak: Mind the step.", "open_door: store door")


@both
async def test_the_battery_is_a_topic(dialect: Dialect, tmp_path: Path) -> None:
    async with (
        workshop(dialect, tmp_path) as (_, url),
        open_client(RobotAddress(url=url)) as client,
    ):
        heard = client.subscribe("/battery_state")
        message = await heard.wait_for_more_than(0, timeout_s=PATIENCE_S)
    assert message["percentage"] == pytest.approx(0.4, abs=0.01)
    assert message["header"]["frame_id"]


@both
async def test_services_and_battery_are_typed_tools(dialect: Dialect, tmp_path: Path) -> None:
    async with (
        workshop(dialect, tmp_path) as (simulation, url),
        tools_of(url, tmp_path, "/robot_skills/*", "/battery_state") as caller,
    ):
        tools = await caller.until(lambda tools: "robot_skills_open_door" in tools)
        opened = await caller.ask("robot_skills_open_door")
        again = await caller.ask("robot_skills_open_door")
    assert any("battery_state" in name for name in tools)
    assert "succeeded" in opened
    assert "No shut door answers within 1.8 m." in again
    assert StateRecord.of(simulation).deeds == ("open_door: store door",)


async def test_services_of_custom_types_are_typed_tools_where_rosapi_tells_them(
    tmp_path: Path,
) -> None:
    """ROS 2's rosapi tells the types of topics alone; ROS 1's tells those of services too."""
    async with (
        workshop(Dialect.ROS1, tmp_path) as (simulation, url),
        tools_of(url, tmp_path, "/robot_skills/*", "/battery_state") as caller,
    ):
        tools = await caller.until(lambda tools: "robot_skills_speak" in tools)
        refused = await caller.refuse("robot_skills_speak", text=["Hello"])
        await caller.ask("robot_skills_speak", text="Hello")
        await caller.ask("robot_skills_speak", text=7)
        failed = await caller.ask("robot_skills_dock", until_percent=50.0)
    properties = tools["robot_skills_speak"].input_schema["properties"]
    assert properties["text"]["type"] == "string"
    assert "text cannot be ['Hello']" in refused
    assert "No dock answers within 2.5 m." in failed
    assert StateRecord.of(simulation).deeds == ("speak: Hello", "speak: 7")


SPEAK = """skills:
- name: say
  service: /robot_skills/speak
  definition: |
    string text
    ---
    bool success
    string message
  arguments:
  - {name: words, sets: text, kind: text, most: 200}
"""


@both
async def test_an_owner_describes_a_type_that_the_robot_does_not(
    dialect: Dialect, tmp_path: Path
) -> None:
    path = tmp_path / "skills.yaml"
    path.write_text(SPEAK)
    async with (
        workshop(dialect, tmp_path) as (simulation, url),
        open_client(RobotAddress(url=url), patience=QUICK) as client,
        watched(
            FakeRobot(two_rooms()), client, tmp_path, expose=(), skills=load_skills(path)
        ) as caller,
    ):
        for words in ("Hello", "Once more"):
            assert "succeeded" in await caller.ask("say", words=words)
    assert StateRecord.of(simulation).deeds == ("speak: Hello", "speak: Once more")
