"""Which things are one: neighbours told apart by a number, and one thing under several names.

Neighbours: four like things in a row on a wall, seen from two places before each; every direction
is off by 6 degrees (standard deviation), and no range is told. As the baseline the same looks name
four things that have nothing in common. Synonyms: drawn buildings that nothing was chosen on
(MAPSPEAK_SEED), each thing seen from three places as `benchmarks.memory` has it, one label in five
another word for the same, from a list that was written without looking at the product's. As the
baseline the same looks without other words. By an eye that errs as people do, and by a detector.
"""

import math
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from benchmarks.figure import Figure
from benchmarks.memory.observer import DETECTOR, NOISY, Eye, Memory, observe
from benchmarks.memory.sites import Site
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.memory.things.finding import find_things
from mapspeak.places.asking import RecallQuery, recall
from mapspeak.simulator.worlds.worldfiles import parse_world
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.recollection import Recollector
from tools.worldgen import draw_plan, style_names

__all__ = ["measure"]

SEED = int(os.environ.get("MAPSPEAK_SEED", "61903"))
N_ROUNDS = 12
APART_M = (0.8, 1.2)
BEARING_NOISE_RAD = math.radians(6)
HALF_VIEW_RAD = math.radians(45)
WALL_Y_M, STAND_Y_M = 4.0, 1.8
ROOM_M = (10.0, 4.0)
RESOLUTION_M = 0.05
FOUND_M = 0.6
MARKED = MappingProxyType(
    {
        "numbers": tuple(f"charger {number}" for number in range(1, 5)),
        "letters": tuple(f"gate {letter}" for letter in "ABCD"),
        "codes": ("pump P1", "pump P2", "pump P3", "pump P4"),
        "unlike names": ("kettle", "bicycle", "globe", "trophy"),
    }
)
SYNONYM_RATIO = 0.2
SYNONYMS = MappingProxyType(
    {
        "fire extinguisher": ("extinguisher",),
        "first-aid box": ("first aid kit",),
        "exit sign": ("emergency exit sign",),
        "fire hose reel": ("hose reel",),
        "eye wash station": ("eyewash",),
        "traffic cone": ("safety cone", "pylon"),
        "loaded shelf": ("storage rack", "shelving unit"),
        "pallet": ("skid",),
        "ladder": ("stepladder",),
        "charging dock": ("charging station", "docking station"),
        "forklift": ("fork truck", "lift truck"),
        "desk": ("writing desk",),
        "office chair": ("desk chair", "swivel chair"),
        "filing cabinet": ("file cabinet",),
        "sofa": ("couch", "settee"),
        "potted plant": ("plant", "houseplant"),
        "whiteboard": ("dry erase board",),
        "printer": ("copier",),
        "fridge": ("refrigerator",),
        "coffee machine": ("coffee maker",),
        "sink": ("washbasin", "basin"),
        "toilet": ("lavatory",),
        "trash bin": ("waste bin", "dustbin", "garbage can"),
    }
)


def measure() -> Iterable[Figure]:
    """Return how often neighbours are told apart, and how many things too many there are."""
    for what, labels in MARKED.items():
        for apart_m in APART_M:
            yield _measure_neighbours(what, labels, apart_m=apart_m)
    yield from _measure_synonyms()


# --- neighbours ------------------------------------------------------------------------------


def _measure_neighbours(what: str, labels: Sequence[str], *, apart_m: float) -> Figure:
    answers = [
        right
        for number in range(N_ROUNDS)
        for sees_all in (False, True)
        for right in _ask_all(labels, apart_m, np.random.default_rng(SEED + number), sees_all)
    ]
    name = f"{what} {apart_m} m apart: first and in place, of {len(answers)}"
    return Figure(name=name, value=100 * sum(answers) / len(answers), unit="%")


def _ask_all(
    labels: Sequence[str],
    apart_m: float,
    random: np.random.Generator,
    sees_all: bool,  # noqa: FBT001 - as measured
) -> Iterator[bool]:
    middle = (len(labels) - 1) / 2
    at = {
        label: Point(ROOM_M[0] / 2 + (i - middle) * apart_m, WALL_Y_M)
        for i, label in enumerate(labels)
    }
    waypoints = [
        _look(label, at, side_m, random, sees_all) for label in labels for side_m in (-0.6, 0.6)
    ]
    world = WorldModel(
        _draw_room(),
        Pose(1.0, 1.0),
        SemanticMap(waypoints=tuple(waypoints)),
        radius_m=0.2,
        recollector=Recollector(lambda: None),
    )
    for label, place in at.items():
        first = recall(world, RecallQuery(words=label)).candidates[:1]
        is_called = bool(first) and first[0].name == label
        point = first[0].position if first else None
        yield is_called and point is not None and point.distance_to(place) <= FOUND_M


