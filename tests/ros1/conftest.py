"""A robot on real ROS 1 behind the real rosbridge; nothing here needs ROS before a test asks."""

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import SimpleQueue

import pytest

from ros2.robot_process import RobotProcess, end, read_line
from ros2.rosbridge_process import find_free_port, pass_lines, wait_for_line

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
        lines: SimpleQueue[str | None] = SimpleQueue()
        reader = threading.Thread(target=pass_lines, args=(process, lines), daemon=True)
        reader.start()
        wait_for_line(lines, "server started at")
        yield environment
        process.terminate()
        reader.join()


@pytest.fixture
def robot(ros1: dict[str, str]) -> Iterator[RobotProcess]:
    """A robot whose navigation is a real action server, as a process of its own."""
    with running([sys.executable, "-m", "ros1.robot_node"], ros1) as process:
        if (line := read_line(process)) != "ready\n":
            raise AssertionError(line)
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
        if process.stdin is not None:
            process.stdin.close()
