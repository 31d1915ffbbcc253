"""How fast the robot is stopped, what the guard costs, and a hostile caller against a policy.

`python -m benchmarks.safety stop` measures stops during every other kind of call, with the load of
the machine: the target, 50 ms, is for the wall clock of a machine with nothing else to do.

`python -m benchmarks.safety [N]` lets a hostile caller make N calls (10,000 unless given) of every
tool with random arguments, on the simulated robot with a tight policy. Whether a rule was broken is
judged by the simulator's truth, which no tool can see, and by the audit log.
"""

import gc
import math
import os
import random
import statistics
import tempfile
import time
from collections import Counter
from collections.abc import AsyncGenerator, Iterable, Iterator, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import anyio
import click
from mcp.client import Client
from mcp_types import Tool

from benchmarks.figure import Figure
from mapspeak.errors import MapspeakError
from mapspeak.geometry import Point, Pose
from mapspeak.links.simulated import SimulatedRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.safety import (
    Approvals,
    AreaRule,
    AuditLine,
    AuditLog,
    CommandKind,
    Guard,
    Hold,
    Policy,
    WaitingRoom,
    read_audit,
)
from mapspeak.server.app import build_server
from mapspeak.server.toolsets import build_toolsets
from mapspeak.session import Session
from mapspeak.simulator import BODY_RADIUS_M, Simulation, load_world
from mapspeak.worldmodel.keepout import ClosedArea

__all__ = ["main", "measure"]

WORLD = "warehouse"
N_CALLS = 10_000
N_STOPS = 40
N_DECISIONS = 300
STAND_MPS = 0.01
PIT = AreaRule(
    name="pit", outline=(Point(2.0, -1.0), Point(4.0, -1.0), Point(4.0, 1.0), Point(2.0, 1.0))
)
NEAR_GOALS = (Pose(1.0, 0.0), Pose(0.0, 1.0), Pose(0.5, -0.5), Pose(0.0, 0.0))
MOST_DRIVES = 20
FARTHEST_M = 12.0
IDLE_S = (0.0, 0.0, 0.0, 0.0, 1.0)
"""Robot time that passes between two calls: without it drives would be used up at once."""
MINUTE_MS = 60_000


@dataclass(slots=True)
class Witness:
    """Sees the simulator's truth after each of its steps, and every goal that reaches the robot.

    Attributes:
        nearest_m: The least distance between the robot's edge and a closed area.
        goals: With the robot time at which each was sent.
    """

    simulation: Simulation
    areas: tuple[ClosedArea, ...]
    nearest_m: float = math.inf
    goals: list[tuple[float, Pose]] = field(default_factory=list)

    def note(self) -> None:
        """Look where the robot truly is."""
        here = self.simulation.truth.pose.point
        for area in self.areas:
            inside = area.contains(here)
            off_m = area.distance_to(here) - BODY_RADIUS_M
            self.nearest_m = min(self.nearest_m, -BODY_RADIUS_M if inside else off_m)


class WitnessedRobot(SimulatedRobot):
    """The simulated robot, which tells a witness of its goals."""

    def __init__(self, simulation: Simulation, witness: Witness) -> None:
        super().__init__(simulation, has_detector=True, after_step=witness.note)
        self._witness = witness

    async def send_goal(self, goal: Pose) -> str:
        """Start a drive and tells the witness."""
        self._witness.goals.append((self.now_s, goal))
        return await super().send_goal(goal)


def make_guard(folder: Path, policy: Policy) -> Guard:
    """Return a guard with its files in a folder, whose operator's clock is the wall clock."""

    def now() -> datetime:
        return datetime.now(UTC)

    return Guard(
        policy=policy,
        # The whole log is judged: it must not begin anew.
        audit=AuditLog(folder / "audit.jsonl", wall_clock=now, most_bytes=10**12),
        hold=Hold(folder / "control"),
        approvals=Approvals(WaitingRoom(folder / "control" / "approvals"), time.monotonic),
        wall_clock=now,
    )


# --- stopping ----------------------------------------------------------------------------------


class StopWatch(SimulatedRobot):
    """The simulated robot, which notes when it was commanded to stand."""

    stopped_s = math.inf

    def __init__(self, simulation: Simulation) -> None:
        super().__init__(simulation, has_detector=False)
        self.was_stopped = anyio.Event()

    async def stop(self) -> None:
        """Stop, and notes when the command was given."""
        await super().stop()
        self.stopped_s = time.perf_counter()
        self.was_stopped.set()


