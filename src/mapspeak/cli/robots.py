"""The robot that a command is about: simulated, behind a rosbridge, or in a ROS 2 domain."""

import os
from collections.abc import AsyncGenerator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from mapspeak.cli.options import DEFAULT_WORLD
from mapspeak.errors import ConfigError
from mapspeak.geometry import Pose

if TYPE_CHECKING:
    from mapspeak.links.dds import DdsNetwork
    from mapspeak.robot import Robot
    from mapspeak.ros import RosConnection

__all__ = ["RobotChoice", "find_connection", "open_robot"]

ROBOT_TOKEN_VARIABLE = "MAPSPEAK_ROBOT_TOKEN"  # noqa: S105 - the variable's name, not a token
ROSBRIDGE_SCHEMES = ("ws://", "wss://")
LARGEST_DOMAIN = 232


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotChoice:
    """Which robot, and how to reach it.

    Attributes:
        robot: "sim", "sim:WORLD", a rosbridge's address, or "ros2" or "dds", each perhaps with a
            domain as in "dds:DOMAIN".
        robot_file: What is said of it in robot.yaml.
        ca_file: For wss.
        seed: Of the simulated robot's noise.
        clock: Of the simulated robot: real or virtual.
        has_detector: The simulated robot has one.
        state_log: Where the simulator's truth goes.
        final_map: Where the simulated robot's map goes in the end.
        known_map: A finished map in which the simulated robot finds its place.
        start: Where the simulated robot stands at first, in the world's own frame.
    """

    robot: str
    robot_file: Path | None = None
    ca_file: Path | None = None
    seed: int = 0
    clock: str = "real"
    has_detector: bool = False
    state_log: Path | None = None
    final_map: Path | None = None
    known_map: Path | None = None
    start: Pose | None = None

    @property
    def shown(self) -> str:
        """The robot as it may be shown and stored: an address without its secrets.

        Raises:
            ConfigError: The address is invalid.
        """
        if not self.robot.startswith(ROSBRIDGE_SCHEMES):
            return self.robot
        from mapspeak.links.rosbridge import RobotAddress  # noqa: PLC0415 - heavy

        return RobotAddress(url=self.robot).shown


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
    elif kind == "ros2":
        opened = _open_ros2(choice, world)
    elif kind == "dds":
        opened = _open_dds(choice, world)
    else:
        from mapspeak.links.rosbridge import quote_address  # noqa: PLC0415 - heavy

        raise ConfigError(
            f"{quote_address(choice.robot)} is not a robot: there is no link for it.",
            hint="Use sim, sim:WORLD, sim:PATH to a world file, ws://HOST:9090 for a rosbridge, or "
            "for ROS 2 without one ros2 (as a node of it) or dds (without ROS here).",
        )
    async with opened as robot:
        yield robot


@asynccontextmanager
async def _open_rosbridge(choice: RobotChoice) -> AsyncGenerator["Robot"]:
    from mapspeak.links.ros import RobotOverrides, load_robot_file  # noqa: PLC0415 - heavy
    from mapspeak.links.rosbridge import RobotAddress, open_rosbridge_robot  # noqa: PLC0415

    _refuse_simulators_options(choice)
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
async def _open_ros2(choice: RobotChoice, domain: str) -> AsyncGenerator["Robot"]:
    """Takes what is there: rclpy, else DDS without ROS."""
    if find_spec("rclpy") is None and find_spec("cyclonedds") is not None:
        async with _open_dds(choice, domain) as robot:
            yield robot
        return
    _refuse_simulators_options(choice)
    if choice.ca_file is not None:
        raise ConfigError("--ca-file is for wss://.", hint="Leave it away: DDS has no such thing.")
    if domain and not (domain.isascii() and domain.isdigit() and int(domain) <= LARGEST_DOMAIN):
        raise ConfigError(
            f"{domain[:40]!r} is no ROS domain.",
            hint=f"Use ros2, or ros2:DOMAIN with a number from 0 to {LARGEST_DOMAIN}.",
        )
    from mapspeak.links.ros import RobotOverrides, load_robot_file  # noqa: PLC0415 - heavy
    from mapspeak.links.ros2 import open_ros2_robot  # noqa: PLC0415

    overrides = load_robot_file(choice.robot_file) if choice.robot_file else RobotOverrides()
    async with open_ros2_robot(
        domain_id=int(domain) if domain else None,
        distro=os.environ.get("ROS_DISTRO", ""),
        overrides=overrides,
    ) as robot:
        yield robot


