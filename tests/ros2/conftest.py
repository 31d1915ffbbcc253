"""The robot and its clients; nothing here needs ROS before a test asks for it."""

import importlib
import os
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest

from mapspeak.geometry import Pose
from ros2.robot_process import RobotProcess, open_robot_process, ros_environment
from ros2.rosbridge_process import open_rosbridge

# Two rooms of 5 m by 4 m with a door between them; the drawing's cells have 0.5 m.
TWO_ROOMS = """
#######################
#.........#...........#
#.........#...........#
#.........#...........#
#.....................#
#.........#...........#
#.........#...........#
#.........#...........#
#######################
"""
START = Pose(1.0, 2.25)


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Puts this process, and what it starts, into a ROS domain that nobody else uses."""
    import_what_warns()
    environment = ros_environment()
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    return environment


@pytest.fixture
def robot(domain: dict[str, str], request: pytest.FixtureRequest) -> Iterator[RobotProcess]:
    """A robot in the left of two rooms, as a process of its own, in the domain of this one.

    A test that is parametrized with it, indirectly, gives more options of its program.
    """
    with open_robot_process(
        TWO_ROOMS,
        pose=START,
        speed_mps=2.0,
        environment=domain,
        options=getattr(request, "param", ()),
    ) as process:
        yield process


def import_what_warns() -> None:
    """Imports what rclpy imports late, whose parser uses what Python deprecates."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        importlib.import_module("rosidl_generator_py")


@pytest.fixture
def rosbridge_url(robot: RobotProcess, domain: dict[str, str]) -> Iterator[str]:
    """The address of a real rosbridge_server, with rosapi, in the domain of the robot."""
    source = os.environ.get("MAPSPEAK_ROSBRIDGE_SOURCE")
    if not source:
        pytest.skip("not run: MAPSPEAK_ROSBRIDGE_SOURCE names no folder with rosbridge_suite")
    assert robot.process.poll() is None
    with open_rosbridge(Path(source), domain) as url:
        yield url