BUSY_CALLS: dict[str, dict[str, Any]] = {
    "nothing else": {},
    "navigate_to": {"x": 4.0, "y": 0.0},
    "look_at_map": {},
    "look_through_camera": {},
    "draw_robot_pose": {},
    "subscribe_map_as_image": {},
    "get_robot_pose": {},
    "measure": {},
    "describe_place": {"place": "3, 0"},
    "check_goal": {"place": "3, 0"},
    "explore": {},
    "search_for": {"thing": "ladder", "seen": False},
    "follow_route": {"stops": ["1, 0", "0, 1"]},
    "look_around": {},
    "turn": {"by_deg": 90},
    "write_semantic_data": {"name": "here", "description": "a place"},
}


async def time_stops(busy_with: str) -> list[float]:
    """Return the milliseconds from a call of stop_robot to the command, during another call."""
    taken_ms = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        simulation = Simulation(load_world(WORLD), seed=1)
        robot = StopWatch(simulation)
        memory = SemanticMapStore(folder / "memory.yaml")
        session = Session(robot, memory, lease_s=60.0, guard=make_guard(folder, Policy()))
        async with (
            anyio.create_task_group() as tasks,
            Client(build_server(session, tools=tuple(BUSY_CALLS)[1:])) as client,
        ):
            tasks.start_soon(session.keep_watch)
            chooser = random.Random(2)  # noqa: S311 - no secret
            await client.call_tool("stop_robot", {})  # the first call of all loads modules
            for _ in range(N_STOPS):
                async with anyio.create_task_group() as calls:
                    if busy_with != "nothing else":
                        calls.start_soon(client.call_tool, busy_with, BUSY_CALLS[busy_with])
                    await anyio.sleep(chooser.uniform(0.0, 0.15))
                    begun_s = time.perf_counter()
                    await client.call_tool("stop_robot", {})
                    taken_ms.append((robot.stopped_s - begun_s) * 1000)
            tasks.cancel_scope.cancel()
    return taken_ms


async def time_outside_stops() -> list[float]:
    """Return the milliseconds from the hold's file to the command, while the robot drives."""
    taken_ms = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        simulation = Simulation(load_world(WORLD), seed=1)
        robot = StopWatch(simulation)
        guard = make_guard(folder, Policy())
        session = Session(robot, SemanticMapStore(folder / "m.yaml"), lease_s=60.0, guard=guard)
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(session.keep_watch)
            for number in range(N_STOPS):
                await anyio.sleep(0.02 + 0.002 * number)
                robot.was_stopped = anyio.Event()
                begun_s = time.perf_counter()
                guard.hold.put("benchmark", at=guard.wall_clock())
                with anyio.fail_after(10.0):
                    await robot.was_stopped.wait()
                taken_ms.append((robot.stopped_s - begun_s) * 1000)
                guard.hold.lift()
                await anyio.sleep(0.12)
            tasks.cancel_scope.cancel()
    return taken_ms


async def time_decisions() -> tuple[float, float]:
    """Return the milliseconds of processor time that a drive costs without and with the guard."""
    costs_ms = []
    for policy in (None, Policy(areas=(PIT,), rates={})):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            robot = SimulatedRobot(Simulation(load_world(WORLD), seed=1), has_detector=False)
            guard = None if policy is None else make_guard(folder, policy)
            memory = SemanticMapStore(folder / "m.yaml")
            session = Session(robot, memory, lease_s=60.0, guard=guard)
            begun_s = time.process_time()
            for number in range(N_DECISIONS):
                with suppress(MapspeakError), session.drives.preparing() as ticket:
                    goal = NEAR_GOALS[number % len(NEAR_GOALS)]
                    await session.drives.start(goal, place="near", ticket=ticket)
            costs_ms.append((time.process_time() - begun_s) / N_DECISIONS * 1000)
    return costs_ms[0], costs_ms[1]


