"""The robot of the ROS 2 tests as a process of its own, alone in its ROS domain."""

import json
import os
import random
import select
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mapspeak.geometry import Pose

TESTS = Path(__file__).parents[1]
PATIENCE_S = 30.0
# Of 0 to 232 those whose ports no outgoing connection of Linux takes.
DOMAINS = range(1, 102)


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotProcess:
    """A running robot, and what a test can ask of it beside ROS.

    Attributes:
        process: Answers each line with a line.
        environment: What a program needs to be in the same ROS domain.
    """

    process: "subprocess.Popen[str]"
    environment: dict[str, str] = field(repr=False)

    def change_map(self, text: str) -> None:
        self._command(do="change_map", text=text)

    def update_map(self, text: str, *, row: int, col: int) -> None:
        """Changes the rectangle of the map whose lowest row and first column are given."""
        self._command(do="update_map", text=text, row=row, col=col)

    def set_recoveries(self, n: int) -> None:
        """Sets the number of recoveries that feedback tells."""
        self._command(do="set_recoveries", n=n)

    def set_faults(self, **faults: Any) -> None:  # noqa: ANN401
        """Changes what is wrong with the robot, by the names of `Faults`; silent is a list."""
        self._command(do="set_faults", **faults)

    def appear(self, part: str) -> None:
        """Starts a part that was to come later."""
        self._command(do="appear", part=part)

    def kill_navigation(self) -> None:
        """Lets navigation hang as a killed process does; the wheels keep what they were told."""
        self._command(do="kill_navigation")

    def restart_navigation(self) -> None:
        self._command(do="restart_navigation")

    def tell(self) -> dict[str, Any]:
        """Gives all that the robot knows of itself: driven_m, n_goals, n_cancels and more."""
        return self._command(do="tell")

    @property
    def driven_m(self) -> float:
        """How far it has truly driven."""
        return float(self.tell()["driven_m"])

    @property
    def pose(self) -> Pose:
        """Where the robot truly is, in the map frame."""
        return Pose(*self.tell()["pose"])

    @property
    def is_driving(self) -> bool:
        return bool(self.tell()["is_driving"])

    @property
    def velocities(self) -> list[tuple[float, float]]:
        """What came on /cmd_vel so far: forwards in m/s, turning in rad/s."""
        return [(forward, turn) for forward, turn in self.tell()["velocities"]]

    def _command(self, **command: Any) -> dict[str, Any]:  # noqa: ANN401
        if self.process.stdin is None:
            raise AssertionError
        self.process.stdin.write(json.dumps(command) + "\n")
        self.process.stdin.flush()
        reply: dict[str, Any] = json.loads(read_line(self.process))
        return reply


@contextmanager
def open_robot_process(
    map_text: str | Path,
    *,
    pose: Pose,
    resolution_m: float = 0.5,
    speed_mps: float = 1.0,
    environment: dict[str, str] | None = None,
    options: Sequence[str] = (),
) -> Iterator[RobotProcess]:
    """Starts a robot, waits until it is ready, and ends it.

    Args:
        map_text: A map drawn as text, or the path of a map_server .yaml file.
        pose: Where the robot starts, in the map frame.
        resolution_m: The side of a cell of the drawing.
        speed_mps: How fast it drives to goals.
        environment: Of the ROS domain; a free one when it is not given.
        options: More of the program's, such as --namespace or --later.
    """
    environment = environment or ros_environment()
    arguments = (
        *("--map", str(map_text), "--resolution-m", str(resolution_m)),
        *("--speed-mps", str(speed_mps), "--pose", str(pose.x), str(pose.y), str(pose.yaw_rad)),
        *options,
    )
    process = subprocess.Popen(  # noqa: S603 - our own program
        [sys.executable, "-m", "ros2.robot_node", *arguments],
        cwd=TESTS,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        if (line := read_line(process)) != "ready\n":
            raise AssertionError(line)
        yield RobotProcess(process=process, environment=environment)
    finally:
        end(process)


def ros_environment() -> dict[str, str]:
    """Gives this process's environment, in a ROS domain on this machine that nobody else uses."""
    return os.environ | {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(find_free_domain()),
        "AMENT_PREFIX_PATH": sys.prefix,
        "ROS_DISTRO": "kilted",
    }


def find_free_domain() -> int:
    """Tries domains at random for one whose first participant's port is not taken."""
    for domain in random.sample(DOMAINS, k=len(DOMAINS)):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", 7400 + 250 * domain + 10))
            except OSError:
                continue
            return domain
    raise AssertionError("every ROS domain of this machine is in use")


def read_line(process: "subprocess.Popen[str]") -> str:
    """Reads the one line that is due; there are never two, so none hides in the buffer."""
    if process.stdout is None:
        raise AssertionError
    ready, _, _ = select.select([process.stdout], [], [], PATIENCE_S)
    if not ready:
        raise TimeoutError(f"{process.args!r} said nothing for {PATIENCE_S} s")
    return process.stdout.readline()


def end(process: "subprocess.Popen[str]") -> None:
    """Lets a process end by itself, where its commands end, and ends it if it does not."""
    if process.stdin is not None and not process.stdin.closed:
        process.stdin.close()
    try:
        process.wait(PATIENCE_S / 3.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    finally:
        if process.stdout is not None:
            process.stdout.close()
