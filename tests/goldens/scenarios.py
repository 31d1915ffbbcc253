"""Each thing that is played: a robot, its limits, and what is asked of it."""

import sys
import tempfile
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import anyio

from fakes import FakeRobot
from goldens.rosside import inspect, ros_robot
from goldens.tour import tour
from goldens.transcript import playing
from guarding import rectangle
from mapspeak.geometry import Pose
from mapspeak.links.simulated import SoloRobot
from mapspeak.ros.messages.fields import Dialect
from mapspeak.safety import Policy
from mapspeak.simulator import Simulation, load_world, world_names
from mapspeak.spatial.mapfiles import load_map

MAPS = Path(__file__).parents[1] / "maps"
REAL_MAPS = {
    "aws_small_house": ("aws_small_house/map.yaml", Pose(0.0, 0.0, 0.0)),
    "freiburg79": ("freiburg79/whole.yaml", Pose(10.0, 10.0, 0.0)),
    "freiburg79_half": ("freiburg79/half.yaml", Pose(10.0, 10.0, 0.0)),
}
GUARDED = "flat_1"
"""Its robot has an area to keep out of, so that the audit log has refusals."""
FAST = ("flat_1", "help", "ros1", "ros2")
"""What the gate plays."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """One transcript.

    Attributes:
        name: Its file is called so.
        play: Play it with files in a folder; return the transcript.
    """

    name: str
    play: Callable[[Path], Awaitable[str]]


def scenarios() -> dict[str, Scenario]:
    """Return all of them by name."""
    plays: dict[str, Callable[[Path], Awaitable[str]]] = {
        **{name: partial(_play_world, name) for name in world_names()},
        **{name: partial(_play_map, *where) for name, where in REAL_MAPS.items()},
        "help": _play_help,
        "ros1": partial(_play_ros, Dialect.ROS1),
        "ros2": partial(_play_ros, Dialect.ROS2),
    }
    return {name: Scenario(name, play) for name, play in plays.items()}


async def record(scenario: Scenario) -> str:
    """Play a scenario in a new folder; what names that folder is left out."""
    with tempfile.TemporaryDirectory() as folder:
        return (await scenario.play(Path(folder))).replace(folder, "FOLDER")


async def _play_world(world: str, folder: Path) -> str:
    simulation = Simulation(load_world(world), seed=7)
    policy = Policy()
    if world == GUARDED:
        policy = Policy(areas=(rectangle("pen", (1.0, 1.0), (2.0, 2.0)),))
    async with playing(SoloRobot(simulation, has_detector=True), folder, policy=policy) as play:
        await tour(play)
    return play.text


async def _play_map(path: str, start: Pose, folder: Path) -> str:
    robot = FakeRobot(load_map(MAPS / path).grid, pose=start)
    async with playing(robot, folder) as play:
        await tour(play, explores=False)
    return play.text


async def _play_ros(dialect: Dialect, folder: Path) -> str:
    async with ros_robot(dialect, folder) as play:
        await inspect(play)
    return play.text


async def _play_help(folder: Path) -> str:
    """Return what every command says of itself."""
    del folder
    said = await anyio.run_process([sys.executable, "-m", "goldens.helptexts"], cwd=MAPS.parent)
    return said.stdout.decode()
