"""How exactly an old map is laid on a new one, and how often on one of another building.

Buildings are the shipped worlds, maps that the project's tests bring along, a drawn ring, and the
maps that people have labelled where there are any (`benchmarks.rooms`). Worlds are mapped twice by
the simulated robot with its own SLAM, from different starts, so that frames, noise and what was
seen all differ; the truth is where the two starts are. The other maps are turned, shifted, cut,
roughened and resampled by a seeded generator. `python -m benchmarks.realign` shows every case.
"""

import itertools
import math
import statistics
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import click
import cv2
import numpy as np

from benchmarks.exploration import build_worlds, choose_start
from benchmarks.figure import Figure
from benchmarks.rooms import find_labelled_maps, list_labelled_maps
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory.alignment.comparing import MapComparison, MapRelation, compare_maps
from mapspeak.memory.alignment.surfaces import MapSurfaces, placed
from mapspeak.robot import GoalState
from mapspeak.server.text.findings import say_comparison
from mapspeak.simulator import BODY_RADIUS_M, Simulation, World, load_world
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.frontiers import Tried, find_frontiers
from mapspeak.spatial.mapfiles import load_map, load_picture

__all__ = ["main", "measure"]

MAPS = Path(__file__).parents[1] / "tests" / "maps"
TWINS = ("freiburg_building101", "freiburg_building79", "map15")
"""Labelled maps of buildings that are in the list under another name."""
SEED = 20261122
N_TURNS = 1
PIECE_M = 8.0
RIGHT_M, RIGHT_RAD = 0.5, math.radians(3.0)
MOST_TICKS = 6000
STARTS = (0, 1, 2)
WHOLE, PART = 15, 4
"""Drives to frontiers in a long and in a short run of the simulated robot."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """Two maps, and where the first truly lies on the second; None where it does not.

    Attributes:
        kind: What was done.
        building: What the first map shows.
        old: The first map.
        new: The second map.
        new_from_old: The truth.
    """

    kind: str
    building: str
    old: OccupancyGrid
    new: OccupancyGrid
    new_from_old: Pose | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What became of a case.

    Attributes:
        kind: Of the case.
        building: Of the case.
        relation: The answer.
        is_told_moved: The records would have been moved, or left as they are.
        off_m: Where records come to lie, mean over the old map's walls; None where nothing moves.
        off_deg: The turn's error; likewise.
        spent_s: CPU time.
    """

    kind: str
    building: str
    relation: MapRelation
    is_told_moved: bool
    off_m: float | None
    off_deg: float | None
    spent_s: float
    comparison: MapComparison

    @property
    def is_wrong(self) -> bool:
        """Records would lie in the wrong place, and nobody would know."""
        is_off = self.off_m is None or self.off_m > RIGHT_M
        return self.is_told_moved and is_off


# --- maps ------------------------------------------------------------------------------------


def load_buildings() -> dict[str, OccupancyGrid]:
    """Return one map for each building."""
    found = {
        "house": load_map(MAPS / "aws_small_house" / "map.yaml").grid,
        "freiburg79": load_map(MAPS / "freiburg79" / "whole.yaml").grid,
    }
    folder = find_labelled_maps()
    for path in list_labelled_maps(folder) if folder else ():
        # Of one building there are several maps: furnished, plain, or half seen.
        is_twin = path.name in TWINS or path.parent.name == "rose2_partial_fr79"
        if not is_twin and path.name not in found:
            found[path.name] = load_picture(path / "map.png", resolution_m=0.05).grid
    return found


def map_world(world: World, *, seed: int, n_drives: int) -> OccupancyGrid:
    """Return the map that the simulated robot makes on so many drives to frontiers."""
    simulation = Simulation(world, seed=seed)
    tried: list[Point] = []
    for _ in range(n_drives):
        report = find_frontiers(
            simulation.map(),
            simulation.pose_in_map.point,
            radius_m=BODY_RADIUS_M,
            tried=Tried(looked_from=tuple(tried)),
        )
        if not report.frontiers:
            break
        goal = report.frontiers[0].pose
        tried.append(goal.point)
        goal_id = simulation.start_goal(goal)
        for _ in range(MOST_TICKS):
            simulation.step()
            if simulation.goal_status(goal_id).state is not GoalState.DRIVING:
                break
    return simulation.map()


def turned(grid: OccupancyGrid, motion: Pose, *, resolution_m: float) -> OccupancyGrid:
    """Draw a map anew in a moved frame, on cells that lie elsewhere."""
    low, high = grid.bounds()
    corners = np.array([[x, y] for x in (low.x, high.x) for y in (low.y, high.y)])
    moved = placed(corners, motion)
    first = moved.min(axis=0) - 0.37 * resolution_m
    n_cols, n_rows = np.ceil((moved.max(axis=0) - first) / resolution_m).astype(int) + 1
    blank = OccupancyGrid(
        cells=np.full((n_rows, n_cols), -1, dtype=np.int8),
        resolution_m=resolution_m,
        origin=Pose(*first.tolist()),
    )
    rows, cols = np.indices(blank.cells.shape).reshape(2, -1)
    back = placed(blank.points_at(rows, cols), motion.inverse())
    cells = _look_up(grid, back).reshape(blank.cells.shape)
    # A cell is occupied where anything in it is: walls are thinner than coarse cells.
    walls = placed(grid.points_at(*np.nonzero(grid.occupied)), motion)
    at = blank.cells_at(walls)
    cells[at] = 100
    return OccupancyGrid(cells=cells, resolution_m=resolution_m, origin=blank.origin)


