"""What is remembered on another map: never found, never driven to, and right once maps are aligned.

Buildings are drawn by the project's generator (MAPSPEAK_SEED is the first seed) and mapped by the
simulated robot with its own SLAM, twice from different starts: the truth is where these are, so
that the errors of SLAM count too. A third map is the first one turned and drawn anew, whose truth
is exact. Half of the records are written before the map moves and half after, before it is aligned.
"""

import math
import os
import statistics
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

import cv2
import numpy as np

from benchmarks.exploration import choose_start
from benchmarks.figure import Figure
from benchmarks.realign import WHOLE, map_world, turned
from mapspeak.errors import GoalError
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMapStore, Waypoint
from mapspeak.memory.alignment.framed import FramedMemory
from mapspeak.memory.exchange.uniting import merge_files
from mapspeak.memory.search.answer import Verdict
from mapspeak.places.asking import RecallQuery, recall
from mapspeak.places.relations.choosing import choose_goal
from mapspeak.simulator import BODY_RADIUS_M
from mapspeak.simulator.worlds.worldfiles import parse_world
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.model import WorldModel
from tools.worldgen import draw_plan

__all__ = ["measure"]

SEED = int(os.environ.get("MAPSPEAK_SEED", "31411"))
STYLES = ("flat", "office", "clinic", "workshop")
TURN = Pose(4.0, -2.5, math.radians(112))
N_RECORDS = 12
NEAR_M = 0.05
AHEAD_M = 1.0
STILL = Pose(0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Remapped:
    """A building's map, and a later one of the same building.

    Attributes:
        poses: Where records are made, on the old map.
    """

    kind: str
    old: OccupancyGrid
    new: OccupancyGrid
    new_from_old: Pose
    poses: Sequence[Pose]


@dataclass(frozen=True, slots=True)
class Told:
    """What is told and done with records of another map."""

    n_asked: int
    n_found: int
    n_goals: int


def measure() -> Iterable[Figure]:
    """Return how often places of other maps are used, and how exact they are once aligned."""
    cv2.setNumThreads(1)
    cases = [case for style in STYLES for case in _map_twice(style)]
    maps = [case.old for case in cases if case.kind == "turned"]
    with tempfile.TemporaryDirectory() as folder:
        yield from _figures_of_others(maps, Path(folder))
        for kind in dict.fromkeys(case.kind for case in cases):
            ours = [case for case in cases if case.kind == kind]
            yield from _figures_of_remapped(kind, ours, Path(folder))


def _map_twice(style: str) -> Iterator[Remapped]:
    world = parse_world(draw_plan(style, seed=SEED), name=style)
    starts = [choose_start(world, seed) for seed in (0, 1)]
    old, new = (map_world(start, seed=seed, n_drives=WHOLE) for seed, start in enumerate(starts))
    poses = _draw_poses(old)
    exact = turned(old, TURN, resolution_m=old.resolution_m)
    yield Remapped(kind="turned", old=old, new=exact, new_from_old=TURN, poses=poses)
    truth = starts[1].start.inverse() @ starts[0].start
    yield Remapped(kind="mapped anew", old=old, new=new, new_from_old=truth, poses=poses)


def _draw_poses(grid: OccupancyGrid) -> list[Pose]:
    random = np.random.default_rng(SEED)
    rows, cols = np.nonzero(grid.free)
    chosen = random.choice(len(rows), size=N_RECORDS, replace=False)
    points = grid.points_at(rows[chosen], cols[chosen]).tolist()
    return [Pose(x, y, float(random.uniform(-3, 3))) for x, y in points]


# --- records ---------------------------------------------------------------------------------


def _open(path: Path, grid: OccupancyGrid) -> FramedMemory:
    memory = FramedMemory(SemanticMapStore(path, map_id="building"))
    memory.meet(grid)
    return memory


def _write(memory: FramedMemory, poses: Iterable[Pose], *, name: str, motion: Pose) -> None:
    for number, pose in enumerate(poses):
        thing = Landmark(label=f"{name} lamp {number}", bearing_rad=0.0, range_m=AHEAD_M)
        memory.write(
            Waypoint(name=f"{name} {number}", pose=motion @ pose, functional_landmarks=(thing,))
        )


def _ask(memory: FramedMemory, grid: OccupancyGrid, names: Iterable[str]) -> Told:
    """Ask for places by their names, from the middle of the map, and for goals there."""
    rows, cols = np.nonzero(grid.free)
    here = grid.points_at(rows, cols)[len(rows) // 2]
    world = WorldModel(grid, Pose(*here.tolist()), memory.read(), radius_m=BODY_RADIUS_M)
    n_asked = n_found = n_goals = 0
    for name in names:
        answer = recall(world, RecallQuery(words=name))
        n_asked += 1
        n_found += answer.verdict in (Verdict.FOUND, Verdict.LIKELY)
        try:
            choose_goal(world, place=name, x=None, y=None, yaw_deg=None)
            n_goals += 1
        except GoalError:
            pass
    return Told(n_asked, n_found, n_goals)


def _errors_m(memory: FramedMemory, truths: dict[str, Point]) -> list[float]:
    """Return how far each record lies from where it is; infinitely where it is not told."""
    places = {each.name: each.pose.point for each in memory.read().waypoints}
    return [
        places[name].distance_to(truth) if name in places else math.inf
        for name, truth in truths.items()
    ]


# --- figures ---------------------------------------------------------------------------------


def _figures_of_others(maps: Sequence[OccupancyGrid], folder: Path) -> Iterator[Figure]:
    """Yield what becomes of memories of other buildings."""
    told, merged, n_aligned = [], [], 0
    for number, (one, other) in enumerate(permutations(maps, 2)):
        first, second = folder / f"one-{number}.yaml", folder / f"other-{number}.yaml"
        poses = _draw_poses(one)
        _write(_open(first, one), poses, name="spot", motion=STILL)
        names = [f"spot {index}" for index in range(len(poses))]
        memory = _open(first, other)
        told.append(_ask(memory, other, names))
        n_aligned += memory.keeper.realign().motion is not None
        _write(_open(second, other), _draw_poses(other), name="desk", motion=STILL)
        whole = folder / f"both-{number}.yaml"
        merge_files(first, second, out=whole)
        merged.append(_ask(_open(whole, other), other, names))
    yield from _figures_told("other building", told)
    yield Figure(name="other building: aligned all the same", value=n_aligned, unit="")
    yield from _figures_told("two buildings merged", merged)


def _figures_of_remapped(kind: str, cases: Sequence[Remapped], folder: Path) -> Iterator[Figure]:
    """Yield what becomes of memories of one building whose map has moved."""
    told, errors, back, merged, n_aligned = list[Told](), [], [], [], 0
    for number, case in enumerate(cases):
        path = folder / f"{kind}-{number}.yaml"
        early, late = case.poses[::2], case.poses[1::2]
        _write(_open(path, case.old), early, name="early", motion=STILL)
        memory = _open(path, case.new)
        _write(memory, late, name="late", motion=case.new_from_old)
        told.append(_ask(memory, case.new, [f"early {index}" for index in range(len(early))]))
        n_aligned += memory.keeper.realign().motion is not None
        points = {f"early {index}": pose.point for index, pose in enumerate(early)}
        points |= {f"late {index}": pose.point for index, pose in enumerate(late)}
        moved = {name: case.new_from_old.transform(point) for name, point in points.items()}
        errors += _errors_m(memory, moved)
        back += _errors_m(_open(path, case.old), points)
        merged += _errors_m(_merge(case, early, late, folder / f"{kind}-{number}"), moved)
    yield from _figures_told(kind, told)
    yield Figure(name=f"{kind}: aligned", value=n_aligned / len(cases), unit="share")
    yield from _figures_off(f"{kind}, realigned", errors)
    yield from _figures_off(f"{kind}, back on the old map", back)
    yield from _figures_off(f"{kind}, merged", merged)


def _merge(
    case: Remapped, early: Sequence[Pose], late: Sequence[Pose], folder: Path
) -> FramedMemory:
    """Return two robots' memories as one, as a robot on the later map sees it."""
    folder.mkdir()
    first, second, whole = (folder / f"{name}.yaml" for name in ("first", "second", "whole"))
    _write(_open(first, case.old), early, name="early", motion=STILL)
    _write(_open(second, case.new), late, name="late", motion=case.new_from_old)
    merge_files(first, second, out=whole)
    return _open(whole, case.new)


def _figures_told(kind: str, told: Sequence[Told]) -> Iterator[Figure]:
    yield Figure(name=f"{kind}: places asked for", value=sum(x.n_asked for x in told), unit="")
    yield Figure(name=f"{kind}: found or likely", value=sum(x.n_found for x in told), unit="")
    yield Figure(name=f"{kind}: goals given", value=sum(x.n_goals for x in told), unit="")


def _figures_off(kind: str, errors: Sequence[float]) -> Iterator[Figure]:
    told = sorted(error for error in errors if math.isfinite(error))
    yield Figure(name=f"{kind}: records", value=len(errors), unit="")
    yield Figure(name=f"{kind}: told", value=len(told) / len(errors), unit="share")
    if told:
        near = sum(error <= NEAR_M for error in told) / len(told)
        yield Figure(name=f"{kind}: off, median", value=statistics.median(told), unit="m")
        yield Figure(name=f"{kind}: off, worst", value=told[-1], unit="m")
        yield Figure(name=f"{kind}: within 5 cm", value=near, unit="share of those told")
