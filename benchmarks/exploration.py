"""How far a robot drives until it has seen a building, by the rule that picks its frontiers.

`python -m benchmarks.exploration [WORLD...]` explores shipped worlds, world files, or maps that
map_server loads, five of them where none are named, from five starts each. It is the simulated
robot with its own SLAM and navigation, led by the one exploration loop of the project; the rules
differ in nothing but the frontier they pick. Reachable floor is what the robot's body can be over;
seeable floor is what a perfect robot could see from there, slivers behind furniture included.
At each decision of our own rule the gains that frontiers promise are set against what would have
come into view at their poses.
"""

import dataclasses
import math
import statistics
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import anyio
import click
import cv2
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from benchmarks.figure import Figure
from mapspeak.driving.drivereport import DriveReport
from mapspeak.driving.exploration.explorer import Explorer, Pick, take_first
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.links.simulated import SimulatedRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.session import Session
from mapspeak.simulator import BODY_RADIUS_M, Simulation, TrueFloor, World, load_world
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.mapwriting import write_map
from mapspeak.spatial.paths import clearance_m
from mapspeak.worldmodel.model import WorldModel

__all__ = ["choose_start", "main", "measure"]

SEEDS = range(5)
WAIT_S = 25.0
MOST_CALLS = 120
LOOK_EVERY_TICKS = 10
SHARES = (0.90, 0.98)
CELL_M = 0.05
RANGE_M = 12.0
N_BEAMS = 720
MOST_PROMISES = 10
"""So many frontiers of each decision are held to what they promise: those that a reader sees."""
START_ROOM_M = 0.4
MAPS = Path(__file__).parents[1] / "tests" / "maps"

Mask = NDArray[np.bool_]
FloatArray = NDArray[np.float64]


# --- worlds ----------------------------------------------------------------------------------


def build_worlds(folder: Path) -> Iterator[World]:
    """Return the two shipped worlds and three that are made from maps of map_server."""
    yield load_world("warehouse")
    yield load_world("office")
    house = load_world(MAPS / "aws_small_house" / "map.yaml")
    yield dataclasses.replace(house, name="house map")
    yield dataclasses.replace(load_world(MAPS / "freiburg79" / "whole.yaml"), name="freiburg79 map")
    write_map(draw_ring(), folder / "ring.yaml")
    yield dataclasses.replace(load_world(folder / "ring.yaml"), name="ring map")


def draw_ring() -> OccupancyGrid:
    """Draw a floor whose corridor runs all around a core, with rooms on both of its sides."""
    cells = np.full((420, 560), -1, dtype=np.int8)

    def room(x: float, y: float, width: float, height: float) -> None:
        rows = slice(round(y / CELL_M), round((y + height) / CELL_M))
        cells[rows, round(x / CELL_M) : round((x + width) / CELL_M)] = 0

    room(2.0, 5.0, 22.8, 2.0)
    room(2.0, 13.0, 22.8, 2.0)
    room(5.0, 5.0, 2.0, 10.0)
    room(19.0, 5.0, 2.0, 10.0)
    for index in range(5):
        left, width = 2.0 + 4.6 * index, 4.4
        room(left, 1.0, width, 3.8)
        room(left + 1.0 + 0.4 * index, 4.8, 1.0, 0.2)
        room(left, 15.2, width, 3.8)
        room(left + 2.6 - 0.4 * index, 15.0, 1.0, 0.2)
    for left in (7.2, 13.1):
        room(left, 7.2, 5.7, 5.6)
        room(left + 2.0, 7.0, 1.0, 0.2)
    for x, y in ((9.5, 10.0), (15.0, 9.0), (4.0, 2.5), (13.0, 17.5), (22.5, 2.0)):
        row, col = round(y / CELL_M), round(x / CELL_M)
        cells[row : row + 12, col : col + 16] = 100
    known = cv2.dilate((cells == 0).view(np.uint8), np.ones((3, 3), np.uint8)) > 0
    cells[known & (cells < 0)] = 100
    return OccupancyGrid(cells=cells, resolution_m=CELL_M)


