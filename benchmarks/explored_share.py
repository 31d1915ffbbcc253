"""How true the told share of explored floor is, and what frontiers promise, look by look.

The 14 shipped worlds are explored goal by goal from two starts each. At every look the share told
is set against the share of seeable floor that is on the map in truth. `promises` is known floor
over known floor and all that frontiers promise; `told` is what mapspeak tells. Its two numbers are
also fitted on a grid without one building after the other, and judged on that building: of the
pairs with which `known_percent: 95` ends at 97 % of the floor or more on average, the one with the
least mean difference, too much counting twice. A fall is of .05 points and more.
"""

import itertools
import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.exploration import CELL_M, Truth, choose_start, known_ratio
from benchmarks.figure import Figure
from benchmarks.growing_rooms import load_looks
from mapspeak.geometry import Point
from mapspeak.simulator import TrueFloor, load_world, world_names
from mapspeak.spatial.frontiers.frontier import MOST_BEYOND, estimate_known_ratio

__all__ = ["measure"]

SEEDS = range(2)
END_RATIO, LEAST_END_RATIO = 0.95, 0.97
FALL_RATIO = 0.0005
MOST_PROMISES = 2
"""So many frontiers of each look are held to what they promise, the best ones."""
PROMISED_ONCE = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
BEYOND = (0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0)

Estimate = Callable[[float, Sequence[float]], float]
Shares = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Course:
    """One exploration.

    Attributes:
        building: Its kind: worlds that differ in a number alone are one.
        floors_m2: Known, at each look.
        gains_m2: What each frontier promises, at each look.
        true_ratios: Of the seeable floor.
        kept: What came into view at a frontier's pose over what it promised.
    """

    building: str
    floors_m2: Shares
    gains_m2: tuple[list[float], ...]
    true_ratios: Shares
    kept: tuple[float, ...]


def load_course(name: str, seed: int) -> Course:
    """Return an exploration; explore where that has not been done yet."""
    looks = load_looks(name, seed)
    truth = Truth(TrueFloor(choose_start(load_world(name), seed)))
    kept = []
    for look in looks:
        for (x, y), gain_m2 in zip(look.borders, look.gains_m2[:MOST_PROMISES], strict=False):
            points = truth.find_in_view(Point(float(x), float(y)))
            n_new = len(points) * (1.0 - known_ratio(look.grid, points))
            kept.append(n_new * CELL_M**2 / float(gain_m2))
    return Course(
        building=name.rstrip("_0123456789") if name != "office" else name + " of the paper",
        floors_m2=np.array([look.grid.free.sum() * look.grid.resolution_m**2 for look in looks]),
        gains_m2=tuple(look.gains_m2.tolist() for look in looks),
        true_ratios=np.array([known_ratio(look.grid, truth.seeable) for look in looks]),
        kept=tuple(kept),
    )


def tell(course: Course, estimate: Estimate) -> Shares:
    """Return what is told at each look: estimated anew, and held where promises alone change."""
    told: list[float] = []
    for floor_m2, gains_m2 in zip(course.floors_m2.tolist(), course.gains_m2, strict=True):
        most_ratio = floor_m2 / (floor_m2 + max(gains_m2, default=0.0))
        told.append(max(estimate(floor_m2, gains_m2), min(told[-1] if told else 0.0, most_ratio)))
    return np.array(told)


def sum_promises(course: Course) -> Shares:
    """Return the known share by the promises alone."""
    promised_m2 = np.array([sum(each) for each in course.gains_m2])
    return np.asarray(course.floors_m2 / (course.floors_m2 + promised_m2))


def estimate_by(once_ratio: float, beyond_ratio: float) -> Estimate:
    """Return the estimate with other numbers."""

    def estimate(floor_m2: float, gains_m2: Sequence[float]) -> float:
        gains = np.array(gains_m2)
        factors = once_ratio + np.minimum(beyond_ratio * gains / floor_m2, MOST_BEYOND)
        return float(floor_m2 / (floor_m2 + (gains * factors).sum()))

    return estimate


def find_end(course: Course, told: Shares) -> float:
    """Return how much was known in truth when so much was told that `known_percent: 95` ends it."""
    return float(course.true_ratios[int(np.argmax(np.append(told, 1.0)[:-1] >= END_RATIO))])


def fit(courses: Sequence[Course], told: Sequence[Sequence[Shares]]) -> int:
    """Return which rule fits some explorations best, by what each tells in each of them."""

    def cost(rule: Sequence[Shares]) -> tuple[bool, float]:
        ends = [find_end(*each) for each in zip(courses, rule, strict=True)]
        offs = [own - each.true_ratios for each, own in zip(courses, rule, strict=True)]
        costs = [float((np.abs(off) + off.clip(0.0)).mean()) for off in offs]
        return statistics.fmean(ends) < LEAST_END_RATIO, statistics.fmean(costs)

    return min(range(len(told)), key=lambda number: cost(told[number]))


def _figures(rule: str, courses: Sequence[Course], told: Sequence[Shares]) -> Iterator[Figure]:
    offs = [own - each.true_ratios for each, own in zip(courses, told, strict=True)]
    steps = np.concatenate([np.diff(own) for own in told])
    falls = -steps[steps <= -FALL_RATIO]
    ends = [find_end(*each) for each in zip(courses, told, strict=True)]
    yield Figure(name=f"{rule}: falls", value=len(falls), unit="")
    yield Figure(name=f"{rule}: mean fall", value=float(falls.mean()) if falls.size else 0, unit="")
    yield Figure(name=f"{rule}: largest fall", value=float(falls.max(initial=0.0)), unit="")
    off = statistics.fmean(float(np.abs(each).mean()) for each in offs)
    yield Figure(name=f"{rule}: off the truth, mean of explorations", value=off, unit="")
    most = statistics.fmean(float(each.max()) for each in offs)
    yield Figure(name=f"{rule}: most above the truth, mean of explorations", value=most, unit="")
    value = max(float(each.max()) for each in offs)
    yield Figure(name=f"{rule}: most above the truth of all", value=value, unit="")
    yield Figure(name=f"{rule}: known where 95 % ends it", value=statistics.fmean(ends), unit="")
    yield Figure(name=f"{rule}: known where 95 % ends it, least", value=min(ends), unit="")


def measure() -> Iterator[Figure]:
    """Return how far what is told is from the truth, by three rules, and what promises were."""
    cv2.setNumThreads(1)
    courses = [load_course(name, seed) for name in world_names() for seed in SEEDS]
    yield Figure(name="explorations", value=len(courses), unit="")
    yield Figure(name="looks", value=sum(len(each.floors_m2) for each in courses), unit="")
    yield from _figures("promises", courses, [sum_promises(each) for each in courses])
    own = [tell(each, estimate_known_ratio) for each in courses]
    yield from _figures("told", courses, own)
    rules = [
        [tell(each, estimate_by(*numbers)) for each in courses]
        for numbers in itertools.product(PROMISED_ONCE, BEYOND)
    ]
    left_out = []
    for number, course in enumerate(courses):
        others = [at for at, each in enumerate(courses) if each.building != course.building]
        best = fit([courses[at] for at in others], [[rule[at] for at in others] for rule in rules])
        left_out.append(rules[best][number])
    yield from _figures("fitted without the building", courses, left_out)
    for name, first in zip(world_names(), range(0, len(courses), len(SEEDS)), strict=True):
        kept = [ratio for each in courses[first : first + len(SEEDS)] for ratio in each.kept]
        value = statistics.median(kept)
        yield Figure(name=f"{name}: came of what was promised, median", value=value, unit="")
