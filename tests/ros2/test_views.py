"""What people do by habit in RViz and on the command line, on real nodes, over rclpy and DDS."""

from collections.abc import AsyncGenerator
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path
from typing import Any

import anyio
import pytest

from exposing import Watched, watched
from mapspeak.cli.shared.robots import read_network
from mapspeak.ros.robot import RosRobot
from mapspeak.skills.skillsfile import load_skills
from ros2.robot_process import RobotProcess
from ros2.test_exposed_skills import DDS, links

pytestmark = [
    pytest.mark.ros2,
    pytest.mark.anyio,
    pytest.mark.parametrize(
        "robot", [["--also", "rear_camera", "plans", "waypoints"]], indirect=True, ids=[""]
    ),
]
PATIENCE_S = 60.0


@asynccontextmanager
async def opened(link: str, robot: RobotProcess, folder: Path) -> AsyncGenerator[Watched]:
    """Gives a client of a server with the ready-made skills of Nav2 over a robot of real nodes."""
    linked: AbstractAsyncContextManager[RosRobot]
    if link == DDS:
        pytest.importorskip("cyclonedds", reason="has no wheel for this Python")
        from mapspeak.links.dds import open_dds_robot  # noqa: PLC0415 - optional

        linked = open_dds_robot(read_network("", robot.environment))
    else:
        from mapspeak.links.rclpy import open_ros2_robot  # noqa: PLC0415 - needs rclpy

        linked = open_ros2_robot()
    async with (
        linked as ros_robot,
        watched(
            ros_robot,
            ros_robot.connection,
            folder,
            expose=(),
            skills=load_skills(Path("nav2")),
            toolsets=("look", "drive", "ros", "missions"),
        ) as caller,
    ):
        yield caller


async def until_told(caller: Watched, wanted: str, tool: str, **arguments: Any) -> str:  # noqa: ANN401
    """Asks until an answer tells something: nodes do not find each other at once."""
    with anyio.fail_after(PATIENCE_S):
        while wanted not in (told := await caller.ask(tool, **arguments)):  # noqa: ASYNC110 - in other programs
            await anyio.sleep(0.2)
    return told


@links
async def test_plans_cameras_quality_and_ages_of_real_nodes_are_told(
    link: str, robot: RobotProcess, tmp_path: Path
) -> None:
    asked = {"layers": ["navigation"], "full": True}
    async with opened(link, robot, tmp_path) as caller:
        told = await until_told(caller, "planned path 2.0 m long", "look_at_map", **asked)
        behind = await until_told(
            caller, "rear_camera", "look_through_camera", camera="rear_camera"
        )
        quality = await until_told(caller, "transient local", "ros_topic", topic="/map")
        age = await until_told(
            caller, "oldest: ", "ros_frames", duration_s=1.0, frame="rear_camera_optical"
        )
    assert "ends at x 3.00, y 2.25" in told
    assert "no global costmap" in told
    assert "yaw 180 deg" in behind or "yaw -180 deg" in behind
    assert "reliable" in quality
    assert "way: map > odom > base_footprint > base_link > rear_camera_optical" in age


@links
async def test_nav2_itself_drives_to_waypoints(
    link: str, robot: RobotProcess, tmp_path: Path
) -> None:
    poses = [
        {"header": {"frame_id": "map"}, "pose": {"position": {"x": x, "y": 2.25}}}
        for x in (2.0, 4.0)
    ]
    async with opened(link, robot, tmp_path) as caller:
        told = await caller.ask("follow_waypoints", poses=poses, wait_s=25)
    assert "succeeded" in told
    assert (robot.pose.x, robot.pose.y) == pytest.approx((4.0, 2.25), abs=0.1)