def choose_start(world: World, seed: int) -> World:
    """Return the world with the robot anywhere it can get to; seed 0 keeps its own start."""
    if seed == 0:
        return world
    floor, random = TrueFloor(world), np.random.default_rng(seed)
    is_roomy = floor.standable & (clearance_m(floor.solid) >= START_ROOM_M)
    cells = np.argwhere(is_roomy)
    row, col = cells[random.integers(len(cells))]
    x, y = floor.solid.points_at(np.array([row]), np.array([col]))[0].tolist()
    turn_rad = wrap_angle(float(random.uniform(-math.pi, math.pi)))
    return dataclasses.replace(world, start=world.start @ Pose(x, y, turn_rad))


# --- rules -----------------------------------------------------------------------------------


def nearest(frontiers: Sequence[Frontier], _world_model: WorldModel) -> Frontier:
    """Take the nearest by path (Yamauchi, 1997)."""
    return min(frontiers, key=lambda each: each.distance_m)


def gain_per_metre(frontiers: Sequence[Frontier], _world_model: WorldModel) -> Frontier:
    """Take the one with the most unknown in sight per metre of way."""
    return max(frontiers, key=lambda each: each.gain_m2 / (each.distance_m + 0.5))


def near_and_long(frontiers: Sequence[Frontier], _world_model: WorldModel) -> Frontier:
    """Take the least of three times the distance less the length, as explore_lite weighs them."""
    return min(frontiers, key=lambda each: 3 * each.distance_m - each.length_m)


def mapspeak_ranking(frontiers: Sequence[Frontier], world_model: WorldModel) -> Frontier:
    """Take the first of the ranking."""
    return take_first(frontiers, world_model)


RULES: tuple[Pick, ...] = (mapspeak_ranking, nearest, gain_per_metre, near_and_long)


