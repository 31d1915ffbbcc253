"""How far a robot drives until it has seen a building, by the rule that picks its frontiers.

`python -m benchmarks.exploration [MAP...]` explores map pictures (0.05 m per cell, dark is
occupied, 205 unknown and taken for solid), the built-in worlds where none are named. The robot is a
disc that knows its pose and drives exactly; its LiDAR looks around at every step of its way.
Coverage counts the floor that it could see from anywhere it can get to. At each decision the gains
that frontiers promise are set against what would have come into view at their poses.
"""

import itertools
import math
import statistics
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import click
import cv2
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from benchmarks.figure import Figure
from mapspeak.geometry import Point
from mapspeak.simulator.truth import TrueFloor
from mapspeak.simulator.worldfiles import load_world
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.frontiers import Frontier, FrontierReport, find_frontiers, remaining_ratio
from mapspeak.spatial.mapfiles import load_picture
from mapspeak.spatial.paths import clearance_m, distances_from, find_path

__all__ = ["main", "measure"]

WORLDS = ("warehouse", "office")
CELL_M = 0.05
RADIUS_M = 0.25
RANGE_M = 12.0
N_BEAMS = 720
STEP_M = 0.4
N_STARTS = 3
MOST_GOALS = 200
MOST_PROMISES = 10
"""So many frontiers of each decision are held to what they promise: those that a reader sees."""
TURN_AT_RATIO = 0.3
"""Less than this of what a frontier promised is left: the robot turns to the next one."""
SHARES = (0.90, 0.98)

Mask = NDArray[np.bool_]
Known = NDArray[np.int8]


@dataclass(frozen=True, slots=True)
class Situation:
    """What a rule may look at.

    Attributes:
        report: Frontiers from where the robot is.
        robot: Its place.
        visited: Where it has ended drives.
    """

    report: FrontierReport
    robot: Point
    visited: Sequence[Point]


Rule = Callable[[Situation], Frontier]


def mapspeak_ranking(situation: Situation) -> Frontier:
    """Takes the first of the ranking."""
    return situation.report.frontiers[0]


def nearest(situation: Situation) -> Frontier:
    """Takes the nearest by path (Yamauchi, 1997)."""
    return min(situation.report.frontiers, key=lambda each: each.distance_m)


def gain_per_metre(situation: Situation) -> Frontier:
    """Takes the one with the most unknown in sight per metre of way."""
    return max(situation.report.frontiers, key=lambda each: each.gain_m2 / (each.distance_m + 0.5))


def near_and_long(situation: Situation) -> Frontier:
    """Takes the least of three times the distance less the length, as explore_lite weighs them."""
    return min(situation.report.frontiers, key=lambda each: 3 * each.distance_m - each.length_m)


def paper_prompt(situation: Situation) -> Frontier:
    """Takes the largest at least 5 m away and not within 3 m of where it was (paper, appendix)."""
    far = [
        each
        for each in situation.report.frontiers
        if each.pose.point.distance_to(situation.robot) >= 5.0
        and all(each.pose.point.distance_to(place) >= 3.0 for place in situation.visited)
    ]
    return max(far or situation.report.frontiers, key=lambda each: each.gain_m2)


RULES: tuple[Rule, ...] = (
    mapspeak_ranking,
    nearest,
    gain_per_metre,
    near_and_long,
    paper_prompt,
)
DRIVES_TO_THE_END: frozenset[Rule] = frozenset({paper_prompt})
"""Rules that never turn on the way: their robot looks at the map at goals only."""


@dataclass(frozen=True, slots=True)
class Promise:
    """A frontier's gain, and the floor that came into view by a look from its pose.

    Attributes:
        promised_m2: By the frontier.
        came_m2: In truth.
    """

    promised_m2: float
    came_m2: float


