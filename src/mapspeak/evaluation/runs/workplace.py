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

from mapspeak.evaluation.inspected import InspectedSystem
from mapspeak.evaluation.runs.inspecting import open_inspection
from mapspeak.evaluation.scores.answers import NOWHERE
from mapspeak.evaluation.trials import ServerAccess, Setting, Trial
from mapspeak.links.simulated import SimulatedRobot, SoloRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.safety import Approvals, AuditLog, Guard, Hold, Policy, WaitingRoom
from mapspeak.server.app import DEFAULT_TOOLSETS, build_server
from mapspeak.server.mapview.representations import Representation
from mapspeak.session import Session
from mapspeak.simulator import Simulation, StateLog, StateRecord, World
from mapspeak.simulator.worlds.worldfiles import write_with_more
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import MapMode, load_map, write_map

ANSWER_WITHIN_S = 120.0
STATES = "state.jsonl"
AUDIT = "audit.jsonl"
CONTROL = "control"
MEMORY = "semantic_map.yaml"
MAP = "map.yaml"
CLOCK_ZERO = datetime(2000, 1, 1, tzinfo=UTC)
"""What the clock on the wall shows when a robot of a trial in memory begins."""
LINE_BYTES = 2000
"""More than the last line of a state log has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Workshop:
    """What a workplace is made from.

    Attributes:
        trial: Which attempt.
        setting: How it is set.
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
            *(sys.executable, "-m", "mapspeak", "serve", "--robot", f"sim:{world}"),
            *("--seed", str(self.trial.seed), "--clock", "virtual", "--detector"),
            f"--start={start.x!r},{start.y!r},{start.yaw_deg!r}",
            *known,
            *("--toolsets", ",".join(self.toolsets)),
            *tools,
            *("--representation", self.trial.representation),
            *("--memory", str(self.folder / MEMORY)),
            *("--state-log", str(self.folder / STATES)),
            *("--final-map", str(self.folder / MAP)),
            *("--audit", str(self.folder / AUDIT)),
            *("--control", str(self.control)),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Workplace:
    """A connected robot.

    Attributes:
        client: To its server; None where the agent brings its own.
        instructions: What the server tells any model first.
        look: Gives how the simulation truly stands.
        command: Starts its server, for agents that do so themselves.
    """

    client: Client | None
    instructions: str
    look: Callable[[], StateRecord]
    command: tuple[str, ...] = ()


@asynccontextmanager
async def open_workplace(shop: Workshop, connection: ServerAccess) -> AsyncGenerator[Workplace]:
    """Start robot and server and connect; in the end the robot's map lies in the folder."""
    for leftover in (STATES, MEMORY, MAP, AUDIT):
        (shop.folder / leftover).unlink(missing_ok=True)
    if shop.setting.memory is not None:
        (shop.folder / MEMORY).write_text(shop.setting.memory, encoding="utf-8")
    if shop.setting.inspected is not None:
        opened = _open_inspected(shop, shop.setting.inspected, connection)
    elif connection is ServerAccess.MEMORY:
        opened = _open_in_memory(shop)
    elif connection is ServerAccess.STDIO:
        opened = _open_over_stdio(shop)
    else:
        opened = _open_for_another(shop)
    async with opened as place:
        yield place


@asynccontextmanager
async def _open_in_memory(shop: Workshop) -> AsyncGenerator[Workplace]:
    setting = shop.setting
    world = replace(shop.world, objects=(*shop.world.objects, *setting.added))
    known = _read_known(shop.known_map)
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
        async with Client(server, read_timeout_seconds=ANSWER_WITHIN_S) as client:
            yield Workplace(
                client=client,
                instructions=server.instructions or "",
                look=lambda: StateRecord.of(simulation),
            )
    finally:
        log.close()
        write_map(simulation.map(), shop.folder / MAP, mode=MapMode.RAW)


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


def _read_known(path: Path | None) -> OccupancyGrid | None:
    return None if path is None else load_map(path).grid


@asynccontextmanager
async def _open_over_stdio(shop: Workshop) -> AsyncGenerator[Workplace]:
    command, *arguments = shop.command()
    parameters = StdioServerParameters(command=command, args=arguments)
    async with Client(parameters, read_timeout_seconds=ANSWER_WITHIN_S) as client:
        yield Workplace(
            client=client,
            instructions=client.instructions or "",
            look=lambda: _last_state(shop.folder / STATES),
        )


@asynccontextmanager
async def _open_for_another(shop: Workshop) -> AsyncGenerator[Workplace]:
    """Leave it to the agent to start the server."""
    yield Workplace(
        client=None,
        instructions="",
        look=lambda: _last_state(shop.folder / STATES),
        command=shop.command(),
    )


@asynccontextmanager
async def _open_inspected(
    shop: Workshop, system: InspectedSystem, connection: ServerAccess
) -> AsyncGenerator[Workplace]:
    """There is no simulated robot here, and nobody drives."""
    async with open_inspection(
        system, connection, toolsets=shop.toolsets, folder=shop.folder
    ) as opened:
        yield Workplace(
            client=opened.client,
            instructions=opened.instructions,
            look=lambda: NOWHERE,
            command=opened.command,
        )


def _last_state(log: Path) -> StateRecord:
    """Return the last whole line of a log that another process writes."""
    if not log.exists():
        return NOWHERE
    with log.open("rb") as file:
        file.seek(max(file.seek(0, os.SEEK_END) - LINE_BYTES, 0))
        lines = file.read().rpartition(b"\n")[0].splitlines()
    return StateRecord(**json.loads(lines[-1])) if lines else NOWHERE
