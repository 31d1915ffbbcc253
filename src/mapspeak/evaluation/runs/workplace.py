"""The robot and the server of one trial, and a client that is connected to them."""

import json
import math
import os
import sys
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

from mcp.client import Client
from mcp.client.stdio import StdioServerParameters
from mcp.server.mcpserver import MCPServer

from mapspeak.evaluation.inspected.playing import InspectedSystem, play
from mapspeak.evaluation.scores.answers import NOWHERE
from mapspeak.evaluation.trials import MAP, MEMORY, STATES, ServerAccess, Setting, Trial
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.links.simulated import SimulatedRobot, SoloRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.safety import Approvals, AuditLog, Guard, Hold, Policy, WaitingRoom
from mapspeak.server.app import DEFAULT_TOOLSETS, build_server
from mapspeak.server.mapview.representations import Representation
from mapspeak.session import Session
from mapspeak.simulator import Simulation, StateLog, StateRecord, World
from mapspeak.simulator.worlds.worldfiles import write_with_more
from mapspeak.spatial.mapfiles import MapMode, load_map, write_map

ANSWER_WITHIN_S = 120.0
AUDIT, CONTROL = "audit.jsonl", "control"
SERVE = (sys.executable, "-m", "mapspeak", "serve")
CLOCK_ZERO = datetime(2000, 1, 1, tzinfo=UTC)
"""What the clock on the wall shows when a robot of a trial in memory begins."""
LINE_BYTES = 2000
"""More than the last line of a state log has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Workshop:
    """What a workplace is made from.

    Attributes:
        world: The world of the trial, without what the setting adds.
        known_map: A finished map (.yaml) for the robot; None where it has none.
        folder: The trial's.
        control: Where the robot is held and released.
    """

    trial: Trial
    setting: Setting
    world: World
    known_map: Path | None
    folder: Path
    control: Path

    @property
    def toolsets(self) -> tuple[str, ...]:
        """Groups of tools to offer."""
        chosen = self.setting.toolsets
        return DEFAULT_TOOLSETS if chosen is None else chosen

    def command(self) -> tuple[str, ...]:
        """Return the command line of a server for this trial; write the world it names."""
        setting, world = self.setting, self.trial.world
        if setting.added:
            changed = self.folder / "world" / f"{self.world.name}.yaml"
            changed.parent.mkdir(exist_ok=True)
            world = str(write_with_more(world, setting.added, changed))
        start = setting.start
        known = () if self.known_map is None else ("--map", str(self.known_map))
        tools = ("--tools", ",".join(setting.tools)) if setting.tools else ()
        return (
            *(*SERVE, "--robot", f"sim:{world}"),
            *("--seed", str(self.trial.seed), "--clock", "virtual", "--detector"),
            f"--start={start.x!r},{start.y!r},{start.yaw_deg!r}",
            *known,
            *tools,
            *("--representation", self.trial.representation),
            *("--state-log", str(self.folder / STATES)),
            *("--final-map", str(self.folder / MAP)),
            *_usual_options(self.toolsets, self.folder, self.control),
        )


def _usual_options(toolsets: tuple[str, ...], folder: Path, control: Path) -> tuple[str, ...]:
    return (
        *("--toolsets", ",".join(toolsets)),
        *("--memory", str(folder / MEMORY)),
        *("--audit", str(folder / AUDIT)),
        *("--control", str(control)),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Workplace:
    """A connected robot.

    Attributes:
        client: To its server; None where the agent brings its own.
        look: Return how the simulation truly stands.
        command: Starts its server, for agents that do so themselves.
    """

    client: Client | None
    look: Callable[[], StateRecord]
    command: tuple[str, ...] = ()

    @property
    def instructions(self) -> str:
        """What the server tells any model first."""
        return "" if self.client is None else self.client.instructions or ""


@asynccontextmanager
async def open_workplace(shop: Workshop, connection: ServerAccess) -> AsyncGenerator[Workplace]:
    """Start robot and server and connect; in the end the robot's map lies in the folder."""
    for leftover in (STATES, MEMORY, MAP, AUDIT):
        (shop.folder / leftover).unlink(missing_ok=True)
    if shop.setting.memory is not None:
        (shop.folder / MEMORY).write_text(shop.setting.memory, encoding="utf-8")
    if shop.setting.inspected is not None:
        opened = open_inspection(
            shop.setting.inspected, connection, toolsets=shop.toolsets, folder=shop.folder
        )
    elif connection is ServerAccess.MEMORY:
        opened = _open_in_memory(shop)
    else:
        log = shop.folder / STATES
        opened = _open_apart(shop.command(), connection, lambda: _last_state(log))
    async with opened as place:
        yield place