def cut(grid: OccupancyGrid, *, share: float, towards_rad: float) -> OccupancyGrid:
    """Return the part of a map on one side that holds so much of its walls."""
    across = np.array([math.cos(towards_rad), math.sin(towards_rad)])
    limit = np.quantile(MapSurfaces(grid).points @ across, share)
    rows, cols = np.indices(grid.cells.shape).reshape(2, -1)
    is_out = (grid.points_at(rows, cols) @ across > limit).reshape(grid.cells.shape)
    return _with_cells(grid, np.where(is_out, -1, grid.cells))


def piece(grid: OccupancyGrid, random: np.random.Generator) -> OccupancyGrid:
    """Return what lies around a free place: a map that has just been begun."""
    free = np.argwhere(grid.free)
    row, col = free[random.integers(len(free))]
    rows, cols = np.indices(grid.cells.shape)
    off_m = np.hypot(rows - row, cols - col) * grid.resolution_m
    return _with_cells(grid, np.where(off_m > PIECE_M, -1, grid.cells))


def roughened(grid: OccupancyGrid, random: np.random.Generator) -> OccupancyGrid:
    """Return a map with a fifth of its wall cells gone, some beside them, and new clutter."""
    cells = grid.cells.copy()
    draw = random.random(cells.shape)
    beside = cv2.dilate(grid.occupied.view(np.uint8), np.ones((3, 3), np.uint8)) > 0
    cells[grid.occupied & (draw < 0.2)] = -1
    cells[beside & grid.free & (draw < 0.1)] = 100
    free = np.argwhere(grid.free)
    side = round(0.4 / grid.resolution_m)
    n_things = max(round(len(free) * grid.resolution_m**2 / 20), 1)
    for row, col in free[random.integers(len(free), size=n_things)]:
        cells[row : row + side, col : col + side] = 100
    return _with_cells(grid, cells)


def _look_up(grid: OccupancyGrid, points: np.ndarray) -> np.ndarray:
    rows, cols = grid.cells_at(points)
    is_inside = grid.contains_cells(rows, cols)
    found = grid.cells[np.where(is_inside, rows, 0), np.where(is_inside, cols, 0)]
    return np.asarray(np.where(is_inside, found, -1), dtype=np.int8)


def _with_cells(grid: OccupancyGrid, cells: np.ndarray) -> OccupancyGrid:
    return OccupancyGrid(
        cells=cells.astype(np.int8), resolution_m=grid.resolution_m, origin=grid.origin
    )


# --- cases -----------------------------------------------------------------------------------


def moved_cases(buildings: Mapping[str, OccupancyGrid]) -> Iterator[Case]:
    """Return maps that were moved, and changed on the way."""
    for (name, grid), turn in itertools.product(buildings.items(), range(N_TURNS)):
        random = np.random.default_rng([SEED, turn, len(name)])
        motion = _any_motion(random)
        towards = float(random.uniform(0, math.tau))
        cell_m = grid.resolution_m

        def case(
            kind: str,
            old: OccupancyGrid,
            new: OccupancyGrid,
            resolution_m: float,
            *,
            name: str = name,
            motion: Pose = motion,
        ) -> Case:
            drawn = turned(new, motion, resolution_m=resolution_m)
            return Case(kind=kind, building=name, old=old, new=drawn, new_from_old=motion)

        half = cut(grid, share=0.5, towards_rad=towards)
        one = cut(grid, share=0.75, towards_rad=towards)
        other = cut(grid, share=0.75, towards_rad=towards + math.pi)
        yield case("turned and shifted", grid, grid, cell_m)
        yield case("half of it", grid, half, cell_m)
        yield case("each three quarters, a half shared", one, other, cell_m)
        yield case("rough", grid, roughened(grid, random), cell_m)
        yield case("half of it, rough", grid, roughened(half, random), cell_m)
        yield case("cells twice as large", grid, grid, 2 * cell_m)


def mapped_cases(worlds: Sequence[World]) -> Iterator[Case]:
    """Return worlds mapped anew from other starts, the whole of it or the beginning."""
    for world in worlds:
        starts = [choose_start(world, seed) for seed in STARTS]
        wholes = [
            map_world(start, seed=seed, n_drives=WHOLE)
            for seed, start in zip(STARTS, starts, strict=True)
        ]
        part = map_world(starts[-1], seed=9, n_drives=PART)
        for one, other in itertools.combinations(STARTS, 2):
            yield Case(
                kind="mapped twice",
                building=world.name,
                old=wholes[one],
                new=wholes[other],
                new_from_old=starts[other].start.inverse() @ starts[one].start,
            )
        yield Case(
            kind="mapped, and begun anew",
            building=world.name,
            old=wholes[0],
            new=part,
            new_from_old=starts[-1].start.inverse() @ starts[0].start,
        )


