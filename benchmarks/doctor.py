"""How often doctor, radius and navigation are right, over each link, beside twelve participants.

It needs rclpy: `.venv-ros2/bin/python -m benchmarks.run doctor`, once `./run test-ros2` has made
that. The robot has costmaps that tell its radius, and a second client keeps it busy. The real
rosbridge is measured where MAPSPEAK_ROSBRIDGE_SOURCE names its sources, DDS where its library is.
MAPSPEAK_SESSIONS says how many sessions there are of each kind and link.
"""

import multiprocessing
import os
import statistics
import sys
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import anyio
import click

from benchmarks.figure import Figure
from mapspeak.cli.checkup import Health, examine_choice
from mapspeak.cli.shared.robots import RobotChoice, open_robot
from mapspeak.errors import MapspeakError
from mapspeak.geometry import Pose
from mapspeak.ros.robot import RosRobot

__all__ = ["measure"]

N_SESSIONS = 60
N_PARTICIPANTS = 12
RADIUS_M = 0.35
ACTION = "/navigate_to_pose"
START = Pose(1.0, 2.25)
Wrong = str
"""What was wrong in a session; empty where all was right."""


def measure() -> Iterator[Figure]:
    """Give how many sessions were right, and how long they took."""
    if find_spec("rclpy") is None:
        click.echo("doctor: not measured, for this Python has no rclpy: see its module.", err=True)
        return
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    n_sessions = int(os.environ.get("MAPSPEAK_SESSIONS", N_SESSIONS))
    with _running_robot() as robots:
        for link, robot in robots.items():
            for kind, session in (("doctor", _check_doctor), ("first answers", _check_answers)):
                yield from _figures(
                    f"{kind} over {link}", RobotChoice(robot=robot), session, n_sessions
                )


def _figures(
    what: str,
    choice: RobotChoice,
    session: Callable[[RobotChoice], Awaitable[Wrong]],
    n_sessions: int,
) -> Iterator[Figure]:
    walls_s: list[float] = []
    n_right = 0
    for number in range(n_sessions):
        before_s = time.perf_counter()
        wrong = anyio.run(session, choice)
        walls_s.append(time.perf_counter() - before_s)
        n_right += not wrong
        if wrong:
            click.echo(f"{what}, {number}: {wrong}", err=True)
    yield Figure(name=f"{what}, right of {n_sessions}", value=n_right, unit="sessions")
    yield Figure(name=f"{what}, median", value=statistics.median(walls_s), unit="s")
    yield Figure(name=f"{what}, most", value=max(walls_s), unit="s")


async def _check_doctor(choice: RobotChoice) -> Wrong:
    try:
        findings = await examine_choice(choice)
    except MapspeakError as error:
        return error.message
    said = {each.what: each.said for each in findings}
    wrong = [f"{each.what}: {each.said}" for each in findings if each.health is not Health.FINE]
    if ACTION not in said["navigation"]:
        wrong.append(f"navigation: {said['navigation']}")
    if not said["radius"].startswith(f"{RADIUS_M:.2f}"):
        wrong.append(f"radius: {said['radius']}")
    wrong += [f"no {part}" for part in ("picture", "laser", "place") if part not in said]
    return "; ".join(wrong)


async def _check_answers(choice: RobotChoice) -> Wrong:
    """Check what a client gets that asks at once: map, pose, radius, and a drive by Nav2."""
    try:
        async with open_robot(choice) as robot:
            if not isinstance(robot, RosRobot):
                raise TypeError
            await robot.fetch_map()
            pose, radius_m = (await robot.fetch_pose()).pose, robot.description.radius_m
            await robot.send_goal(Pose(pose.x, pose.y))
            name = robot.profile.navigation_name
            await robot.stop()
    except MapspeakError as error:
        return error.message
    is_right = abs(radius_m - RADIUS_M) < 1e-6 and name == ACTION and abs(pose.y - START.y) < 1.0
    return "" if is_right else f"radius {radius_m}, navigation {name}, pose {pose}"


@contextmanager
def _running_robot() -> Iterator[dict[str, str]]:
    """Keep a robot, a busy client and perhaps rosbridge; give how to reach it over each link."""
    from ros2.conftest import TWO_ROOMS  # noqa: PLC0415 - of the tests
    from ros2.robot_process import open_robot_process, ros_environment  # noqa: PLC0415
    from ros2.rosbridge_process import open_rosbridge  # noqa: PLC0415

    environment = ros_environment()
    os.environ.update(environment)
    robots = {"rclpy": "ros2"}
    options = ("--participants", str(N_PARTICIPANTS), "--also", "costmaps", "goal_topic")
    with ExitStack() as running:
        running.enter_context(
            open_robot_process(TWO_ROOMS, pose=START, environment=environment, options=options)
        )
        running.enter_context(_busy_client())
        if find_spec("cyclonedds") is not None:
            robots["DDS"] = "dds"
        source = os.environ.get("MAPSPEAK_ROSBRIDGE_SOURCE")
        if source:
            robots["rosbridge"] = running.enter_context(open_rosbridge(Path(source), environment))
        yield robots


@contextmanager
def _busy_client() -> Iterator[None]:
    processes = multiprocessing.get_context("spawn")
    is_over = processes.Event()
    client = processes.Process(target=_be_busy, args=(is_over,))
    client.start()
    try:
        yield
    finally:
        is_over.set()
        client.join()


def _be_busy(is_over: Any) -> None:  # noqa: ANN401
    """Read a picture and a scan, and look at the whole graph, again and again."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from sensor_msgs.msg import Image, LaserScan  # noqa: PLC0415

    from ros2.ros_client import open_ros_client  # noqa: PLC0415 - needs rclpy

    with open_ros_client() as client:
        while not is_over.is_set():
            client.wait_for_message(Image, "/camera/image_raw")
            client.wait_for_message(LaserScan, "/scan")
            client.node.get_topic_names_and_types()
