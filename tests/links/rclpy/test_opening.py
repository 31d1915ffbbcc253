"""Without rclpy, the link says how to get it."""

import pytest

from mapspeak.cli.shared.robots import RobotChoice, open_robot
from mapspeak.errors import ConfigError
from mapspeak.links.rclpy import open_ros2_robot

pytestmark = pytest.mark.anyio


async def test_a_python_without_rclpy_is_told_where_one_is() -> None:
    with pytest.raises(ConfigError, match="no rclpy") as raised:
        async with open_ros2_robot():
            pass
    assert "source /opt/ros" in raised.value.hint
    assert "3.12" in raised.value.hint


@pytest.mark.parametrize("robot", ["ros2:999", "ros2:-1", "ros2:kitchen", "ros2:²"])
async def test_what_is_no_domain_is_refused(robot: str) -> None:
    with pytest.raises(ConfigError, match="is no ROS domain"):
        async with open_robot(RobotChoice(robot=robot)):
            pass


async def test_the_simulators_options_are_not_for_it() -> None:
    with pytest.raises(ConfigError, match="simulated robot"):
        async with open_robot(RobotChoice(robot="ros2", has_detector=True)):
            pass
