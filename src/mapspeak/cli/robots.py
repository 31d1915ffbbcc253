"""The robot that a command is about: simulated, or behind a rosbridge."""

import os
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mapspeak.cli.options import DEFAULT_WORLD
from mapspeak.errors import ConfigError

if TYPE_CHECKING:
    from mapspeak.robot import Robot
    from mapspeak.ros import RosConnection

__all__ = ["RobotChoice", "find_connection", "open_robot"]

ROBOT_TOKEN_VARIABLE = "MAPSPEAK_ROBOT_TOKEN"  # noqa: S105 - the variable's name, not a token
ROSBRIDGE_SCHEMES = ("ws://", "wss://")


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotChoice:
    """Which robot, and how to reach it.

    Attributes:
        robot: "sim", "sim:WORLD", or a rosbridge's address.
        robot_file: What is said of it in robot.yaml.
        ca_file: For wss.
        seed: Of the simulated robot's noise.
        clock: Of the simulated robot: real or virtual.
        has_detector: The simulated robot has one.
        state_log: Where the simulator's truth goes.
    """

    robot: str
    robot_file: Path | None = None
    ca_file: Path | None = None
    seed: int = 0
    clock: str = "real"
    has_detector: bool = False
    state_log: Path | None = None


@asynccontextmanager
async def open_robot(choice: RobotChoice) -> AsyncGenerator["Robot"]:
    """Offers the chosen robot while the context lasts.

    Raises:
        ConfigError: There is no such link, or something was asked of it that it has not.
        LinkError: The robot cannot be reached.
    """
    kind, _, world = choice.robot.partition(":")
    if choice.robot.startswith(ROSBRIDGE_SCHEMES):
        opened = _open_rosbridge(choice)
    elif kind == "sim":
        opened = _open_simulated(choice, world or DEFAULT_WORLD)
    else:
        raise ConfigError(
            f"There is no link for the robot {choice.robot!r}.",
            hint="Use sim, sim:WORLD, sim:PATH to a world file, or ws://HOST:9090 for a rosbridge.",
        )
    async with opened as robot:
        yield robot


@asynccontextmanager
async def _open_rosbridge(choice: RobotChoice) -> AsyncGenerator["Robot"]:
    from mapspeak.links.ros import RobotOverrides, load_robot_file  # noqa: PLC0415 - heavy
    from mapspeak.links.rosbridge import RobotAddress, open_rosbridge_robot  # noqa: PLC0415

    if choice.clock == "virtual" or choice.has_detector or choice.state_log is not None:
        raise ConfigError(
            "--clock virtual, --detector and --state-log are for the simulated robot.",
            hint="Leave them away, or use --robot sim.",
        )
    token = os.environ.get(ROBOT_TOKEN_VARIABLE)
    address = RobotAddress(
        url=choice.robot,
        headers={"Authorization": f"Bearer {token}"} if token else {},
        ca_file=choice.ca_file,
    )
    overrides = load_robot_file(choice.robot_file) if choice.robot_file else RobotOverrides()
    async with open_rosbridge_robot(address, overrides=overrides) as robot:
        yield robot


@asynccontextmanager
async def _open_simulated(choice: RobotChoice, world: str) -> AsyncGenerator["Robot"]:
    from mapspeak.links.simulated import Clock, open_simulated_robot  # noqa: PLC0415
    from mapspeak.simulator import Simulation, StateLog, load_world  # noqa: PLC0415

    if choice.robot_file is not None or choice.ca_file is not None:
        raise ConfigError(
            "--robot-file and --ca-file are for a robot behind a rosbridge.",
            hint="Leave them away, or name the robot with --robot ws://HOST:9090.",
        )
    simulation = Simulation(load_world(world), seed=choice.seed)
    log = StateLog(simulation, choice.state_log) if choice.state_log else None
    try:
        async with open_simulated_robot(
            simulation,
            clock=Clock(choice.clock),
            has_detector=choice.has_detector,
            after_step=log.note if log else None,
        ) as robot:
            yield robot
    finally:
        if log is not None:
            log.close()


def find_connection(robot: "Robot", choice: RobotChoice) -> "RosConnection | None":
    """Gives the connection of a robot that speaks ROS; None for the simulated one."""
    if choice.robot.partition(":")[0] == "sim":
        return None
    from mapspeak.links.ros import RosRobot  # noqa: PLC0415 - heavy

    return robot.connection if isinstance(robot, RosRobot) else None
