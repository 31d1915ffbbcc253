"""The robot and the server of one trial, and a client that is connected to them."""

import math
import sys
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import anyio
from mcp.client import Client
from mcp.client.stdio import StdioServerParameters
from mcp.server.mcpserver import MCPServer

from mapspeak.evaluation.agent import ServerAccess
from mapspeak.evaluation.inspected import InspectedSystem, play
from mapspeak.evaluation.scores.judging import NOWHERE
from mapspeak.evaluation.trials import CALLS, MAP, MEMORY, STATES, Setting, Trial
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.links.simulated import SimulatedRobot, SoloRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.safety import Approvals, AuditLog, Guard, Hold, Policy, WaitingRoom
from mapspeak.server.app import DEFAULT_TOOLSETS, build_server
from mapspeak.server.reports.representations import Representation
from mapspeak.server.view.replay import MAPS, MapLog
from mapspeak.session import Session
from mapspeak.simulator import Simulation, StateLog, StateRecord, World
from mapspeak.simulator.worlds.worldfiles import write_as_changed
from mapspeak.spatial.mapfiles import MapMode, load_map
from mapspeak.spatial.mapwriting import write_map

ANSWER_WITHIN_S = 1200.0
"""Wall time. A trial that hangs is killed; on a loaded machine one answer may take minutes."""
AUDIT, CONTROL = "audit.jsonl", "control"
SERVE = (sys.executable, "-m", "mapspeak", "serve")
CLOCK_ZERO = datetime(2000, 1, 1, tzinfo=UTC)
"""Wall time at the start of a trial in memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialSetup:
    """Configuration of the robot and server of a trial.

    Attributes:
        world: The world of the trial, without additions of the setting.
        known_map: A finished map (.yaml) for the robot; None without one.
        control: Where the robot is held and released.
        view: Address of a live page, if the server runs as a program; None for no page.
    """

    trial: Trial
    setting: Setting
    world: World
    known_map: Path | None
    folder: Path
    control: Path
    view: str | None = None

    @property
    def toolsets(self) -> tuple[str, ...]:
        """Groups of tools to offer."""
        chosen = self.setting.toolsets
        return DEFAULT_TOOLSETS if chosen is None else chosen

    @property
    def played(self) -> World:
        """The world with all that the setting makes otherwise in it."""
        setting, world = self.setting, self.world
        doors = (
            replace(door, is_shut=door.is_shut or door.name in setting.shut) for door in world.doors
        )
        battery_ratio = setting.battery_ratio
        return replace(
            world,
            objects=(*world.objects, *setting.added),
            doors=tuple(doors),
            battery_ratio=world.battery_ratio if battery_ratio is None else battery_ratio,
            n_faults={**world.n_faults, **setting.n_faults},
        )

    def command(self) -> tuple[str, ...]:
        """Return the command line of a server for this trial; write the world it names."""
        setting, world = self.setting, self.trial.world
        played = self.played
        if played != self.world:
            changed = self.folder / "world" / f"{self.world.name}.yaml"
            changed.parent.mkdir(exist_ok=True)
            world = str(write_as_changed(world, played, changed))
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
            *(() if self.view is None else ("--view", self.view)),
            *("--state-log", str(self.folder / STATES)),
            *("--final-map", str(self.folder / MAP)),
            *_usual_options(self.toolsets, self.folder, self.control),
        )


def _usual_options(toolsets: tuple[str, ...], folder: Path, control: Path) -> tuple[str, ...]:
    return (
        *("--toolsets", ",".join(toolsets)),
        *("--memory", str(folder / MEMORY)),
        *("--audit", str(folder / AUDIT)),
        *("--call-log", str(folder / f"{CALLS}.jsonl")),
        *("--control", str(control)),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Workplace:
    """A robot that is served.

    Attributes:
        client: To its server; None where the agent brings its own.
        look: Return how the simulation truly stands.
        command: Starts its server, for agents that do so themselves.
    """

    client: Client | None
    look: Callable[[], StateRecord]
    command: tuple[str, ...] = ()


@asynccontextmanager
async def open_workplace(setup: TrialSetup, connection: ServerAccess) -> AsyncGenerator[Workplace]:
    """Start robot and server and connect; in the end the robot's map lies in the folder."""
    if setup.setting.memory is not None:
        (setup.folder / MEMORY).write_text(setup.setting.memory, encoding="utf-8")
    if setup.setting.inspected is not None:
        opened = open_inspection(
            setup.setting.inspected, connection, toolsets=setup.toolsets, folder=setup.folder
        )
    elif connection is ServerAccess.MEMORY:
        opened = _open_in_memory(setup)
    else:
        log = setup.folder / STATES
        opened = _connect(setup.command(), lambda: _last_state(log), connection)
    async with opened as place:
        yield place


@asynccontextmanager
async def _open_in_memory(setup: TrialSetup) -> AsyncGenerator[Workplace]:
    setting = setup.setting
    world = setup.played
    known = None if setup.known_map is None else load_map(setup.known_map).grid
    simulation = Simulation(world, seed=setup.trial.seed, known=known, start=setting.start)
    log = StateLog(simulation, setup.folder / STATES)
    robot = SoloRobot(simulation, has_detector=True, after_step=log.note)
    memory = SemanticMapStore(setup.folder / MEMORY, map_id=world.name)
    guard = _build_guard(setup, robot)
    session = Session(robot, memory, lease_s=math.inf, guard=guard, skilled=robot)
    server = build_server(
        session,
        toolsets=setup.toolsets,
        tools=setting.tools,
        representation=Representation(setup.trial.representation),
        call_log=MapLog(session, setup.folder / CALLS / MAPS),
    )
    try:
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(server.keep_skills)
            async with _connect(server, lambda: StateRecord.of(simulation)) as place:
                yield place
            tasks.cancel_scope.cancel()
    finally:
        log.close()
        write_map(simulation.map(), setup.folder / MAP, mode=MapMode.RAW)


@asynccontextmanager
async def _connect(
    server: MCPServer | tuple[str, ...],
    look: Callable[[], StateRecord],
    connection: ServerAccess = ServerAccess.STDIO,
) -> AsyncGenerator[Workplace]:
    """Connect to a server, or to one that a command line starts, or leave that to the agent."""
    started: MCPServer | StdioServerParameters
    if isinstance(server, MCPServer):
        started = server
    elif connection is ServerAccess.COMMAND:
        yield Workplace(client=None, look=look, command=server)
        return
    else:
        started = StdioServerParameters(command=server[0], args=list(server[1:]))
    async with Client(started, read_timeout_seconds=ANSWER_WITHIN_S) as client:
        yield Workplace(client=client, look=look)


def _build_guard(setup: TrialSetup, robot: SimulatedRobot) -> Guard:
    """Return the guard of a served robot without a policy file.

    It uses the robot's clock, so that trials are reproducible. It does not monitor between calls: a
    trial's robot cannot be held, no area is closed, and no time passes then.
    """

    def robot_clock() -> datetime:
        return CLOCK_ZERO + timedelta(seconds=robot.now_s)

    control, name = setup.control, f"sim:{setup.world.name}"
    return Guard(
        policy=Policy(),
        audit=AuditLog(setup.folder / AUDIT, wall_clock=robot_clock, robot=name),
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
            async with _connect(command, lambda: NOWHERE, connection) as place:
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
    whole = log.read_bytes().rpartition(b"\n")[0] if log.exists() else b""
    return StateRecord.read(whole.rpartition(b"\n")[2]) if whole else NOWHERE