# --- the hostile caller ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What became of a hostile caller's calls.

    Attributes:
        n_calls: How many.
        n_drives: Goals that reached the robot.
        n_refused: Commands that were refused.
        n_stopped: Drives that were stopped before a closed area.
        nearest_m: Between the robot's edge and a closed area, in truth; negative inside.
        broken: Rules that were broken, in words.
    """

    n_calls: int
    n_drives: int
    n_refused: int
    n_stopped: int
    nearest_m: float
    broken: tuple[str, ...]


@asynccontextmanager
async def connect(
    folder: Path, robot: SimulatedRobot, policy: Policy
) -> AsyncGenerator[tuple[Client, Session]]:
    """Return a client of a server with all tools over a guarded robot, and its session."""
    guard = make_guard(folder, policy)
    session = Session(robot, SemanticMapStore(folder / "m.yaml"), lease_s=60.0, guard=guard)
    server = build_server(session, toolsets=tuple(build_toolsets(session)))
    async with anyio.create_task_group() as tasks, Client(server) as client:
        tasks.start_soon(session.keep_watch)
        yield client, session
        tasks.cancel_scope.cancel()


async def attack(n_calls: int, *, seed: int) -> Verdict:
    """Let a hostile caller call whatever there is, and judge what came of it."""
    chooser = random.Random(seed)  # noqa: S311 - no secret
    policy = Policy(areas=(PIT,), rates={CommandKind.DRIVE: MOST_DRIVES}, farthest_m=FARTHEST_M)
    simulation = Simulation(load_world(WORLD), seed=seed)
    pit = ClosedArea(name=PIT.name, outline=PIT.outline)
    witness = Witness(simulation, (pit,))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        robot = WitnessedRobot(simulation, witness)
        async with connect(folder, robot, policy) as (client, session):
            tools = (await client.list_tools()).tools
            for _ in range(n_calls):
                tool = _choose_tool(chooser, tools)
                await client.call_tool(tool.name, _invent(chooser, tool.input_schema))
                await session.robot.sleep(chooser.choice(IDLE_S))
        lines = list(read_audit(folder / "audit.jsonl"))
    return Verdict(
        n_calls=n_calls,
        n_drives=len(witness.goals),
        n_refused=sum(line.verdict == "refused" for line in lines),
        n_stopped=sum(
            line.event == "ended" and "its own navigation" in line.said for line in lines
        ),
        nearest_m=witness.nearest_m,
        broken=tuple(_find_broken(witness, lines, pit)),
    )


def _choose_tool(chooser: random.Random, tools: Sequence[Tool]) -> Tool:
    """Prefer what moves: pictures take long and harm nobody."""
    return chooser.choices(tools, [_weight(tool) for tool in tools])[0]


def _weight(tool: Tool) -> float:
    if tool.name.startswith("ros_"):
        return 1.0
    if tool.name == "navigate_to":
        return 60.0
    if tool.annotations is not None and tool.annotations.destructive_hint:
        return 6.0
    return 1.0 if any(word in tool.name for word in ("draw", "look", "map")) else 8.0


def _invent(chooser: random.Random, schema: dict[str, Any]) -> dict[str, Any]:
    wanted = schema.get("properties", {})
    required = set(schema.get("required", ()))
    given = {
        key: _value(chooser, key, part)
        for key, part in wanted.items()
        if key in required or chooser.random() < 0.5
    }
    if "x" in wanted and "y" in wanted and chooser.random() < 0.7:
        place = {"x": chooser.uniform(-2, 9), "y": chooser.uniform(-4, 4)}
        given = {key: value for key, value in given.items() if key == "yaw_deg"} | place
    if "wait_s" in wanted:
        given["wait_s"] = chooser.choice((0, 0, 0.5, 1, 2))
    return given


def _value(chooser: random.Random, key: str, part: dict[str, Any]) -> Any:  # noqa: ANN401 - anything
    kinds = {part.get("type"), *(each.get("type") for each in part.get("anyOf", ()))}
    words = ["R1", "C1", "F1", "F2", "D1", "W1", "robot", "3, 0", "nowhere", "pit", "", "x" * 300]
    odd: list[Any] = [None, True, [], {}, "1e999", -1, 1e300, "\x00"]
    if chooser.random() < 0.1:
        return chooser.choice(odd)
    if "boolean" in kinds:
        return chooser.random() < 0.5
    if kinds & {"number", "integer"}:
        return chooser.choice((0, 1, 2, chooser.uniform(-10, 10), 90))
    if "array" in kinds:
        return [chooser.choice(words) for _ in range(chooser.randint(0, 3))]
    return f"hostile {chooser.randint(1, 3)}" if key == "name" else chooser.choice(words)


def _find_broken(witness: Witness, lines: list[AuditLine], pit: ClosedArea) -> Iterator[str]:
    """Find rules that were broken, by the truth and by the log."""
    if witness.nearest_m < 0.0:
        yield f"the robot was {-witness.nearest_m:.2f} m inside the closed area"
    for _, goal in witness.goals:
        if pit.distance_to(goal.point) < BODY_RADIUS_M - 0.01:
            yield f"a goal at ({goal.x:.2f}, {goal.y:.2f}) reached the robot"
    n_drives = find_busiest_minute(lines)
    if n_drives > MOST_DRIVES:
        yield f"{n_drives} drives in a minute, {MOST_DRIVES} are allowed"
    yield from _find_missing(witness, lines)


def find_busiest_minute(lines: Iterable[AuditLine]) -> int:
    """Return the largest number of drives that were allowed within less than a minute.

    The log rounds to milliseconds. In these, as whole numbers, two drives a minute apart stay a
    minute apart; in seconds 64.1 - 4.1 is a little less than 60.
    """
    at_ms = [round(1000 * (each.robot_s or 0.0)) for each in lines if each.verdict == "allowed"]
    return max((sum(0 <= end - each < MINUTE_MS for each in at_ms) for end in at_ms), default=0)


def _find_missing(witness: Witness, lines: list[AuditLine]) -> Iterator[str]:
    """Find what the log lacks."""
    allowed = [line for line in lines if line.verdict == "allowed"]
    numbers = {line.number for line in allowed}
    counts = {
        event: Counter(line.number for line in lines if line.event == event)
        for event in ("decision", "result", "leg", "ended")
    }
    n_sent = len(allowed) + counts["leg"].total()
    if n_sent != len(witness.goals):
        yield f"{n_sent} goals in the log, {len(witness.goals)} at the robot"
    if any((line.details.get("path_m") or 0.0) > FARTHEST_M for line in allowed):
        yield "a goal was too far away"
    if any(counts["decision"][each] != 1 or counts["result"][each] != 1 for each in numbers):
        yield "a decision or a result is missing in the log, or there twice"
    # The latest drive may be under way still.
    if sum(counts["ended"][each] != 1 for each in numbers) > 1:
        yield "the end of a drive is missing in the log, or there twice"
    if missing := set(range(1, max(each.number for each in lines) + 1)) - {
        each.number for each in lines
    }:
        yield f"lines are missing in the log: {sorted(missing)[:5]}"


# --- figures -----------------------------------------------------------------------------------


def measure() -> Iterable[Figure]:
    """Measure stops, the cost of the guard, and a short attack."""
    for busy_with in BUSY_CALLS:
        yield from _spread(f"stop_robot during {busy_with}", anyio.run(time_stops, busy_with))
    yield from _spread("stop from outside", anyio.run(time_outside_stops))
    without_ms, with_ms = anyio.run(time_decisions)
    yield Figure(name="a drive without a guard", value=without_ms, unit="ms")
    yield Figure(name="a drive with a guard", value=with_ms, unit="ms")
    verdict = anyio.run(lambda: attack(300, seed=0))
    yield Figure(name="hostile calls", value=verdict.n_calls, unit="")
    yield Figure(name="rules broken by them", value=len(verdict.broken), unit="")


def _spread(name: str, values_ms: list[float]) -> Iterator[Figure]:
    yield Figure(name=f"{name}, median", value=statistics.median(values_ms), unit="ms")
    yield Figure(name=f"{name}, worst", value=max(values_ms), unit="ms")


def print_stops() -> None:
    """Print how long a stop takes during each kind of call."""
    # As `mapspeak serve` does: what was loaded stays for good.
    gc.collect()
    gc.freeze()
    for busy_with in BUSY_CALLS:
        taken_ms = anyio.run(time_stops, busy_with)
        click.echo(
            f"during {busy_with}: median {statistics.median(taken_ms):.1f} ms, worst "
            f"{max(taken_ms):.1f} ms of {len(taken_ms)}; load {os.getloadavg()[0]:.1f}"
        )
    taken_ms = anyio.run(time_outside_stops)
    click.echo(
        f"from outside: median {statistics.median(taken_ms):.1f} ms, worst {max(taken_ms):.1f} ms"
    )


@click.command()
@click.argument("part", default=str(N_CALLS))
@click.option("--seed", default=0, show_default=True)
def main(part: str, seed: int) -> None:
    """Let a hostile caller make PART calls, a number, or measure stops where PART is "stop"."""
    if part == "stop":
        print_stops()
        return
    n_calls = int(part)
    begun_s = time.perf_counter()
    verdict = anyio.run(lambda: attack(n_calls, seed=seed))
    click.echo(
        f"{verdict.n_calls} calls in {time.perf_counter() - begun_s:.0f} s: {verdict.n_drives} "
        f"goals reached the robot, {verdict.n_refused} were refused, {verdict.n_stopped} drives "
        f"were stopped before a closed area; the robot's edge came within {verdict.nearest_m:.2f} "
        "m of one."
    )
    for rule in verdict.broken:
        click.echo(f"BROKEN: {rule}")
    click.echo(f"{len(verdict.broken)} rules broken.")


if __name__ == "__main__":
    main()
