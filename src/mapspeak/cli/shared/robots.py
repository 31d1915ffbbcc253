"""The robots that a command is about: simulated, behind a rosbridge, or in a ROS 2 domain."""

import os
import re
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, ExitStack, asynccontextmanager, closing
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import anyio

from mapspeak.cli.shared.options import DEFAULT_WORLD, is_database, usual_modes
from mapspeak.errors import ConfigError
from mapspeak.geometry import Pose
from mapspeak.installation import say_install

if TYPE_CHECKING:
    from mapspeak.links.dds import DdsNetwork
    from mapspeak.links.simulated import SimulatedRobot
    from mapspeak.robot import Robot
    from mapspeak.ros.discovery.overrides import RobotOverrides
    from mapspeak.ros.port import RosConnection
    from mapspeak.ros.robot import RosRobot
    from mapspeak.skill import SkilledRobot

    OpenLink = Callable[[], AbstractAsyncContextManager[RosRobot]]

NAME = re.compile(r"(?P<name>[A-Za-z][A-Za-z0-9_-]{0,39})=(?P<rest>.+)", re.DOTALL)
ONLY = ""
"""The name of a robot that has none, because it is the only one."""


def name_robots(given: Sequence[str]) -> dict[str, str]:
    """Return the address of each robot by its name; a single one needs no name.

    Raises:
        ConfigError: Several robots, of which not each has a name of its own.
    """
    if len(given) == 1 and NAME.fullmatch(given[0]) is None:
        return {ONLY: given[0]}
    named: dict[str, str] = {}
    for each in given:
        match = NAME.fullmatch(each)
        if match is None:
            from mapspeak.links.rosbridge import quote_address  # noqa: PLC0415 - heavy

            raise ConfigError(
                f"{quote_address(each)} has no name: with several robots each needs one of "
                "letters, digits, _ and - (40 at most).",
                hint="Write --robot hall=ws://192.168.1.20:9090 --robot yard=ws://192.168.1.21:9090.",
            )
        if match["name"] in named:
            raise ConfigError(
                f"Two robots are called {match['name']!r}.", hint="Give each a name of its own."
            )
        named[match["name"]] = match["rest"]
    return named


def split_files(given: Sequence[str], robots: Mapping[str, str], what: str) -> dict[str, str]:
    """Return the file of each robot by its name: "NAME=FILE", or "FILE" for those without.

    Args:
        given: As on the command line.
        robots: By name.
        what: The option, for the error.

    Raises:
        ConfigError: There is no robot of that name, or it has two files.
    """
    files: dict[str, str] = {}
    for each in given:
        match = NAME.fullmatch(each)
        is_named = match is not None and match["name"] in robots
        name, path = (match["name"], match["rest"]) if match and is_named else (ONLY, each)
        if match is not None and not is_named and ONLY not in robots:
            raise ConfigError(
                f"{what}: there is no robot called {match['name']!r}.",
                hint=f"There are: {', '.join(robots)}.",
            )
        if name in files:
            raise ConfigError(
                f"{what} is given twice for {name or 'all robots'}.", hint="Leave one of them away."
            )
        files[name] = path
    return files


def split_memories(given: Sequence[str], robots: Mapping[str, str]) -> dict[str, str | None]:
    """Return the memory of each robot: a file, the address of a database, or None for the usual.

    Raises:
        ConfigError: As `split_files`, or several robots have one file.
    """
    memories = split_files(given, robots, "--memory")
    for_all = name_for(ONLY, memories)
    if len(robots) > 1 and for_all is not None and not is_database(for_all):
        raise ConfigError(
            "--memory needs a robot's name: places belong to one map.",
            hint="Write --memory NAME=FILE for each robot.",
        )
    return {name: name_for(name, memories) for name in robots}


def file_for(name: str, files: Mapping[str, str]) -> Path | None:
    """Return a robot's own file, else the one for all, else None."""
    file = name_for(name, files)
    return None if file is None else Path(file)


def name_for(name: str, given: Mapping[str, str]) -> str | None:
    """Return the value for a robot, else for all, else None."""
    return given.get(name, given.get(ONLY))


