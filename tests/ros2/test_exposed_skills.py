"""Topics, services and actions of real ROS 2 nodes as typed tools, over rclpy and over DDS."""

from collections.abc import AsyncGenerator
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path

import pytest

from exposing import Watched, watched
from fakes import FakeRobot, two_rooms
from mapspeak.cli.shared.robots import read_network
from mapspeak.ros.port import RosConnection
from mapspeak.skills.skillsfile import load_skills
from ros2.robot_process import RobotProcess

pytestmark = [pytest.mark.ros2, pytest.mark.anyio]
RCLPY, DDS = "rclpy", "dds"
links = pytest.mark.parametrize("link", [RCLPY, DDS])
EXPOSED = ("/cmd_vel", "/odom", "/switch_motors", "/spin", "/navigate_to_pose")
OWNERS = """skills:
- name: motors_off
  sentence: Switches the motors off
  service: /switch_motors
  fixed: {data: false}
  succeeded_when: {field: message, is: The motors are off.}
"""


@asynccontextmanager
async def exposed(link: str, robot: RobotProcess, folder: Path) -> AsyncGenerator[Watched]:
    """Give a client of a server that exposes what a robot of real nodes offers."""
    path = folder / "skills.yaml"
    path.write_text(OWNERS)
    opened: AbstractAsyncContextManager[RosConnection]
    if link == DDS:
        pytest.importorskip("cyclonedds", reason="has no wheel for this Python")
        from mapspeak.links.dds import open_dds_connection  # noqa: PLC0415 - optional

        opened = open_dds_connection(read_network("", robot.environment))
    else:
        from mapspeak.links.rclpy import open_ros2_connection  # noqa: PLC0415 - needs rclpy

        opened = open_ros2_connection()
    async with (
        opened as connection,
        watched(
            FakeRobot(two_rooms()), connection, folder, expose=EXPOSED, skills=load_skills(path)
        ) as caller,
    ):
        yield caller


@links
async def test_services_topics_and_actions_of_nodes_are_typed_tools(
    link: str, robot: RobotProcess, tmp_path: Path
) -> None:
    wanted = {"switch_motors", "publish_cmd_vel", "read_odom", "spin", "navigate_to_pose"}
    async with exposed(link, robot, tmp_path) as caller:
        tools = await caller.until(lambda tools: wanted <= tools.keys())
        fields = {name: tools[name].input_schema["properties"] for name in wanted - {"read_odom"}}
        bad = await caller.refuse("switch_motors", data="yes")
        switched = await caller.ask("switch_motors", data=True)
        odometry = await caller.ask("read_odom")
        await caller.ask("publish_cmd_vel", linear_x=0.2, for_s=0.5)
        assert (0.2, 0.0) in robot.velocities
        spun = await caller.ask("spin", target_yaw=0.5, wait_s=20)
        goal = {"pose_header_frame_id": "map", "pose_pose_position_x": 2.0}
        driven = await caller.ask(
            "navigate_to_pose",
            **goal,
            pose_pose_position_y=2.25,
            pose_pose_orientation_w=1.0,
            wait_s=20,
        )
    assert fields["switch_motors"]["data"]["type"] == "boolean"
    assert fields["publish_cmd_vel"]["linear_x"] == {"type": "number", "description": "m/s"}
    assert fields["spin"]["time_allowance_sec"]["description"] == "s"
    assert fields["navigate_to_pose"]["pose_pose_position_x"]["description"] == "m"
    assert "data cannot be 'yes'" in bad
    assert "The motors are on." in switched
    assert "pose_pose_position_x" in odometry
    assert "succeeded" in spun
    assert "succeeded" in driven


@links
async def test_a_mission_uses_what_nodes_offer_and_what_the_owner_says_of_it(
    link: str, robot: RobotProcess, tmp_path: Path
) -> None:
    tree = """
- motors_off
- retry: 2
  do: {switch_motors: true, as: motors}
- fallback:
  - check: {value: "{motors.message}", is: The motors are on.}
  - note: no power
"""
    visit = """
- fallback:
  - timeout_s: 0.5
    do:
    - navigate_to_pose: {pose_header_frame_id: map, pose_pose_position_x: "{x}"}
  - switch_motors: true
"""
    offered = {"switch_motors", "navigate_to_pose", "spin"}
    async with exposed(link, robot, tmp_path) as caller:
        await caller.until(lambda tools: offered <= tools.keys())
        told = await caller.ask("run_mission", tree=tree, wait_s=20)
        await caller.ask("save_mission", name="visit", tree=visit, parameters={"x": None})
        late = await caller.ask("run_mission", name="visit", values={"x": "8"}, wait_s=20)
        begun = await caller.ask("run_mission", tree="- spin: {target_yaw: 60}\n", wait_s=0)
        ended = await caller.ask("cancel_skill", run="S3")
        assert not robot.is_driving
    assert "succeeded after" in told
    assert "no power" not in told
    assert "navigate_to_pose: cut off" in late
    assert "succeeded after" in late
    assert "running" in begun
    assert "cancelled" in ended
