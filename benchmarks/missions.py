"""What a mission costs, how soon a stop in it is a command, and random missions against a policy.

`python -m benchmarks.missions N` runs N random missions (10,000 unless given) on the simulated
robot with a tight policy. Whether a rule was broken is judged by the simulator's truth, which no
tool can see, and by the audit log.
"""

import math
import random
import statistics
import tempfile
import time
from collections.abc import AsyncGenerator, Iterable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import anyio
import click
import orjson
from mcp.client import Client
from mcp_types import TextContent

from benchmarks.figure import Figure
from benchmarks.safety import (
    FARTHEST_M,
    PIT,
    StopWatch,
    Witness,
    find_busiest_minute,
    make_guard,
)
from mapspeak.geometry import Pose
from mapspeak.links.simulated import SoloRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.safety import CommandKind, Guard, Policy, read_audit
from mapspeak.server.app import build_server
from mapspeak.session import Session
from mapspeak.simulator import BODY_RADIUS_M, Simulation, TrueFloor, load_world
from mapspeak.skill import SkilledRobot
from mapspeak.worldmodel.keepout import ClosedArea

__all__ = ["main", "measure"]

WORLD = "warehouse"
N_MISSIONS = 10_000
N_SHORT = 60
N_TOLD = 500
N_LEAVES = 100
N_STOPS = 12
WARM_S = 8.0
PACE_S = 0.05
MOST_DRIVES = 30
DRIVES_RATIO = 0.75
WRONG_RATIO = 0.02
"""Of leaves; the mission that has one is refused whole."""
IDLE_S = 3.0
WITHIN_MIN = 0.1
POLICY = Policy(areas=(PIT,), rates={CommandKind.DRIVE: MOST_DRIVES}, farthest_m=FARTHEST_M)
LEAVES: dict[str, Any] = {
    "nothing": None,
    "drive": {"drive": "3, 0"},
    "look": {"look": "ahead"},
    "wait": {"wait": 60},
    "wait_for": {"wait_for": {"battery_below": 0.01}},
    "speak": {"speak": "a long sentence that takes several seconds, and so on, and so on"},
    "ask": {"ask": "Well?"},
}


HALL = """
title: A hall with a block in it; the closed area of the policy is in its middle.
start: {at: [0, 0], yaw_deg: 0}
walls:
  - line: [[-2.5, -2.5], [7, -2.5], [7, 2.5], [-2.5, 2.5], [-2.5, -2.5]]
  - line: [[4.6, 1.4], [5.2, 1.4], [5.2, 2.0], [4.6, 2.0], [4.6, 1.4]]
rooms:
  - {name: hall, class: room, outline: [[-2.5, -2.5], [7, -2.5], [7, 2.5], [-2.5, 2.5]]}
objects: []
"""


class SureSimulation(Simulation):
    """A small hall whose map and whose place in it the robot knows: no SLAM is computed.

    Driving, LiDAR, obstacles and the battery are computed as ever.
    """

    def __init__(self, folder: Path, *, seed: int) -> None:
        path = folder / "hall.yaml"
        path.write_text(HALL)
        world = load_world(path)
        super().__init__(world, seed=seed, known=TrueFloor(world).visible)

    @property
    def pose_in_map(self) -> Pose:
        """The true pose."""
        return self.truth.pose

    def _measure(self) -> None:
        self._scan = self._lidar.scan(self._body.world_from_base, stamp_s=self.time_s)
        self._points_in_base = self._scan.points_in_base
        self._odom_at_scan = self._odometry.odom_from_base


class WitnessedSolo(SoloRobot):
    """The simulated robot of a single caller, which tells a witness of its goals."""

    def __init__(self, simulation: Simulation, witness: Witness) -> None:
        super().__init__(simulation, has_detector=False, after_step=witness.note)
        self._witness = witness

    async def send_goal(self, goal: Pose) -> str:
        """Start a drive and tell the witness."""
        self._witness.goals.append((self.now_s, goal))
        return await super().send_goal(goal)