ROBOT_TOKEN_VARIABLE = "MAPSPEAK_ROBOT_TOKEN"  # noqa: S105 - the variable's name, not a token
ROSBRIDGE_SCHEMES = ("ws://", "wss://")
LARGEST_DOMAIN = 232


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotChoice:
    """Which robot, and how to reach it.

    Attributes:
        robot: "sim", "sim:WORLD", a rosbridge's address, or "ros2" or "dds", each perhaps with a
            domain as in "dds:DOMAIN".
        robot_file: Its robot.yaml.
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

    @property
    def address(self) -> str:
        """Where others reach the same robot; empty for a simulated one, which is not shared."""
        return "" if _is_simulated(self) else self.shown


@dataclass(frozen=True, slots=True, kw_only=True)
class ServedRobot:
    """A robot for a server, which may not be there yet.

    Attributes:
        ros: The connection of one that speaks ROS.
        map_name: The map or building it drives in; empty where not given.
        skilled: The robot where it has skills of its own.
    """

    robot: "Robot"
    ros: "RosConnection | None"
    map_name: str
    skilled: "SkilledRobot | None" = None


@asynccontextmanager
async def open_robot(choice: RobotChoice) -> AsyncGenerator["Robot"]:
    """Offer the chosen robot while the context lasts.

    Raises:
        ConfigError: There is no such link, or it lacks something that was asked of it.
        LinkError: The robot cannot be reached.
    """
    if _is_simulated(choice):
        with ExitStack() as files:
            async with _open_simulated(choice, files) as simulated:
                yield simulated
    else:
        open_link, _ = choose_link(choice)
        async with open_link() as robot:
            yield robot


@asynccontextmanager
async def open_served_robot(choice: RobotChoice, files: ExitStack) -> AsyncGenerator[ServedRobot]:
    """Offer the chosen robot at once while the context lasts; one that speaks ROS may come later.

    Args:
        files: Writes what a simulated robot leaves behind when it is closed.

    Raises:
        ConfigError: As with `open_robot`.
    """
    if _is_simulated(choice):
        async with _open_simulated(choice, files) as robot:
            name = robot.description.map_name
            yield ServedRobot(robot=robot, ros=None, map_name=name, skilled=robot)
        return
    from mapspeak.links.arrival import Arrival  # noqa: PLC0415 - heavy; help must be quick

    open_link, overrides = choose_link(choice)
    arrival = Arrival(open_link)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(arrival.keep_looking)
        yield ServedRobot(
            robot=arrival.robot, ros=arrival.connection, map_name=overrides.map_name or ""
        )
        tasks.cancel_scope.cancel()


def choose_link(choice: RobotChoice) -> "tuple[OpenLink, RobotOverrides]":
    """Return what opens the link to a robot that speaks ROS, and what robot.yaml says.

    Raises:
        ConfigError: There is no such link, or it lacks something that was asked of it.
    """
    from mapspeak.ros.discovery.overrides import RobotOverrides, load_robot_file  # noqa: PLC0415 - heavy

    kind, _, domain = choice.robot.partition(":")
    is_rosbridge = choice.robot.startswith(ROSBRIDGE_SCHEMES)
    if not is_rosbridge and kind not in ("ros2", "dds"):
        from mapspeak.links.rosbridge import quote_address  # noqa: PLC0415 - heavy

        raise ConfigError(
            f"{quote_address(choice.robot)} is not a robot: there is no link for it.",
            hint="Use sim, sim:WORLD, sim:PATH to a world file, ws://HOST:9090 for a rosbridge, or "
            "for ROS 2 without one ros2 (as a node of it) or dds (without ROS here).",
        )
    _refuse_simulators_options(choice)
    if not is_rosbridge and choice.ca_file is not None:
        raise ConfigError("--ca-file is for wss://.", hint="Leave it away: DDS has no such thing.")
    overrides = load_robot_file(choice.robot_file) if choice.robot_file else RobotOverrides()
    if is_rosbridge:
        return _choose_rosbridge(choice, overrides), overrides
    # For "ros2" take what is installed: rclpy, else DDS without ROS.
    if kind == "ros2" and (find_spec("rclpy") is not None or find_spec("cyclonedds") is None):
        return _choose_ros2(domain, overrides), overrides
    return _choose_dds(domain, overrides), overrides


def _choose_rosbridge(choice: RobotChoice, overrides: "RobotOverrides") -> "OpenLink":
    from mapspeak.links.rosbridge import (  # noqa: PLC0415 - heavy; help must be quick
        RobotAddress,
        open_rosbridge_robot,
    )

    token = os.environ.get(ROBOT_TOKEN_VARIABLE)
    address = RobotAddress(
        url=choice.robot,
        headers={"Authorization": f"Bearer {token}"} if token else {},
        ca_file=choice.ca_file,
    )
    return partial(open_rosbridge_robot, address, overrides=overrides)


def _choose_ros2(domain: str, overrides: "RobotOverrides") -> "OpenLink":
    from mapspeak.links.rclpy import open_ros2_robot  # noqa: PLC0415 - heavy; help must be quick

    return partial(
        open_ros2_robot,
        domain_id=_read_domain(domain, "ros2") if domain else overrides.ros.domain_id,
        distro=os.environ.get("ROS_DISTRO", ""),
        variables=overrides.ros.variables,
        overrides=overrides,
    )


def _choose_dds(domain: str, overrides: "RobotOverrides") -> "OpenLink":
    if find_spec("cyclonedds") is None:
        raise ConfigError(
            "--robot dds needs a package that is not installed.",
            hint=f"Install it, for Python 3.11 to 3.13: {say_install('dds')}",
        )
    from mapspeak.links.dds import open_dds_robot  # noqa: PLC0415 - optional, and heavy

    network = read_network(domain, {**os.environ, **overrides.ros.variables})
    return partial(open_dds_robot, network, overrides=overrides)


def _read_domain(said: str, kind: str) -> int:
    if not (said.isascii() and said.isdigit() and int(said) <= LARGEST_DOMAIN):
        raise ConfigError(
            f"{said[:40]!r} is no ROS domain.",
            hint=f"Use {kind}, or {kind}:DOMAIN with a number from 0 to {LARGEST_DOMAIN}.",
        )
    return int(said)


def read_network(domain: str, environment: Mapping[str, str]) -> "DdsNetwork":
    """Return where to look for a ROS 2 system, as the variables say that ROS itself heeds.

    Args:
        domain: As given with --robot; empty takes ROS_DOMAIN_ID.
        environment: The variables.

    Raises:
        ConfigError: That is no domain.
    """
    from mapspeak.links.dds import DdsNetwork  # noqa: PLC0415 - optional, and heavy

    peers = environment.get("ROS_STATIC_PEERS", "")
    return DdsNetwork(
        domain_id=_read_domain(domain or environment.get("ROS_DOMAIN_ID") or "0", "dds"),
        is_local=environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "LOCALHOST"
        or environment.get("ROS_LOCALHOST_ONLY") == "1",
        peers=tuple(peer.strip() for peer in peers.split(";") if peer.strip()),
        cyclonedds_uri=environment.get("CYCLONEDDS_URI", ""),
    )


def _refuse_simulators_options(choice: RobotChoice) -> None:
    files = (choice.state_log, choice.final_map, choice.known_map, choice.start)
    if choice.clock == "virtual" or choice.has_detector or any(each is not None for each in files):
        raise ConfigError(
            "--clock virtual, --detector, --state-log, --final-map, --map and --start are for the "
            "simulated robot.",
            hint="Leave them away, or use --robot sim.",
        )


def _is_simulated(choice: RobotChoice) -> bool:
    return choice.robot.partition(":")[0] == "sim"


@asynccontextmanager
async def _open_simulated(
    choice: RobotChoice, files: ExitStack
) -> AsyncGenerator["SimulatedRobot"]:
    from mapspeak.links.simulated import Clock, open_simulated_robot  # noqa: PLC0415
    from mapspeak.simulator import Simulation, StateLog, load_world  # noqa: PLC0415
    from mapspeak.spatial.mapfiles import MapMode, load_map  # noqa: PLC0415
    from mapspeak.spatial.mapwriting import write_map  # noqa: PLC0415

    if choice.robot_file is not None or choice.ca_file is not None:
        raise ConfigError(
            "--robot-file and --ca-file are for a robot that speaks ROS.",
            hint="Leave them away, or name the robot with --robot ws://HOST:9090 or dds.",
        )
    simulation = Simulation(
        load_world(choice.robot.partition(":")[2] or DEFAULT_WORLD),
        seed=choice.seed,
        known=load_map(choice.known_map).grid if choice.known_map else None,
        start=choice.start,
    )

    def write_final_map(robot: "SimulatedRobot", path: Path) -> None:
        with usual_modes():
            write_map(robot.work_alone(simulation.map), path, mode=MapMode.RAW)

    log = None
    if choice.state_log is not None:
        log = files.enter_context(closing(StateLog(simulation, choice.state_log)))
    async with open_simulated_robot(
        simulation,
        clock=Clock(choice.clock),
        has_detector=choice.has_detector,
        after_step=log.note if log else None,
    ) as robot:
        if choice.final_map is not None:
            files.callback(write_final_map, robot, choice.final_map)
        yield robot