def foreign_cases(buildings: Mapping[str, OccupancyGrid]) -> Iterator[Case]:
    """Return maps of two buildings, whole ones and pieces."""
    for (name, old), (other, new) in itertools.combinations(buildings.items(), 2):
        pair = f"{name} / {other}"
        random = np.random.default_rng([SEED, len(name), len(other)])
        for kind, part in (("another building", new), ("a piece of another", piece(new, random))):
            yield Case(kind=kind, building=pair, old=old, new=part, new_from_old=None)


def _any_motion(random: np.random.Generator) -> Pose:
    x, y = random.uniform(-30, 30, size=2).tolist()
    return Pose(x, y, wrap_angle(float(random.uniform(-math.pi, math.pi))))


# --- results ---------------------------------------------------------------------------------


def judge(case: Case) -> Result:
    """Compare the two maps of a case."""
    began_s = time.process_time()
    comparison = compare_maps(case.old, case.new)
    spent_s = time.process_time() - began_s
    said: Pose | None = None
    if comparison.relation is MapRelation.SAME:
        said = Pose(0.0, 0.0, 0.0)
    elif comparison.relation is MapRelation.MOVED and comparison.fit is not None:
        said = comparison.fit.new_from_old
    off_m, off_deg = _errors(case, said)
    return Result(
        kind=case.kind,
        building=case.building,
        relation=comparison.relation,
        is_told_moved=said is not None,
        off_m=off_m,
        off_deg=off_deg,
        spent_s=spent_s,
        comparison=comparison,
    )


def _errors(case: Case, said: Pose | None) -> tuple[float | None, float | None]:
    if said is None or case.new_from_old is None:
        return None, None
    points = MapSurfaces(case.old).points
    off = placed(points, said) - placed(points, case.new_from_old)
    turn = wrap_angle(said.yaw_rad - case.new_from_old.yaw_rad)
    return float(np.hypot(*off.T).mean()), math.degrees(abs(turn))


def find_results() -> Iterator[Result]:
    """Judge all cases."""
    buildings = load_buildings()
    with tempfile.TemporaryDirectory() as folder:
        worlds = [*build_worlds(Path(folder)), load_world("office")][:5]
        yield from map(judge, mapped_cases(worlds))
    yield from map(judge, moved_cases(buildings))
    yield from map(judge, foreign_cases(buildings))


def measure() -> Iterable[Figure]:
    """Return how exact, how often and how wrongly maps are laid on each other."""
    cv2.setNumThreads(1)
    return list(_figures(list(find_results())))


def _figures(results: Sequence[Result]) -> Iterator[Figure]:
    for kind in dict.fromkeys(each.kind for each in results):
        ours = [each for each in results if each.kind == kind]
        placed_ones = [each for each in ours if each.off_m is not None]
        yield Figure(name=f"{kind}: cases", value=len(ours), unit="")
        if placed_ones:
            offs = sorted(each.off_m or 0.0 for each in placed_ones)
            turns = sorted(each.off_deg or 0.0 for each in placed_ones)
            yield Figure(name=f"{kind}: laid", value=len(placed_ones) / len(ours), unit="share")
            yield Figure(name=f"{kind}: off, median", value=statistics.median(offs), unit="m")
            yield Figure(name=f"{kind}: off, worst", value=offs[-1], unit="m")
            yield Figure(name=f"{kind}: turn, worst", value=turns[-1], unit="deg")
        n_wrong = sum(each.is_wrong for each in ours)
        yield Figure(name=f"{kind}: laid wrongly", value=n_wrong, unit="cases")
    spent = sorted(each.spent_s for each in results)
    yield Figure(name="CPU time, median", value=1e3 * statistics.median(spent), unit="ms")
    yield Figure(name="CPU time, longest", value=1e3 * spent[-1], unit="ms")


@click.command()
@click.option("--all", "shows_all", is_flag=True, help="Every case, not only those to look at.")
def main(*, shows_all: bool) -> None:
    """Show how maps are laid on each other, case by case, and the figures."""
    cv2.setNumThreads(1)
    results = []
    for each in find_results():
        results.append(each)
        is_missed = each.off_m is None and "another" not in each.kind
        if shows_all or each.is_wrong or is_missed:
            off = "" if each.off_m is None else f" off {each.off_m:.3f} m, {each.off_deg:.2f} deg"
            wrong = " WRONG" if each.is_wrong else ""
            click.echo(
                f"{each.kind}, {each.building}:{wrong}{off} {say_comparison(each.comparison)}"
            )
    for figure in _figures(results):
        click.echo(f"{figure.name}: {figure.value:.3f} {figure.unit}")


if __name__ == "__main__":
    main()