@asynccontextmanager
async def connect(
    folder: Path, robot: SoloRobot | StopWatch, skilled: SkilledRobot, guard: Guard
) -> AsyncGenerator[tuple[Client, Session]]:
    """Return a client of a server with missions over a guarded robot, and its session."""
    memory = SemanticMapStore(folder / "m.yaml")
    session = Session(robot, memory, lease_s=600.0, guard=guard, skilled=skilled)
    server = build_server(session, toolsets=("drive", "missions"))
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(session.keep_watch)
        tasks.start_soon(server.keep_skills)
        async with Client(server) as client:
            yield client, session
        tasks.cancel_scope.cancel()


async def _run(client: Client, tree: Any, **more: Any) -> str:  # noqa: ANN401 - a tree of JSON
    text = orjson.dumps(tree).decode()
    result = await client.call_tool("run_mission", {"tree": text, **more})
    return "".join(each.text for each in result.content if isinstance(each, TextContent))


# --- cost and stops ----------------------------------------------------------------------------


async def measure_cost() -> tuple[float, float]:
    """Return the share of a core that a mission of 100 leaves takes while it waits, and runs.

    Half of its leaves wait 0.3 s each, on a robot in real time whose own world stands: what is
    counted is the mission and the server, and not the simulator.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        robot = StandingRobot(Simulation(load_world(WORLD), seed=1))
        guard = make_guard(folder, Policy())
        tree = [{"parallel": [{"wait": 0.3}, {"check": {"battery_above": 0.0}}]}] * (N_LEAVES // 2)
        async with connect(folder, robot, robot, guard) as (client, _):
            await _run(client, [{"wait": 0.1}], wait_s=5)
            # What a server loads at first is no part of it.
            await anyio.sleep(WARM_S)
            begun_s, cpu_s = time.perf_counter(), time.process_time()
            await anyio.sleep(5.0)
            idle_ratio = (time.process_time() - cpu_s) / (time.perf_counter() - begun_s)
            begun_s, cpu_s = time.perf_counter(), time.process_time()
            told = await _run(client, tree, wait_s=25)
            ratio = (time.process_time() - cpu_s) / (time.perf_counter() - begun_s)
            if "succeeded after" not in told:
                raise RuntimeError(told)
    return idle_ratio, ratio


class StandingRobot(SoloRobot):
    """A robot whose time is the wall's, and in whose world nothing is computed."""

    def __init__(self, simulation: Simulation) -> None:
        super().__init__(simulation, has_detector=False)
        self._begun_s = time.monotonic()

    @property
    def now_s(self) -> float:
        """Wall time since it was made."""
        return time.monotonic() - self._begun_s

    async def sleep(self, duration_s: float) -> None:
        """Return when that much wall time has passed."""
        await anyio.sleep(duration_s)


