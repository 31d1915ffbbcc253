"""The robots to serve, and the configuration of each."""

from collections.abc import Callable, Sequence
from contextlib import AsyncExitStack, ExitStack
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

from mapspeak.cli.shared.options import GuardChoice, build_guard, data_folder, wall_clock
from mapspeak.cli.shared.robots import (
    RobotChoice,
    file_for,
    name_robots,
    open_served_robot,
    split_files,
    split_memories,
)
from mapspeak.errors import ConfigError

if TYPE_CHECKING:
    from mapspeak.robot import Robot
    from mapspeak.ros.port import RosConnection
    from mapspeak.session import Session


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotStart:
    """One robot as it is to be served.

    Attributes:
        memory: A file, or the address of a database; None for the usual file.
    """

    choice: RobotChoice
    memory: str | None
    guard: GuardChoice


def read_starts(
    robots: Sequence[str],
    choice: RobotChoice,
    guard: GuardChoice,
    *,
    robot_files: Sequence[str],
    semantic_maps: Sequence[str],
    policies: Sequence[str],
) -> dict[str, RobotStart]:
    """Return each robot as it is to be served, by its name.

    Args:
        robots: Addresses, of several robots each as "NAME=ADDRESS"; likewise what follows.
        choice: Options that are the same for all of them.
        guard: Likewise.

    Raises:
        ConfigError: Some options contradict each other.
    """
    named = name_robots(robots)
    files = split_files(robot_files, named, "--robot-file")
    memories = split_memories(semantic_maps, named)
    limits = split_files(policies, named, "--policy")
    if len(named) > 1 and _is_for_one(choice):
        raise ConfigError(
            "--state-log, --final-map, --map and --start are for one robot.",
            hint="Serve one, or leave them away.",
        )
    return {
        name: RobotStart(
            choice=replace(choice, robot=address, robot_file=file_for(name, files)),
            memory=memories[name],
            guard=replace(guard, policy=file_for(name, limits)),
        )
        for name, address in named.items()
    }


def _is_for_one(choice: RobotChoice) -> bool:
    files = (choice.state_log, choice.final_map, choice.known_map, choice.start)
    return any(each is not None for each in files)


async def open_session(
    name: str,
    start: RobotStart,
    links: AsyncExitStack,
    files: ExitStack,
    scratch: Path,
    *,
    lease_s: float,
) -> "tuple[Session, RosConnection | None]":
    """Return a session over one robot, and the robot's ROS as it is; both last as its links do.

    Args:
        name: The operator's name for the robot; empty for an only one.
        files: Writes what a simulated robot leaves behind; closed after the links.
        scratch: A folder for a memory that does not last.
        lease_s: A driving robot is stopped after this time without a client.
    """
    from mapspeak.cli.memory.choosing import (  # noqa: PLC0415 - heavy; help must be quick
        keep_usual_memory,
        open_store,
    )
    from mapspeak.session import Session  # noqa: PLC0415 - likewise

    choice = start.choice
    guard = build_guard(start.guard, robot=name or choice.shown, address=choice.address)
    served = await links.enter_async_context(open_served_robot(choice, files))
    if choice.clock == "virtual":
        guard = replace(guard, wall_clock=_follow(served.robot))
    file = start.memory
    if file is None:
        folder = scratch / name if served.ros is None else data_folder()
        file = keep_usual_memory(folder, served.map_name, choice.shown, address=choice.robot)
    memory = open_store(file, map_id=served.map_name or None)
    session = Session(
        served.robot,
        memory,
        lease_s=lease_s,
        guard=guard,
        ros=served.ros,
        skilled=served.skilled,
    )
    return session, served.ros


def _follow(robot: "Robot") -> Callable[[], datetime]:
    """Return a calendar that moves on as a robot's clock does, from the operator's present."""
    began = wall_clock() - timedelta(seconds=robot.now_s)
    return lambda: began + timedelta(seconds=robot.now_s)