class Building:
    """The truth: what is solid, where beams end, and what can be seen at all."""

    def __init__(self, name: str, grid: OccupancyGrid) -> None:
        self.name = name
        self.floor = OccupancyGrid(
            cells=np.where(grid.free, 0, 100).astype(np.int8), resolution_m=CELL_M
        )
        self._reach = int(RANGE_M / CELL_M) + 2
        self._solid = np.pad(self.floor.occupied, self._reach, constant_values=True)
        angles = (np.arange(N_BEAMS) + 0.03) * (math.tau / N_BEAMS)
        ranges = np.arange(0.5, RANGE_M / CELL_M, 0.8, dtype=np.float32)
        self._rows = np.outer(np.sin(angles), ranges).astype(np.float32)
        self._cols = np.outer(np.cos(angles), ranges).astype(np.float32)

    def look(self, known: Known, robot: Point) -> None:
        """Enters what the LiDAR sees into the known map."""
        n_cols = self._solid.shape[1]
        rows = (self._rows + np.float32(robot.y / CELL_M + self._reach)).astype(np.int32)
        cols = (self._cols + np.float32(robot.x / CELL_M + self._reach)).astype(np.int32)
        cells = rows * n_cols + cols
        is_behind = np.logical_or.accumulate(self._solid.ravel()[cells], axis=1)
        ends = np.argmax(is_behind, axis=1)
        has_hit = is_behind[:, -1]
        self._enter(known, cells[~is_behind], 0)
        self._enter(known, cells[has_hit, ends[has_hit]], 100)

    def _enter(self, known: Known, cells: NDArray[np.int32], value: int) -> None:
        rows, cols = np.divmod(cells, self._solid.shape[1])
        rows, cols = rows - self._reach, cols - self._reach
        is_inside = (rows >= 0) & (rows < known.shape[0]) & (cols >= 0) & (cols < known.shape[1])
        known[rows[is_inside], cols[is_inside]] = value

    def find_seeable(self, start: Point) -> Mask:
        """Finds the floor that can be seen from where a robot can get to."""
        reachable = distances_from(self.floor, start, radius_m=RADIUS_M).build_reachable_mask()
        known = np.full(reachable.shape, -1, dtype=np.int8)
        for row, col in np.argwhere(reachable):
            if row % 10 == 0 and col % 10 == 0:
                self.look(known, self.floor.point_at(Cell(int(row), int(col))))
        return np.asarray(known == 0)

    def choose_starts(self, n_starts: int) -> list[Point]:
        """Gives places anywhere on the largest floor that is joined."""
        is_clear = self.floor.free & (clearance_m(self.floor) >= RADIUS_M)
        _, labels, stats, _ = cv2.connectedComponentsWithStats(
            is_clear.view(np.uint8), connectivity=4
        )
        cells = np.argwhere(labels == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax()))
        chosen = np.random.default_rng(5).choice(cells, n_starts, replace=False)
        return [self.floor.point_at(Cell(int(row), int(col))) for row, col in chosen]


@dataclass(slots=True)
class Exploration:
    """One robot under way.

    Attributes:
        building: Where it is.
        robot: Its place.
        seeable: What it may see in the end.
        known: Its map.
        driven_m: Its way so far.
        n_goals: Decisions so far.
        thinking_s: CPU time of all decisions.
        driven_to_m: Its way up to each share of the seeable floor.
        promises: Of the frontiers at all decisions.
    """

    building: Building
    robot: Point
    seeable: Mask
    known: Known = field(init=False)
    driven_m: float = 0.0
    n_goals: int = 0
    thinking_s: float = 0.0
    driven_to_m: dict[float, float] = field(default_factory=dict)
    promises: list[Promise] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.known = np.full(self.seeable.shape, -1, dtype=np.int8)
        self._look()

    @property
    def coverage_ratio(self) -> float:
        """The share of the seeable floor that was seen."""
        return float((self.known[self.seeable] == 0).mean())

    def run(self, rule: Rule) -> None:
        """Explores until nothing is left."""
        visited: list[Point] = []
        looked_from: list[Point] = []
        while self.n_goals < MOST_GOALS:
            started_s = time.process_time()
            report = find_frontiers(
                self._grid(), self.robot, radius_m=RADIUS_M, looked_from=looked_from
            )
            if not report.frontiers:
                return
            goal = rule(Situation(report, self.robot, visited))
            self.thinking_s += time.process_time() - started_s
            self.n_goals += 1
            self.promises += map(self._try_out, report.frontiers[:MOST_PROMISES])
            if self._drive(goal, may_turn=rule not in DRIVES_TO_THE_END):
                looked_from.append(goal.pose.point)
            visited.append(self.robot)

    def _try_out(self, frontier: Frontier) -> Promise:
        """Looks from a frontier's pose as if the robot were there."""
        seen = np.full_like(self.known, -1)
        self.building.look(seen, frontier.pose.point)
        n_new = np.count_nonzero((seen == 0) & (self.known < 0))
        return Promise(frontier.gain_m2, float(n_new) * CELL_M**2)

    def _drive(self, goal: Frontier, *, may_turn: bool) -> bool:
        """Drives to a frontier; False where it turned before."""
        path = find_path(self._grid(), self.robot, goal.pose.point, radius_m=RADIUS_M)
        if path is None:
            return True
        for start, end in itertools.pairwise(path.points):
            for place in _steps(start, end):
                self.driven_m += self.robot.distance_to(place)
                self.robot = place
                self._look()
                if may_turn and remaining_ratio(self._grid(), goal) < TURN_AT_RATIO:
                    return False
        return True

    def _look(self) -> None:
        self.building.look(self.known, self.robot)
        seen_ratio = self.coverage_ratio
        for share in SHARES:
            if seen_ratio >= share:
                self.driven_to_m.setdefault(share, self.driven_m)

    def _grid(self) -> OccupancyGrid:
        return OccupancyGrid(cells=self.known, resolution_m=CELL_M)


