"""The real rosbridge_server and rosapi beside the robot, from a folder with their sources."""

import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from queue import Empty, SimpleQueue

from ros2.robot_process import PATIENCE_S

STAND_INS = Path(__file__).parent / "stand_ins"
STARTED = "server started on port"


@contextmanager
def open_rosbridge(source: Path, environment: dict[str, str]) -> Iterator[str]:
    """Starts both, waits until they know the robot, gives the URL, and ends them.

    Args:
        source: A checkout of rosbridge_suite, release 2.1.0.
        environment: Of the robot's ROS domain.
    """
    with start_rosbridge(source, environment) as url:
        wait_for_rosapi()
        yield url


@contextmanager
def start_rosbridge(source: Path, environment: dict[str, str]) -> Iterator[str]:
    """Starts both, waits until clients may come, gives the URL, and ends them."""
    modules = [
        source / name / "src" for name in ("rosbridge_library", "rosbridge_server", "rosapi")
    ]
    environment |= {"PYTHONPATH": ":".join(map(str, [STAND_INS, *modules]))}
    port = find_free_port()
    websocket = source / "rosbridge_server" / "scripts" / "rosbridge_websocket.py"
    rosapi = source / "rosapi" / "scripts" / "rosapi_node"
    parameters = ("--ros-args", "-p", f"port:={port}", "-p", "address:=127.0.0.1")
    with ExitStack() as running:
        running.enter_context(open_program([str(rosapi)], environment))
        lines = running.enter_context(open_program([str(websocket), *parameters], environment))
        wait_for_line(lines, STARTED)
        yield f"ws://127.0.0.1:{port}"


@contextmanager
def open_program(
    arguments: list[str], environment: dict[str, str]
) -> Iterator["SimpleQueue[str | None]"]:
    """Runs a Python program; gives the lines it says as they come, and None where they end."""
    process = subprocess.Popen(  # noqa: S603 - sources the developer named
        [sys.executable, *arguments],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    lines: SimpleQueue[str | None] = SimpleQueue()
    reader = threading.Thread(target=pass_lines, args=(process, lines))
    reader.start()
    try:
        yield lines
    finally:
        process.kill()
        process.wait()
        reader.join()


def pass_lines(process: "subprocess.Popen[str]", lines: "SimpleQueue[str | None]") -> None:
    if process.stdout is not None:
        with process.stdout:
            for line in process.stdout:
                lines.put(line)
    lines.put(None)


def wait_for_line(lines: "SimpleQueue[str | None]", part: str) -> None:
    said: list[str] = []
    while not said or part not in said[-1]:
        try:
            line = lines.get(timeout=PATIENCE_S)
        except Empty:
            line = None
        if line is None:
            raise AssertionError(f"no {part!r} in:\n{''.join(said)}")
        said.append(line)


def wait_for_rosapi() -> None:
    """Waits until rosapi answers and has seen the robot, as on a robot that has run for a while."""
    from rosapi_msgs.srv import (  # noqa: PLC0415 - built only where it is asked for
        GetActionServers,
        Topics,
    )

    from ros2.ros_client import open_ros_client  # noqa: PLC0415 - needs rclpy

    with open_ros_client() as client:

        def sees_robot() -> bool:
            actions = client.call(
                GetActionServers, "/rosapi/action_servers", GetActionServers.Request()
            ).action_servers
            topics = client.call(Topics, "/rosapi/topics", Topics.Request()).topics
            return "/navigate_to_pose" in actions and {"/map", "/tf", "/odom"} <= set(topics)

        ask_until(sees_robot)


def ask_until(condition: Callable[[], bool]) -> None:
    """Asks again and again, each time a question over ROS and its answer, until it is so."""
    deadline_s = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > deadline_s:
            raise TimeoutError(f"not so within {PATIENCE_S} s")


def find_free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