@asynccontextmanager
async def _open_dds(choice: RobotChoice, domain: str) -> AsyncGenerator["Robot"]:
    _refuse_simulators_options(choice)
    if choice.ca_file is not None:
        raise ConfigError("--ca-file is for wss://.", hint="Leave it away: DDS has no such thing.")
    if find_spec("cyclonedds") is None:
        raise ConfigError(
            "--robot dds needs a package that is not installed.",
            hint='Install it: pip install "mapspeak[dds]". It is there for Python 3.11 to 3.13.',
        )
    from mapspeak.links.dds import open_dds_robot  # noqa: PLC0415 - optional, and heavy
    from mapspeak.links.ros import RobotOverrides, load_robot_file  # noqa: PLC0415

    network = read_network(domain, os.environ)
    overrides = load_robot_file(choice.robot_file) if choice.robot_file else RobotOverrides()
    async with open_dds_robot(network, overrides=overrides) as robot:
        yield robot


def read_network(domain: str, environment: Mapping[str, str]) -> "DdsNetwork":
    """Gives where to look for a ROS 2 system, as the variables say that ROS itself heeds.

    Args:
        domain: As given with --robot; empty takes ROS_DOMAIN_ID.
        environment: The variables.

    Raises:
        ConfigError: That is no domain.
    """
    from mapspeak.links.dds import DdsNetwork  # noqa: PLC0415 - optional, and heavy

    said = domain or environment.get("ROS_DOMAIN_ID") or "0"
    if not (said.isascii() and said.isdigit() and int(said) <= LARGEST_DOMAIN):
        raise ConfigError(
            f"{said[:40]!r} is no ROS domain.",
            hint=f"Use dds, or dds:DOMAIN with a number from 0 to {LARGEST_DOMAIN}.",
        )
    peers = environment.get("ROS_STATIC_PEERS", "")
    return DdsNetwork(
        domain_id=int(said),
        is_local=environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "LOCALHOST"
        or environment.get("ROS_LOCALHOST_ONLY") == "1",
        peers=tuple(peer.strip() for peer in peers.split(";") if peer.strip()),
    )


def _refuse_simulators_options(choice: RobotChoice) -> None:
    files = (choice.state_log, choice.final_map, choice.known_map, choice.start)
    if choice.clock == "virtual" or choice.has_detector or any(each is not None for each in files):
        raise ConfigError(
            "--clock virtual, --detector, --state-log, --final-map, --map and --start are for the "
            "simulated robot.",
            hint="Leave them away, or use --robot sim.",
        )


@asynccontextmanager
async def _open_simulated(choice: RobotChoice, world: str) -> AsyncGenerator["Robot"]:
    from mapspeak.links.simulated import Clock, open_simulated_robot  # noqa: PLC0415
    from mapspeak.simulator import Simulation, StateLog, load_world  # noqa: PLC0415
    from mapspeak.spatial.mapfiles import MapMode, load_map, write_map  # noqa: PLC0415

    if choice.robot_file is not None or choice.ca_file is not None:
        raise ConfigError(
            "--robot-file and --ca-file are for a robot that speaks ROS.",
            hint="Leave them away, or name the robot with --robot ws://HOST:9090 or dds.",
        )
    simulation = Simulation(
        load_world(world),
        seed=choice.seed,
        known=load_map(choice.known_map).grid if choice.known_map else None,
        start=choice.start,
    )
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
        if choice.final_map is not None:
            write_map(simulation.map(), choice.final_map, mode=MapMode.RAW)


def find_connection(robot: "Robot", choice: RobotChoice) -> "RosConnection | None":
    """Gives the connection of a robot that speaks ROS; None for the simulated one."""
    if choice.robot.partition(":")[0] == "sim":
        return None
    from mapspeak.links.ros import RosRobot  # noqa: PLC0415 - heavy

    return robot.connection if isinstance(robot, RosRobot) else None
