"""Markers reach a node of real ROS 2, latched, so that RViz may come late."""

from contextlib import AbstractAsyncContextManager
from pathlib import Path

import anyio
import pytest

from mapspeak.cli.shared.robots import read_network
from mapspeak.links.rclpy import open_ros2_connection, open_ros2_robot
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.robot import RosRobot
from mapspeak.server.view.marking import MarkerPublisher
from mapspeak.session import Session
from ros2.robot_process import RobotProcess

pytestmark = [pytest.mark.ros2, pytest.mark.anyio]

PATIENCE_S = 60.0


def open_link(name: str, robot: RobotProcess) -> AbstractAsyncContextManager[RosRobot]:
    if name == "rclpy":
        return open_ros2_robot()
    pytest.importorskip("cyclonedds", reason="has no wheel for this Python")
    from mapspeak.links.dds import open_dds_robot  # noqa: PLC0415 - optional

    return open_dds_robot(read_network("", robot.environment))


@pytest.mark.parametrize("name", ["rclpy", "dds"])
async def test_a_late_subscriber_gets_the_markers_and_then_what_changes(
    robot: RobotProcess, tmp_path: Path, name: str
) -> None:
    with anyio.fail_after(PATIENCE_S):
        async with open_link(name, robot) as link, open_ros2_connection() as late:
            store = SemanticMapStore(tmp_path / "m.yaml")
            session = Session(link, store, lease_s=60.0, find_model=lambda: None)
            publisher = MarkerPublisher(session, link.connection)
            await publisher.look()
            markers = late.subscribe("/mapspeak/markers")
            first = (await markers.wait_for_more_than(0, timeout_s=PATIENCE_S))["markers"]
            robot.change_map("######\n#....#\n#....#\n######")
            while (await link.fetch_map()).n_cols != 6:  # noqa: ASYNC110 - another program sends it
                await anyio.sleep(0.05)
            await publisher.look()
            changed = (await markers.wait_for_more_than(1, timeout_s=PATIENCE_S))["markers"]
    # The first of each message deletes what was drawn before.
    assert [each["action"] for each in (first[0], changed[0])] == [3, 3]
    assert {each["ns"] for each in first} >= {"rooms", "rooms names", "doors", "doors names"}
    assert [each["text"] for each in first if each["ns"] == "doors names"] == ["D1"]
    assert not [each for each in changed if each["ns"] == "doors"]
