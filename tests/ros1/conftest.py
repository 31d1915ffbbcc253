"""A robot on real ROS 1 behind the real rosbridge; nothing here needs ROS before a test asks."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from ros2.robot_process import RobotProcess, end, read_line
from ros2.rosbridge_process import find_free_port

TESTS = Path(__file__).parents[1]


@pytest.fixture(scope="session")
def ros1() -> Iterator[dict[str, str]]:
    """Starts a master, the real rosbridge and rosapi; gives what names them."""
    master, bridge = find_free_port(), find_free_port()
    packages = os.environ["MAPSPEAK_ROS1_PYTHONPATH"]
    environment = os.environ | {
        "ROS_MASTER_URI": f"http://127.0.0.1:{master}",
        "ROS_IP": "127.0.0.1",
        "ROSBRIDGE_URL": f"ws://127.0.0.1:{bridge}",
    }
    launch = ("--port", str(master), "rosbridge_server", "rosbridge_websocket.launch")
    with running(
        ["roslaunch", *launch, f"port:={bridge}", "address:=127.0.0.1"],
        environment | {"PYTHONPATH": packages},
    ) as process:
        wait_for(process, "server started at")
        yield environment


@pytest.fixture
def robot(ros1: dict[str, str]) -> Iterator[RobotProcess]:
    """A robot whose navigation is a real action server, as a process of its own."""
    with running([sys.executable, "-m", "ros1.robot_node"], ros1) as process:
        wait_for(process, "ready")
        robot = RobotProcess(process=process, environment=ros1)
        yield robot
        end(process)


@pytest.fixture
def rosbridge_url(robot: RobotProcess) -> str:
    """The address of the rosbridge, behind which the robot is by now."""
    return robot.environment["ROSBRIDGE_URL"]


@contextmanager
def running(arguments: list[str], environment: dict[str, str]) -> "Iterator[subprocess.Popen[str]]":
    process = subprocess.Popen(  # noqa: S603 - our own program, and roslaunch
        arguments,
        cwd=TESTS,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.terminate()
        process.wait(30.0)
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                stream.close()


def wait_for(process: "subprocess.Popen[str]", part: str) -> None:
    said: list[str] = []
    while not said or part not in said[-1]:
        said.append(read_line(process))
        if not said[-1]:
            raise AssertionError(f"no {part!r} in:\n{''.join(said)}")
