"""How well a named thing is found in an unknown building, beside nearest-frontier search.

Two shipped worlds and eight drawn by a seeded generator, from five starts each. The judge is a
script: it sees what the simulated detector reports and nothing else, and thinks that things stand
where their like stand: a fridge near a sink. Success weighted by path length (SPL; Anderson et al.,
"On evaluation of embodied navigation agents", 2018): after the thing is seen the robot still has to
drive to it, the shortest way; the best possible way is the shortest from the start.
`python -m benchmarks.search` shows every run.
"""

import dataclasses
import json
import math
import statistics
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import anyio
import click
import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.figure import Figure
from mapspeak.driving.drivereport import DriveReport
from mapspeak.driving.search.candidates import CandidateKind, SearchCandidate
from mapspeak.driving.search.progress import Budget
from mapspeak.driving.search.searcher import Choose, Judgement, Searcher
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.links.simulated import SimulatedRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import Detection
from mapspeak.session import Session
from mapspeak.simulator import (
    BODY_RADIUS_M,
    Simulation,
    TrueFloor,
    World,
    WorldObject,
    load_world,
)
from mapspeak.simulator.worlds.models import find_kind
from mapspeak.spatial.paths import DistanceField, clearance_m, distances_from

__all__ = ["main", "measure"]

SEEDS = range(5)
N_DRAWN = 8
WAIT_S = 25.0
BUDGET = Budget(n_looks=60, driven_m=250.0)
MOST_CALLS = 150
START_ROOM_M = 0.4
LEAST_WAY_M = 5.0
NEAR_M = 1.5
N_RESAMPLES = 2000

KITCHEN = ("fridge", "sink", "coffee_machine", "table")
OFFICE = ("desk", "office_chair", "whiteboard", "printer", "cabinet")
BATHROOM = ("toilet", "sink", "trash_bin")
LOUNGE = ("sofa", "plant", "table")
STORE = ("loaded_shelf", "pallet", "crate", "ladder")
FIRST_AID = ("first_aid_box", "eye_wash_station", "cabinet")
ROOM_KINDS = (KITCHEN, OFFICE, OFFICE, BATHROOM, LOUNGE, STORE, FIRST_AID)
NEAR_ITS_LIKE = 0.9
AMONG_OTHERS = 0.2


# --- worlds ----------------------------------------------------------------------------------


def build_worlds(folder: Path) -> Iterator[World]:
    """Return the shipped worlds and the drawn ones."""
    yield load_world("warehouse")
    yield load_world("office")
    for seed in range(N_DRAWN):
        path = folder / f"drawn{seed}.yaml"
        path.write_text(json.dumps(draw_world(np.random.default_rng(100 + seed))))
        yield load_world(path)


def draw_world(random: np.random.Generator) -> dict[str, object]:
    """Draw a floor: a corridor, often with one across it, rooms of all kinds along both."""
    width_m, length_m = 2.0, float(random.uniform(18.0, 30.0))
    depths_m = random.uniform(4.0, 6.5, size=2)
    walls: list[dict[str, object]] = []
    doors: list[dict[str, object]] = []
    objects: list[dict[str, object]] = []
    for side, depth_m in enumerate(depths_m):
        left_m = 0.0
        near_m, far_m = (0.0, -depth_m) if side == 0 else (width_m, width_m + depth_m)
        while length_m - left_m >= 3.0:
            span_m = min(float(random.uniform(3.0, 7.5)), length_m - left_m)
            if length_m - left_m - span_m < 3.0:
                span_m = length_m - left_m
            right_m = left_m + span_m
            corners = [[left_m, near_m], [right_m, near_m], [right_m, far_m], [left_m, far_m]]
            walls.append({"line": [*corners, corners[0]]})
            door_m = float(random.uniform(left_m + 0.9, right_m - 0.9))
            doors.append({"at": [door_m, near_m], "width_m": float(random.uniform(0.9, 1.2))})
            kind = ROOM_KINDS[int(random.integers(len(ROOM_KINDS)))]
            objects += _furnish(random, kind, (left_m, right_m, near_m, far_m), len(objects))
            left_m = right_m
    walls += [
        {"line": [[0.0, 0.0], [0.0, width_m]]},
        {"line": [[length_m, 0], [length_m, width_m]]},
    ]
    return {
        "title": "A floor drawn for the search.",
        "start": {"at": [1.0, width_m / 2]},
        "walls": walls,
        "doors": doors,
        "objects": objects,
    }