# --- one run ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Promise:
    """A frontier's gain, and the floor that came into view by a look from its pose.

    Attributes:
        promised_m2: By the frontier.
        came_m2: In truth.
    """

    promised_m2: float
    came_m2: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What a rule reached from one start.

    Attributes:
        reachable_ratio: Of the reachable floor, on the map in the end.
        seeable_ratio: Of the seeable floor.
        to_90_m: Driven until 90 % of the reachable floor were on the map; inf if that never was.
        to_98_m: The same for 98 %.
        to_end_m: Driven in all.
        n_goals: Drives begun, those that were given up on the way included.
        n_calls: Of the tool: what a model has to decide.
        n_collisions: By the simulator.
        state: How it ended.
        promises: Of the frontiers at all decisions.
    """

    reachable_ratio: float
    seeable_ratio: float
    to_90_m: float
    to_98_m: float
    to_end_m: float
    n_goals: int
    n_calls: int
    n_collisions: int
    state: str
    promises: tuple[Promise, ...]


class Truth:
    """What a run is measured by: points of the floor, in the map frame."""

    def __init__(self, floor: TrueFloor) -> None:
        solid, visible = floor.solid, floor.visible
        # Who stands at a cell covers all within the body's radius.
        away = cv2.distanceTransform((~floor.standable).view(np.uint8), cv2.DIST_L2, 5)
        is_covered = np.asarray(away) * solid.resolution_m <= BODY_RADIUS_M
        self.reachable = solid.points_at(*np.nonzero(is_covered & visible.free))
        self.seeable = visible.points_at(*np.nonzero(visible.free))
        self._solid = np.pad(solid.occupied, 1, constant_values=True)
        self._grid = solid
        angles = (np.arange(N_BEAMS) + 0.03) * (math.tau / N_BEAMS)
        reach_m = np.arange(CELL_M / 2, RANGE_M, 0.8 * CELL_M)
        self._rays = np.stack(
            [np.outer(np.cos(angles), reach_m), np.outer(np.sin(angles), reach_m)], axis=-1
        )

    def find_in_view(self, place: Point) -> FloatArray:
        """Find the cells of floor that a LiDAR sees from a place, as points of shape (n, 2)."""
        rays = self._rays + np.array([place.x, place.y])
        rows, cols = self._grid.cells_at(rays.reshape(-1, 2))
        n_rows, n_cols = self._grid.cells.shape
        rows, cols = rows.clip(-1, n_rows) + 1, cols.clip(-1, n_cols) + 1
        is_met = self._solid[rows, cols].reshape(rays.shape[:2])
        is_seen = ~np.logical_or.accumulate(is_met, axis=1).ravel()
        is_in_view = np.zeros(self._solid.shape, dtype=np.bool_)
        is_in_view[rows[is_seen], cols[is_seen]] = True
        rows, cols = np.nonzero(is_in_view[1:-1, 1:-1])
        return self._grid.points_at(rows, cols)


def known_ratio(grid: OccupancyGrid, points: FloatArray) -> float:
    """Return the share of some points that a map knows."""
    rows, cols = grid.cells_at(points)
    is_inside = grid.contains_cells(rows, cols)
    return float((~grid.unknown[rows[is_inside], cols[is_inside]]).sum() / max(len(points), 1))


@dataclass(slots=True)
class Watcher:
    """Notes after how many metres how much of the floor was known.

    Attributes:
        simulation: The run.
        truth: Its floor.
        to_m: Metres driven by the share known.
    """

    simulation: Simulation
    truth: Truth
    to_m: dict[float, float] = field(default_factory=dict)
    _n_ticks: int = 0

    def after_step(self) -> None:
        """Look at the map now and then."""
        self._n_ticks += 1
        if self._n_ticks % LOOK_EVERY_TICKS or len(self.to_m) == len(SHARES):
            return
        ratio = known_ratio(self.simulation.map(), self.truth.reachable)
        for share in SHARES:
            if ratio >= share:
                self.to_m.setdefault(share, self.simulation.truth.driven_m)


async def explore(world: World, seed: int, rule: Pick, truth: Truth) -> Run:
    """Explore a world from its start by one rule, as a model does that calls nothing else."""
    simulation = Simulation(world, seed=seed)
    watcher = Watcher(simulation, truth)
    promises: list[Promise] = []

    def pick(frontiers: Sequence[Frontier], world_model: WorldModel) -> Frontier:
        if rule is mapspeak_ranking:
            promises.extend(
                _try_out(truth, world_model.grid, each) for each in frontiers[:MOST_PROMISES]
            )
        return rule(frontiers, world_model)

    robot = SimulatedRobot(simulation, has_detector=False, after_step=watcher.after_step)
    with tempfile.TemporaryDirectory() as folder:
        session = Session(robot, SemanticMapStore(Path(folder) / "map.yaml"), lease_s=math.inf)
        explorer = Explorer(session, pick=pick)
        progress = await explorer.advance(None, wait_s=WAIT_S, on_trip=_tell_nobody)
        n_calls = 1
        while not progress.state.is_end and n_calls < MOST_CALLS:
            progress = await explorer.advance(None, wait_s=WAIT_S, on_trip=_tell_nobody)
            n_calls += 1
    return Run(
        reachable_ratio=known_ratio(simulation.map(), truth.reachable),
        seeable_ratio=known_ratio(simulation.map(), truth.seeable),
        to_90_m=watcher.to_m.get(SHARES[0], math.inf),
        to_98_m=watcher.to_m.get(SHARES[1], math.inf),
        to_end_m=simulation.truth.driven_m,
        n_goals=progress.n_goals,
        n_calls=n_calls,
        n_collisions=simulation.truth.n_collisions,
        state=progress.state,
        promises=tuple(promises),
    )


def _try_out(truth: Truth, grid: OccupancyGrid, frontier: Frontier) -> Promise:
    """Look from a frontier's pose as if the robot were there."""
    points = truth.find_in_view(frontier.pose.point)
    n_new = len(points) * (1.0 - known_ratio(grid, points))
    return Promise(frontier.gain_m2, n_new * CELL_M**2)


async def _tell_nobody(_report: DriveReport) -> None:
    """Nobody waits for news."""


# --- all runs --------------------------------------------------------------------------------


def measure() -> Iterator[Figure]:
    """Return what the exploration reaches in five worlds from five starts each, beside others."""
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder:
        for world in build_worlds(Path(folder)):
            yield from _figures(world.name, run_all(world, SEEDS))