async def time_stops(leaf: str) -> tuple[list[float], list[float]]:
    """Return the milliseconds from a call of stop_robot to the command, during one kind of leaf.

    First by the wall clock, then of processor time, with what the simulator computes meanwhile: on
    a machine that is busy with other things only the second tells what a stop waits for here.
    """
    taken_ms, computed_ms = [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        robot = PacedWatch(Simulation(load_world(WORLD), seed=1))
        guard = make_guard(folder, Policy())
        async with (
            anyio.create_task_group() as tasks,
            connect(folder, robot, robot, guard) as (client, _),
        ):
            tasks.start_soon(robot.keep_pace)
            chooser = random.Random(2)  # noqa: S311 - no secret
            await client.call_tool("stop_robot", {})
            for _ in range(N_STOPS):
                async with anyio.create_task_group() as calls:
                    if LEAVES[leaf] is not None:
                        calls.start_soon(_run, client, [{"repeat": 50, "do": LEAVES[leaf]}])
                    await anyio.sleep(chooser.uniform(0.1, 0.5))
                    begun_s, begun_cpu_s = time.perf_counter(), time.process_time()
                    await client.call_tool("stop_robot", {})
                    taken_ms.append((robot.stopped_s - begun_s) * 1000)
                    computed_ms.append((robot.stopped_cpu_s - begun_cpu_s) * 1000)
            tasks.cancel_scope.cancel()
    return taken_ms, computed_ms


class PacedWatch(StopWatch):
    """A robot in real time, which notes when it was commanded to stand."""

    stopped_cpu_s = math.inf

    async def stop(self) -> None:
        """Stop, and note the processor time so far."""
        await super().stop()
        self.stopped_cpu_s = time.process_time()

    async def sleep(self, duration_s: float) -> None:
        """Return when that much robot time has passed."""
        until_s = self.now_s + duration_s
        while self.now_s < until_s:  # noqa: ASYNC110 - the simulation moves on by itself
            await anyio.sleep(0.02)

    async def keep_pace(self) -> None:
        """Let robot time pass as the wall clock does."""
        wall_s, robot_s = anyio.current_time(), self.now_s
        while True:
            # In short parts: a stop waits for the one that is being computed.
            due_s = robot_s + anyio.current_time() - wall_s
            await self.advance_to(min(due_s, self.now_s + PACE_S))
            await anyio.sleep(0.0 if due_s > self.now_s else PACE_S)


# --- random missions ---------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What became of random missions.

    Attributes:
        n_begun: That were not refused before they began.
        n_drove: In which a goal reached the robot.
        n_goals: Goals that reached the robot.
        nearest_m: Between the robot's edge and the closed area, in truth; negative inside.
        broken: Rules that were broken, in words.
    """

    n_missions: int
    n_begun: int
    n_drove: int
    n_goals: int
    n_refused: int
    nearest_m: float
    broken: tuple[str, ...]


async def run_random(n_missions: int, *, seed: int) -> Verdict:
    """Run random missions, and judge what came of them."""
    chooser = random.Random(seed)  # noqa: S311 - no secret
    pit = ClosedArea(name=PIT.name, outline=PIT.outline)
    n_begun = n_drove = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        simulation = SureSimulation(folder, seed=seed)
        witness = Witness(simulation, (pit,))
        robot = WitnessedSolo(simulation, witness)
        async with connect(folder, robot, robot, make_guard(folder, POLICY)) as (client, session):
            for n in range(n_missions):
                if n % N_TOLD == N_TOLD - 1:
                    click.echo(f"{n + 1} missions, {len(witness.goals)} goals", err=True)
                n_before = len(witness.goals)
                told = await _run(client, _invent(chooser, 0), within_min=WITHIN_MIN, wait_s=25)
                n_begun += told.startswith("At most")
                n_drove += len(witness.goals) > n_before
                # Without it the rate of drives would end most of them.
                await session.robot.sleep(IDLE_S)
                if session.drives.is_busy:
                    raise RuntimeError(f"The robot still drives after a mission: {told}")
        lines = list(read_audit(folder / "audit.jsonl"))
    return Verdict(
        n_missions=n_missions,
        n_begun=n_begun,
        n_drove=n_drove,
        n_goals=len(witness.goals),
        n_refused=sum(line.verdict == "refused" for line in lines),
        nearest_m=witness.nearest_m,
        broken=tuple(_find_broken(witness, lines, pit)),
    )


def _invent(chooser: random.Random, depth: int) -> Any:  # noqa: ANN401 - a tree of JSON
    """Return a random tree; it may well be one that is refused."""
    kind = chooser.choice(("leaf", "leaf", "sequence", "fallback", "retry", "timeout_s", "until"))
    if depth == 0:
        tries = [_leaf(chooser, is_drive=True) for _ in range(3)]
        first = [{"fallback": tries}] if chooser.random() < DRIVES_RATIO else []
        return {"sequence": [*first, _invent(chooser, 1)]}
    if kind == "leaf" or depth > 3:
        return _leaf(chooser, is_drive=chooser.random() < 0.5)
    parts = [_invent(chooser, depth + 1) for _ in range(chooser.randint(1, 3))]
    match kind:
        case "sequence" | "fallback":
            return {kind: parts}
        case "retry":
            return {"retry": chooser.randint(1, 3), "do": parts}
        case "timeout_s":
            return {"timeout_s": chooser.uniform(0.2, 3.0), "do": parts}
    condition = chooser.choice(({"battery_below": 0.5}, {"near": "3, 0"}, {"in_room": "R1"}))
    return {"until": condition, "times": 2, "do": parts}


def _leaf(chooser: random.Random, *, is_drive: bool) -> Any:  # noqa: ANN401 - a tree of JSON
    if is_drive:
        # Around the pit, and in it.
        return {"drive": f"{chooser.uniform(-1.5, 6):.2f}, {chooser.uniform(-2, 2):.2f}"}
    if chooser.random() < WRONG_RATIO:
        return chooser.choice(({"fly": "away"}, {"wait": -1}, {"drive": "{nothing}"}))
    return chooser.choice(
        (
            {"wait": chooser.uniform(0, 1)},
            {"check": {"battery_above": 0.1}},
            {"check": {"near": "pit"}},
            {"speak": "hello"},
            {"note": "a note"},
            {"drive": "nowhere"},
        )
    )


def _find_broken(witness: Witness, lines: list[Any], pit: ClosedArea) -> Iterable[str]:
    """Find rules that were broken, by the truth and by the log."""
    if witness.nearest_m < 0.0:
        yield f"the robot was {-witness.nearest_m:.2f} m inside the closed area"
    for _, goal in witness.goals:
        if pit.distance_to(goal.point) < BODY_RADIUS_M - 0.01:
            yield f"a goal at ({goal.x:.2f}, {goal.y:.2f}) reached the robot"
    drives = [line for line in lines if line.kind == CommandKind.DRIVE]
    allowed = [line for line in drives if line.verdict == "allowed"]
    if (n := find_busiest_minute(drives)) > MOST_DRIVES:
        yield f"{n} drives in a minute, {MOST_DRIVES} are allowed"
    if any((line.details.get("path_m") or 0.0) > FARTHEST_M for line in allowed):
        yield "a goal was too far away"
    n_sent = len(allowed) + sum(line.event == "leg" for line in lines)
    if n_sent != len(witness.goals):
        yield f"{n_sent} goals in the log, {len(witness.goals)} at the robot"


def measure() -> Iterable[Figure]:
    """Measure the cost of a mission, stops during it, and a few random missions."""
    idle, ratio = anyio.run(measure_cost)
    yield Figure(name="server beside a waiting client, of a core", value=100 * idle, unit="%")
    yield Figure(name="mission of 100 leaves, of a core", value=100 * ratio, unit="%")
    for leaf in LEAVES:
        taken_ms, computed_ms = anyio.run(time_stops, leaf)
        yield Figure(
            name=f"stop during {leaf}, median", value=statistics.median(taken_ms), unit="ms"
        )
        yield Figure(name=f"stop during {leaf}, worst", value=max(taken_ms), unit="ms")
        computed = max(computed_ms)
        yield Figure(name=f"stop during {leaf}, worst processor time", value=computed, unit="ms")
    verdict = anyio.run(lambda: run_random(N_SHORT, seed=0))
    yield Figure(name="random missions", value=verdict.n_missions, unit="")
    yield Figure(name="of them drove", value=verdict.n_drove, unit="")
    yield Figure(name="rules broken by them", value=len(verdict.broken), unit="")


@click.command()
@click.argument("n_missions", type=int, default=N_MISSIONS)
@click.option("--seed", default=0, show_default=True)
def main(n_missions: int, seed: int) -> None:
    """Run N_MISSIONS random missions."""
    begun_s = time.perf_counter()
    verdict = anyio.run(lambda: run_random(n_missions, seed=seed))
    click.echo(
        f"{verdict.n_missions} missions in {time.perf_counter() - begun_s:.0f} s: "
        f"{verdict.n_begun} were begun, {verdict.n_drove} drove, {verdict.n_goals} goals reached "
        f"the robot, {verdict.n_refused} commands were refused; the robot's edge came within "
        f"{verdict.nearest_m:.2f} m of the closed area."
    )
    for rule in verdict.broken:
        click.echo(f"BROKEN: {rule}")
    click.echo(f"{len(verdict.broken)} rules broken.")


if __name__ == "__main__":
    main()