@asynccontextmanager
async def _open_in_memory(shop: Workshop) -> AsyncGenerator[Workplace]:
    setting = shop.setting
    world = replace(shop.world, objects=(*shop.world.objects, *setting.added))
    known = None if shop.known_map is None else load_map(shop.known_map).grid
    simulation = Simulation(world, seed=shop.trial.seed, known=known, start=setting.start)
    log = StateLog(simulation, shop.folder / STATES)
    robot = SoloRobot(simulation, has_detector=True, after_step=log.note)
    memory = SemanticMapStore(shop.folder / MEMORY, map_id=world.name)
    session = Session(robot, memory, lease_s=math.inf, guard=_build_guard(shop, robot))
    server = build_server(
        session,
        toolsets=shop.toolsets,
        tools=setting.tools,
        representation=Representation(shop.trial.representation),
    )
    try:
        async with _connect(server, lambda: StateRecord.of(simulation)) as place:
            yield place
    finally:
        log.close()
        write_map(simulation.map(), shop.folder / MAP, mode=MapMode.RAW)


@asynccontextmanager
async def _connect(
    server: MCPServer | StdioServerParameters, look: Callable[[], StateRecord]
) -> AsyncGenerator[Workplace]:
    async with Client(server, read_timeout_seconds=ANSWER_WITHIN_S) as client:
        yield Workplace(client=client, look=look)


@asynccontextmanager
async def _open_apart(
    command: tuple[str, ...], connection: ServerAccess, look: Callable[[], StateRecord]
) -> AsyncGenerator[Workplace]:
    """Start a server as a process of its own, or leave that to the agent."""
    if connection is ServerAccess.COMMAND:
        yield Workplace(client=None, look=look, command=command)
        return
    parameters = StdioServerParameters(command=command[0], args=list(command[1:]))
    async with _connect(parameters, look) as place:
        yield place


def _build_guard(shop: Workshop, robot: SimulatedRobot) -> Guard:
    """Return the guard that a served robot has when nobody wrote a policy.

    Its clock is the robot's, so that a trial is the same whenever it is run. Nothing watches
    between calls: nobody can hold a trial's robot, no area is closed, and no time passes then.
    """

    def robot_clock() -> datetime:
        return CLOCK_ZERO + timedelta(seconds=robot.now_s)

    control, name = shop.control, f"sim:{shop.world.name}"
    return Guard(
        policy=Policy(),
        audit=AuditLog(shop.folder / AUDIT, wall_clock=robot_clock, robot=name),
        hold=Hold(control),
        approvals=Approvals(WaitingRoom(control / "approvals"), lambda: robot.now_s),
        wall_clock=robot_clock,
        robot=name,
    )


@asynccontextmanager
async def open_inspection(
    system: InspectedSystem, connection: ServerAccess, *, toolsets: tuple[str, ...], folder: Path
) -> AsyncGenerator[Workplace]:
    """Play a ROS system and connect to it as an agent wants it, read-only; nothing can drive.

    Args:
        folder: Where the server keeps what it writes.
    """
    async with play(system) as url:
        if connection is not ServerAccess.MEMORY:
            options = _usual_options(toolsets, folder, folder / CONTROL)
            command = (*SERVE, "--robot", url, "--read-only", *options)
            async with _open_apart(command, connection, lambda: NOWHERE) as place:
                yield place
            return
        async with open_rosbridge_robot(url) as robot:
            memory = SemanticMapStore(folder / MEMORY)
            session = Session(robot, memory, lease_s=math.inf, ros=robot.connection)
            server = build_server(session, toolsets=toolsets, is_read_only=True)
            async with _connect(server, lambda: NOWHERE) as place:
                yield place


def _last_state(log: Path) -> StateRecord:
    """Return the last whole line of a log that another process writes."""
    if not log.exists():
        return NOWHERE
    with log.open("rb") as file:
        file.seek(max(file.seek(0, os.SEEK_END) - LINE_BYTES, 0))
        lines = file.read().rpartition(b"\n")[0].splitlines()
    return StateRecord(**json.loads(lines[-1])) if lines else NOWHERE