def _look(
    label: str,
    at: dict[str, Point],
    side_m: float,
    random: np.random.Generator,
    sees_all: bool,  # noqa: FBT001 - as measured
) -> Waypoint:
    pose = Pose(at[label].x + side_m, STAND_Y_M, math.pi / 2)
    seen = [
        Landmark(label=each, bearing_rad=off_rad + BEARING_NOISE_RAD * random.normal())
        for each, point in at.items()
        if abs(off_rad := math.remainder(pose.point.bearing_to(point) - pose.yaw_rad, math.tau))
        <= HALF_VIEW_RAD
        and (sees_all or each == label)
    ]
    return Waypoint(name=f"before {label} {side_m:+}", pose=pose, functional_landmarks=tuple(seen))


def _draw_room() -> OccupancyGrid:
    n_cols, n_rows = (round(side_m / RESOLUTION_M) + 2 for side_m in ROOM_M)
    cells = np.full((n_rows, n_cols), 100, dtype=np.int8)
    cells[1:-1, 1:-1] = 0
    corner = Pose(-RESOLUTION_M, -RESOLUTION_M)
    return OccupancyGrid(cells=cells, resolution_m=RESOLUTION_M, origin=corner)


# --- synonyms --------------------------------------------------------------------------------


def _measure_synonyms() -> Iterator[Figure]:
    for eye, most, seen_by in ((NOISY, 10, "a noisy eye"), (DETECTOR, 5, "a detector")):
        yield from _measure_surplus(eye, f"seen three times by {seen_by} ({most} at most)")


def _measure_surplus(eye: Eye, seen: str) -> Iterator[Figure]:
    counts: Counter[str] = Counter()
    for style in style_names():
        site = Site(parse_world(draw_plan(style, seed=SEED), name=style))
        memory = observe(site, seed=SEED, has_ranges=True, eye=eye)
        counts["things"] += len(memory.annotated)
        counts["one name"] += _count_surplus(site, memory, memory.places, {})
        renamed = _with_synonyms(memory, np.random.default_rng(SEED))
        counts["synonyms"] += _count_surplus(site, memory, *renamed)
    for what in ("one name", "synonyms"):
        name = f"{what}: things too many, of {counts['things']} {seen}"
        yield Figure(name=name, value=100 * counts[what] / counts["things"], unit="%")


def _with_synonyms(
    memory: Memory, random: np.random.Generator
) -> tuple[SemanticMap, dict[tuple[str, Landmark], Landmark]]:
    """Return the records with other words, and of each such landmark the one that it was."""
    before: dict[tuple[str, Landmark], Landmark] = {}

    def renamed(name: str, landmark: Landmark) -> Landmark:
        others = SYNONYMS.get(landmark.label, ())
        if not others or random.random() >= SYNONYM_RATIO:
            return landmark
        other = replace(landmark, label=others[int(random.integers(len(others)))])
        before[name, other] = landmark
        return other

    waypoints = [
        replace(
            each,
            safety_landmarks=tuple(renamed(each.name, seen) for seen in each.safety_landmarks),
            functional_landmarks=tuple(
                renamed(each.name, seen) for seen in each.functional_landmarks
            ),
        )
        for each in memory.places.waypoints
    ]
    return SemanticMap(waypoints=tuple(waypoints)), before


def _count_surplus(
    site: Site,
    memory: Memory,
    places: SemanticMap,
    before: dict[tuple[str, Landmark], Landmark],
) -> int:
    """Count the things beyond the first that right views of one true thing were made of."""
    n_of: Counter[int] = Counter()
    for thing in find_things(places, site.grid).things:
        votes: Counter[int] = Counter()
        for view in thing.supporting:
            landmark = before.get((view.waypoint, view.landmark), view.landmark)
            if (view.waypoint, landmark) not in memory.wrong:
                votes[id(memory.truth[view.waypoint, landmark])] += 1
        if votes:
            n_of[votes.most_common(1)[0][0]] += 1
    return sum(number - 1 for number in n_of.values())
