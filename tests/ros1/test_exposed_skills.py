"""Topics, a service and an action of real ROS 1 nodes as typed tools, and missions of them."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from exposing import Watched, watched
from fakes import FakeRobot, two_rooms
from mapspeak.links.rosbridge import RobotAddress, open_client
from ros2.robot_process import RobotProcess

pytestmark = [pytest.mark.ros1, pytest.mark.anyio]
SERVICE = "rosapi_service_type"
EXPOSED = ("/cmd_vel", "/scan", "/move_base", "/rosapi/service_type")
TOOLS = {"publish_cmd_vel", "read_scan", "move_base", SERVICE}
GOAL = {
    "target_pose_header_frame_id": "map",
    "target_pose_pose_position_y": 1.4,
    "target_pose_pose_orientation_w": 1.0,
}
TREE = """
- rosapi_service_type: /rosapi/get_time
  as: found
- fallback:
  - timeout_s: 1
    do:
    - move_base: {target_pose_header_frame_id: map, target_pose_pose_position_x: 6}
  - retry: 2
    do:
    - check: {value: "{found.type}", is: rosapi/GetTime}
- read_scan:
  as: scan
- check: {value: "{scan.range_max}", above: "{least}"}
"""


@asynccontextmanager
async def exposed(rosbridge_url: str, folder: Path) -> AsyncGenerator[Watched]:
    async with (
        open_client(RobotAddress(url=rosbridge_url)) as client,
        watched(FakeRobot(two_rooms()), client, folder, expose=EXPOSED) as caller,
    ):
        await caller.until(lambda tools: tools.keys() >= TOOLS)
        yield caller


async def test_services_topics_and_actions_of_nodes_are_typed_tools(
    robot: RobotProcess, rosbridge_url: str, tmp_path: Path
) -> None:
    async with exposed(rosbridge_url, tmp_path) as caller:
        tools = await caller.tools()
        bad = await caller.refuse(SERVICE, service=["/rosapi/get_time"])
        found = await caller.ask(SERVICE, service="/rosapi/get_time")
        scan = await caller.ask("read_scan")
        await caller.ask("publish_cmd_vel", linear_x=0.2, for_s=1.0)
        driven = await caller.ask("move_base", **GOAL, target_pose_pose_position_x=3.0, wait_s=25)
    twist = tools["publish_cmd_vel"].input_schema["properties"]
    assert twist["linear_x"] == {"type": "number", "description": "m/s"}
    assert "service cannot be" in bad
    assert "rosapi/GetTime" in found
    assert "angle_increment" in scan
    assert (0.2, 0.0) in robot.velocities
    assert "succeeded" in driven


async def test_a_mission_of_what_nodes_offer_is_cut_off_tried_again_saved_and_cancelled(
    robot: RobotProcess, rosbridge_url: str, tmp_path: Path
) -> None:
    async with exposed(rosbridge_url, tmp_path) as caller:
        await caller.ask("save_mission", name="visit", tree=TREE, parameters={"least": None})
        told = await caller.ask("run_mission", name="visit", values={"least": "1"}, wait_s=25)
        begun = await caller.ask("move_base", **GOAL, target_pose_pose_position_x=6.0, wait_s=2)
        ended = await caller.ask("cancel_skill", run="S2")
        assert not robot.is_driving
    assert "move_base: cut off" in told
    assert "succeeded after" in told
    assert "running" in begun
    assert "cancelled" in ended