def _furnish(
    random: np.random.Generator,
    kinds: Sequence[str],
    room: tuple[float, float, float, float],
    n_before: int,
) -> list[dict[str, object]]:
    """Places things of a room along its far wall, facing into it; each that has room."""
    left_m, right_m, near_m, far_m = room
    inward = 1.0 if near_m > far_m else -1.0
    n_places = max(int((right_m - left_m - 0.8) / 1.5), 1)
    chosen = random.permutation(np.array(kinds))[:n_places].tolist()
    placed = []
    for index, kind in enumerate(chosen):
        at_m = left_m + 0.4 + (index + 0.5) * (right_m - left_m - 0.8) / len(chosen)
        off_m = 0.07 if find_kind(kind).is_wall_hung else 0.65
        placed.append(
            {
                "name": f"{kind} {n_before + index}",
                "kind": kind,
                "at": [at_m, far_m + inward * off_m],
                "yaw_deg": 90.0 * inward,
            }
        )
    return placed


# --- tasks -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Task:
    """A thing to find.

    Attributes:
        world: With the robot where it starts.
        kind: Of the thing; any of that kind will do.
        shortest_m: From the start to the nearest one, by path.
        seed: Of the start and of all noise.
    """

    world: World
    kind: str
    shortest_m: float
    seed: int

    @property
    def thing(self) -> str:
        """What it is called."""
        return find_kind(self.kind).label


def choose_task(world: World, seed: int) -> Task:
    """Return a start and a kind of thing of which none is near it."""
    random = np.random.default_rng(1000 + seed)
    floor = TrueFloor(world)
    cells = np.argwhere(floor.standable & (clearance_m(floor.solid) >= START_ROOM_M))
    for _ in range(200):
        row, col = cells[random.integers(len(cells))]
        x, y = floor.solid.points_at(np.array([row]), np.array([col]))[0].tolist()
        kinds = sorted({thing.kind for thing in world.objects})
        kind = kinds[int(random.integers(len(kinds)))]
        start = world.start @ Pose(x, y, wrap_angle(float(random.uniform(-math.pi, math.pi))))
        moved = dataclasses.replace(world, start=start)
        ways = measure_from(TrueFloor(moved), Point(0.0, 0.0))
        shortest_m = way_to_nearest(moved, kind, ways)
        if LEAST_WAY_M <= shortest_m < math.inf:
            return Task(moved, kind, shortest_m, seed)
    message = f"{world.name} has nothing to look for."
    raise ValueError(message)


def measure_from(floor: TrueFloor, place: Point) -> DistanceField:
    """Return the true ways from a place of the map frame."""
    return distances_from(floor.solid, place, radius_m=BODY_RADIUS_M)


def way_to_nearest(world: World, kind: str, ways: DistanceField) -> float:
    """Return the metres to the nearest thing of a kind, to within reach of it."""
    return min(
        (_way_to(world, thing, ways) for thing in world.objects if thing.kind == kind),
        default=math.inf,
    )


def _way_to(world: World, thing: WorldObject, ways: DistanceField) -> float:
    place = world.start.inverse().transform(thing.pose.point)
    around = (
        Point(place.x + far * math.cos(angle), place.y + far * math.sin(angle))
        for far in (0.5, 0.75, 1.0, 1.25, NEAR_M)
        for angle in np.arange(16) * (math.tau / 16)
    )
    return min(
        (way_m for point in around if (way_m := ways.distance_to(point)) is not None),
        default=math.inf,
    )


# --- rules and judge -------------------------------------------------------------------------


def take_best(candidates: Sequence[SearchCandidate]) -> SearchCandidate | None:
    """Take the best one, as the tool does."""
    return candidates[0]


def nearest_frontier(candidates: Sequence[SearchCandidate]) -> SearchCandidate | None:
    """Take the nearest frontier by path (Yamauchi, 1997), until there is none."""
    frontiers = [each for each in candidates if each.kind is CandidateKind.FRONTIER]
    return min(frontiers, key=lambda each: each.path_m, default=None)


def nearest_of_all(candidates: Sequence[SearchCandidate]) -> SearchCandidate | None:
    """Take the nearest frontier or piece of floor that was not looked at."""
    return min(candidates, key=lambda each: each.path_m)


RULES: tuple[Choose, ...] = (take_best, nearest_frontier, nearest_of_all)


def judge(task: Task, detections: Sequence[Detection]) -> Judgement:
    """Say what a model might say of a picture, by what the detector reports in it."""
    labels = {each.label for each in detections}
    if task.thing in labels:
        return Judgement(is_seen=True)
    shown = [_count_of(group, labels) for group in ROOM_KINDS]
    # Most of what is in the picture says which kind of room it is: a table stands in many.
    rooms = [group for group, n in zip(ROOM_KINDS, shown, strict=True) if n and n == max(shown)]
    is_known = any(task.kind in group for group in ROOM_KINDS)
    if not rooms or not is_known:
        return Judgement(is_seen=False)
    is_like = any(task.kind in group for group in rooms)
    return Judgement(is_seen=False, likely=NEAR_ITS_LIKE if is_like else AMONG_OTHERS)