def run_all(world: World, seeds: Iterable[int]) -> dict[Pick, list[Run]]:
    """Explore a world from several starts by all rules."""
    runs: dict[Pick, list[Run]] = {rule: [] for rule in RULES}
    for seed in seeds:
        moved = choose_start(world, seed)
        truth = Truth(TrueFloor(moved))
        for rule, own in runs.items():
            own.append(anyio.run(explore, moved, seed, rule, truth))
    return runs


def _figures(name: str, runs: dict[Pick, list[Run]]) -> Iterator[Figure]:
    ours = runs[mapspeak_ranking]
    best_m = min(_mean(run.to_98_m for run in runs[rule]) for rule in RULES[1:])
    way_m = _mean(run.to_98_m for run in ours)
    least = min(run.reachable_ratio for run in ours)
    yield Figure(
        name=f"{name}, least share of reachable floor (target: 0.99)", value=least, unit=""
    )
    least = min(run.seeable_ratio for run in ours)
    yield Figure(name=f"{name}, least share of seeable floor", value=least, unit="")
    yield Figure(name=f"{name}, way to 90 %", value=_mean(run.to_90_m for run in ours), unit="m")
    yield Figure(name=f"{name}, way to 98 %", value=way_m, unit="m")
    yield Figure(name=f"{name}, way to 98 % by the best other rule", value=best_m, unit="m")
    nearest_m = _mean(run.to_98_m for run in runs[nearest])
    yield Figure(name=f"{name}, way to 98 % by the nearest frontier", value=nearest_m, unit="m")
    yield Figure(
        name=f"{name}, way over that of the best (target: at most 1.1)",
        value=way_m / best_m,
        unit="",
    )
    yield Figure(name=f"{name}, way to the end", value=_mean(r.to_end_m for r in ours), unit="m")
    yield Figure(
        name=f"{name}, most decisions (target: at most 25)",
        value=max(r.n_calls for r in ours),
        unit="calls",
    )
    yield Figure(name=f"{name}, most drives", value=max(r.n_goals for r in ours), unit="drives")
    collisions = sum(run.n_collisions for run in ours)
    yield Figure(name=f"{name}, collisions (target: 0)", value=collisions, unit="bumps")
    promises = [promise for run in ours for promise in run.promises]
    kept = statistics.median(each.came_m2 / each.promised_m2 for each in promises)
    yield Figure(name=f"{name}, came into view of what was promised", value=kept, unit="")
    correlation = statistics.correlation(
        [each.promised_m2 for each in promises], [each.came_m2 for each in promises]
    )
    yield Figure(name=f"{name}, correlation of the two", value=correlation, unit="")


def _mean(values: Iterable[float]) -> float:
    return statistics.fmean(values)


@click.command()
@click.argument("worlds", nargs=-1)
@click.option("--seeds", "n_seeds", default=len(SEEDS), show_default=True, help="Starts.")
def main(worlds: tuple[str, ...], n_seeds: int) -> None:
    """Compare all rules in some worlds: names, world files, or maps of map_server."""
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder:
        for world in map(load_world, worlds) if worlds else build_worlds(Path(folder)):
            Console().print(_table(world, n_seeds))


def _table(world: World, n_seeds: int) -> Table:
    table = Table("rule", "to 90 %", "to 98 %", "end", "reachable", "seeable", "drives", "calls")
    table.add_column("bumps")
    table.title = f"{world.name}: metres driven, mean of {n_seeds} starts; least shares"
    for rule, runs in run_all(world, range(n_seeds)).items():
        table.add_row(
            rule.__name__.replace("_", " "),
            f"{_mean(run.to_90_m for run in runs):.1f}",
            f"{_mean(run.to_98_m for run in runs):.1f}",
            f"{_mean(run.to_end_m for run in runs):.1f}",
            f"{100 * min(run.reachable_ratio for run in runs):.2f} %",
            f"{100 * min(run.seeable_ratio for run in runs):.2f} %",
            f"{_mean(run.n_goals for run in runs):.1f} (most {max(r.n_goals for r in runs)})",
            f"{_mean(run.n_calls for run in runs):.1f} (most {max(r.n_calls for r in runs)})",
            str(sum(run.n_collisions for run in runs)),
        )
    return table


if __name__ == "__main__":
    main()