def _steps(start: Point, end: Point) -> Iterator[Point]:
    n_steps = max(math.ceil(start.distance_to(end) / STEP_M), 1)
    for step in range(1, n_steps + 1):
        share = step / n_steps
        yield Point(start.x + (end.x - start.x) * share, start.y + (end.y - start.y) * share)


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What a rule reached in a building, means over all starts.

    Attributes:
        building: The building's name.
        rule: The rule's name.
        to_90_m: Driven until 90 % were seen; not a number where that was never so.
        to_98_m: The same for 98 %.
        to_end_m: Driven until no frontier was left.
        coverage_ratio: Seen in the end.
        n_goals: Decisions until the end.
        decision_ms: CPU time of one decision.
        kept_ratio: What came into view per square metre promised, the median over all frontiers.
        promise_correlation: Between what was promised and what came into view.
    """

    building: str
    rule: str
    to_90_m: float
    to_98_m: float
    to_end_m: float
    coverage_ratio: float
    n_goals: float
    decision_ms: float
    kept_ratio: float
    promise_correlation: float


def measure() -> Iterator[Figure]:
    """Gives the ways of this project's ranking in the built-in worlds, and how honest it is."""
    for building in _worlds():
        result = explore(building, mapspeak_ranking)
        name = building.name
        yield Figure(name=f"{name}, way to 90 %", value=result.to_90_m, unit="m")
        yield Figure(name=f"{name}, way to 98 %", value=result.to_98_m, unit="m")
        yield Figure(name=f"{name}, way to the end", value=result.to_end_m, unit="m")
        yield Figure(name=f"{name}, decisions", value=result.n_goals, unit="goals")
        yield Figure(name=f"{name}, one decision", value=result.decision_ms, unit="ms")
        yield Figure(
            name=f"{name}, came into view of what was promised", value=result.kept_ratio, unit=""
        )
        yield Figure(
            name=f"{name}, correlation of the two", value=result.promise_correlation, unit=""
        )


def explore(building: Building, rule: Rule) -> Result:
    """Explores a building by a rule, from several starts."""
    runs = []
    for start in building.choose_starts(N_STARTS):
        run = Exploration(building, start, building.find_seeable(start))
        run.run(rule)
        runs.append(run)
    promises = [promise for run in runs for promise in run.promises]
    promised_m2 = [each.promised_m2 for each in promises]
    came_m2 = [each.came_m2 for each in promises]
    return Result(
        building=building.name,
        rule=rule.__name__,
        to_90_m=_mean(run.driven_to_m.get(SHARES[0], math.nan) for run in runs),
        to_98_m=_mean(run.driven_to_m.get(SHARES[1], math.nan) for run in runs),
        to_end_m=_mean(run.driven_m for run in runs),
        coverage_ratio=_mean(run.coverage_ratio for run in runs),
        n_goals=_mean(run.n_goals for run in runs),
        decision_ms=_mean(1e3 * run.thinking_s / max(run.n_goals, 1) for run in runs),
        kept_ratio=statistics.median(
            came / promised for came, promised in zip(came_m2, promised_m2, strict=True)
        ),
        promise_correlation=statistics.correlation(promised_m2, came_m2),
    )


def _mean(values: Iterable[float]) -> float:
    return statistics.fmean(values)


def _worlds() -> Iterator[Building]:
    for name in WORLDS:
        yield Building(name, TrueFloor(load_world(name)).visible)


@click.command()
@click.argument("maps", nargs=-1, type=click.Path(exists=True, dir_okay=False, path_type=Path))
def main(maps: tuple[Path, ...]) -> None:
    """Compares all rules in the buildings of some map pictures."""
    cv2.setNumThreads(1)
    pictures = (
        Building(f"{path.parent.name}/{path.name}", load_picture(path, resolution_m=CELL_M).grid)
        for path in maps
    )
    for building in pictures if maps else _worlds():
        Console().print(_table(building))


def _table(building: Building) -> Table:
    table = Table(
        "rule", "to 90 %", "to 98 %", "to the end", "seen", "decisions", "ms each", "kept"
    )
    table.title = f"{building.name}: metres driven, mean of {N_STARTS} starts"
    for rule in RULES:
        result = explore(building, rule)
        table.add_row(
            result.rule.replace("_", " "),
            f"{result.to_90_m:.1f}",
            f"{result.to_98_m:.1f}",
            f"{result.to_end_m:.1f}",
            f"{100 * result.coverage_ratio:.1f} %",
            f"{result.n_goals:.1f}",
            f"{result.decision_ms:.0f}",
            f"{result.kept_ratio:.2f} (r {result.promise_correlation:.2f})",
        )
    return table


if __name__ == "__main__":
    main()