def _count_of(group: Sequence[str], labels: set[str]) -> int:
    return sum(find_kind(kind).label in labels for kind in group)


# --- one run ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What came of a search.

    Attributes:
        is_success: The thing was found.
        driven_m: Until it was seen, or the search ended.
        spl: Success weighted by path length.
        n_looks: Pictures judged.
    """

    is_success: bool
    driven_m: float
    spl: float
    n_looks: int


async def search(task: Task, rule: Choose) -> Run:
    """Search once, as a model does that answers what the judge says."""
    simulation = Simulation(task.world, seed=task.seed)
    robot = SimulatedRobot(simulation, has_detector=True)
    n_looks, judgement = 0, Judgement()
    with tempfile.TemporaryDirectory() as folder:
        session = Session(robot, SemanticMapStore(Path(folder) / "map.yaml"), lease_s=math.inf)
        searcher = Searcher(session, choose=rule)
        for _ in range(MOST_CALLS):
            standing = await searcher.advance(
                task.thing, judgement, BUDGET, wait_s=WAIT_S, on_trip=_tell_nobody
            )
            judgement = Judgement()
            if standing.state.is_end:
                break
            if standing.state.shows_picture:
                n_looks += 1
                searcher.note_picture(await robot.fetch_picture())
                judgement = judge(task, await robot.fetch_detections())
                if judgement.is_seen:
                    break
    return _score(task, simulation, is_seen=judgement.is_seen or False, n_looks=n_looks)


def _score(task: Task, simulation: Simulation, *, is_seen: bool, n_looks: int) -> Run:
    # The simulated detector reports nothing that is not truly in the picture.
    driven_m = simulation.truth.driven_m
    ways = measure_from(simulation.truth.floor, simulation.truth.pose.point)
    whole_m = driven_m + way_to_nearest(task.world, task.kind, ways)
    spl = task.shortest_m / max(whole_m, task.shortest_m) if is_seen else 0.0
    return Run(is_success=is_seen, driven_m=driven_m, spl=spl, n_looks=n_looks)


async def _tell_nobody(_report: DriveReport) -> None:
    """Nobody waits for news."""


# --- all runs --------------------------------------------------------------------------------


def measure() -> Iterator[Figure]:
    """Return success and SPL of all rules, with bootstrap intervals, and of the differences."""
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder:
        tasks = [choose_task(w, seed) for w in build_worlds(Path(folder)) for seed in SEEDS]
    runs = {rule: [anyio.run(search, task, rule) for task in tasks] for rule in RULES}
    for rule, own in runs.items():
        name = rule.__name__.replace("_", " ")
        yield from _with_interval(f"{name}, SPL", [run.spl for run in own])
        yield from _with_interval(f"{name}, success", [float(run.is_success) for run in own])
        looks = statistics.fmean(run.n_looks for run in own)
        yield Figure(name=f"{name}, pictures judged", value=looks, unit="")
    ours = runs[take_best]
    for rule in RULES[1:]:
        gains = [a.spl - b.spl for a, b in zip(ours, runs[rule], strict=True)]
        name = f"SPL beyond {rule.__name__.replace('_', ' ')} (target: all above 0)"
        yield from _with_interval(name, gains)


def _with_interval(name: str, values: list[float]) -> Iterator[Figure]:
    """Return a mean and the ends of its 95 % bootstrap interval."""
    sample = np.random.default_rng(3).choice(np.array(values), (N_RESAMPLES, len(values)))
    low, high = np.percentile(sample.mean(axis=1), (2.5, 97.5)).tolist()
    yield Figure(name=name, value=statistics.fmean(values), unit="")
    yield Figure(name=f"{name}, 95 % from", value=low, unit="")
    yield Figure(name=f"{name}, 95 % to", value=high, unit="")


@click.command()
@click.option("--seeds", "n_seeds", default=len(SEEDS), show_default=True, help="Starts.")
def main(n_seeds: int) -> None:
    """Show every search by every rule."""
    cv2.setNumThreads(1)
    table = Table("world", "seed", "thing", "shortest m", *(rule.__name__ for rule in RULES))
    with tempfile.TemporaryDirectory() as folder:
        for world in build_worlds(Path(folder)):
            for seed in range(n_seeds):
                task = choose_task(world, seed)
                runs = [anyio.run(search, task, rule) for rule in RULES]
                told = [f"{r.driven_m:.0f} m, {r.n_looks} looks, SPL {r.spl:.2f}" for r in runs]
                table.add_row(world.name, str(seed), task.thing, f"{task.shortest_m:.1f}", *told)
    Console().print(table)


if __name__ == "__main__":
    main()
