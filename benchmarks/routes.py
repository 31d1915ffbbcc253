"""How many routes are as short as they can be, of those on which the nearest choice is wrong.

Things of a few kinds are remembered all over a map, and routes name kinds in order. The truth is
brute force: every choice of places, measured with path lengths of the benchmark's own. Only routes
count on which taking the nearest place each time costs at least a metre more.
"""

import itertools
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from benchmarks.figure import Figure
from benchmarks.relations.sites import Site, build_sites
from benchmarks.relations.truth import Truth, away
from mapspeak.driving.routes.ordering import RouteOrder
from mapspeak.driving.routes.planning import RoutePlan, plan_route
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace

__all__ = ["measure"]

KINDS = ("extinguisher", "printer", "bench", "socket")
N_PLACES = 12
N_ROUTES = 50
N_STOPS = (3, 5)
N_ORDERED = (7, 12)
N_ORDERS = 10
MOST_BRUTE = 7
LEAST_DETOUR_M = 1.0
SAME_RATIO, SAME_M = 0.01, 0.1
"""Two computations of one path differ by no more than this."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A route and what is true of it.

    Attributes:
        stops: The words.
        best_m: Of all choices, the shortest.
        greedy_m: Taking the nearest place each time.
    """

    stops: tuple[str, ...]
    best_m: float
    greedy_m: float


class Ways:
    """The path lengths between the robot, number 0, and the places of a site."""

    def __init__(self, truth: Truth, points: Sequence[Point]) -> None:
        at = [int(np.argmin(away(point, truth.places))) for point in points]
        self._metres = np.array([truth.paths_m(point)[at] for point in points])

    def length_m(self, numbers: Sequence[int]) -> float:
        """Return the whole way past some places, from the robot on."""
        legs = itertools.pairwise((0, *numbers))
        return math.fsum(float(self._metres[leg]) for leg in legs)

    def nearest(self, here: int, numbers: Sequence[int]) -> int:
        """Return the nearest of some places."""
        return min(numbers, key=lambda number: float(self._metres[here, number]))


def measure() -> Iterator[Figure]:
    """Return how many of the routes came out as short as brute force finds."""
    cv2.setNumThreads(1)
    n_right, n_all, saved_m, took_ms = 0, 0, 0.0, []
    sites = list(build_sites())
    for number, site in enumerate(sites):
        n_wanted = N_ROUTES * (number + 1) // len(sites) - N_ROUTES * number // len(sites)
        for is_right, case, took in _judge_site(site, seed=number, n_wanted=n_wanted):
            n_right, n_all = n_right + is_right, n_all + 1
            saved_m += case.greedy_m - case.best_m
            took_ms.append(1e3 * took)
    yield Figure(name="routes on which greedy choice fails", value=n_all, unit="")
    yield Figure(name="as short as brute force", value=n_right, unit="routes")
    yield Figure(name="saved against greedy choice, mean", value=saved_m / n_all, unit="m")
    yield Figure(name="one plan, median", value=sorted(took_ms)[len(took_ms) // 2], unit="ms")
    for n_stops in N_ORDERED:
        yield from _measure_orders(sites, n_stops)


def _measure_orders(sites: Sequence[Site], n_stops: int) -> Iterator[Figure]:
    """Compare the whole ways past drawn stops: ordered, as given, by the nearest, and the best."""
    ordered_m, given_m, nearest_m, best_m, took_ms = 0.0, 0.0, 0.0, 0.0, []
    for world, ways, generator in map(_prepare, sites):
        reached = [n for n, place in enumerate(world.places, 1) if _is_reached(world, place)]
        for _ in range(N_ORDERS if len(reached) >= n_stops else 0):
            numbers = [int(n) for n in generator.choice(reached, n_stops, replace=False)]
            stops = [f"W{number}" for number in numbers]
            started_s = time.process_time()
            plan = plan_route(world, stops, order=RouteOrder.SHORTEST)
            took_ms.append(1e3 * (time.process_time() - started_s))
            ordered_m += ways.length_m([int(each.goal.name[1:]) for each in plan.stops])
            given_m += ways.length_m(numbers)
            nearest_m += ways.length_m(_order_by_nearest(ways, numbers))
            if n_stops <= MOST_BRUTE:
                best_m += min(map(ways.length_m, itertools.permutations(numbers)))
    name = f"{n_stops} stops"
    yield Figure(name=f"{name}: ordered, of the way as given", value=ordered_m / given_m, unit="")
    yield Figure(name=f"{name}: by the nearest each time", value=nearest_m / given_m, unit="")
    if best_m:
        yield Figure(name=f"{name}: ordered, of the best", value=ordered_m / best_m, unit="")
    yield Figure(
        name=f"{name}: a plan, median", value=sorted(took_ms)[len(took_ms) // 2], unit="ms"
    )


def _is_reached(world: WorldModel, place: RememberedPlace) -> bool:
    return world.path_m(place.waypoint.pose.point) is not None


def _prepare(site: Site) -> tuple[WorldModel, Ways, np.random.Generator]:
    generator = np.random.default_rng(77)
    truth = Truth(site)
    poses, kinds = _spread(truth, generator)
    site = replace(site, memory=_remember(poses, kinds))
    world = WorldModel(site.grid, site.robot, site.memory, radius_m=site.radius_m)
    return world, Ways(truth, [site.robot.point, *(pose.point for pose in poses)]), generator


def _order_by_nearest(ways: Ways, numbers: Sequence[int]) -> list[int]:
    ahead, order = list(numbers), [0]
    while ahead:
        order.append(ways.nearest(order[-1], ahead))
        ahead.remove(order[-1])
    return order[1:]


def _judge_site(site: Site, *, seed: int, n_wanted: int) -> Iterator[tuple[bool, Case, float]]:
    generator = np.random.default_rng(seed)
    truth = Truth(site)
    poses, kinds = _spread(truth, generator)
    site = replace(site, memory=_remember(poses, kinds))
    ways = Ways(truth, [site.robot.point, *(pose.point for pose in poses)])
    world = WorldModel(site.grid, site.robot, site.memory, radius_m=site.radius_m)
    for case in itertools.islice(_find_cases(ways, kinds, generator), n_wanted):
        started_s = time.process_time()
        plan = plan_route(world, case.stops)
        took_s = time.process_time() - started_s
        yield _is_right(ways, plan, case), case, took_s


def _spread(truth: Truth, generator: np.random.Generator) -> tuple[list[Pose], list[str]]:
    clear = truth.clear_m[truth.standable] >= truth.site.radius_m + 0.1
    chosen = generator.choice(np.flatnonzero(clear), size=N_PLACES, replace=False)
    poses = [Pose(float(x), float(y)) for x, y in truth.places[chosen]]
    return poses, [KINDS[number % len(KINDS)] for number in range(N_PLACES)]


def _remember(poses: Sequence[Pose], kinds: Sequence[str]) -> SemanticMap:
    return SemanticMap(
        waypoints=tuple(
            Waypoint(name=f"place {number}", pose=pose, safety_landmarks=(Landmark(label=kind),))
            for number, (pose, kind) in enumerate(zip(poses, kinds, strict=True))
        )
    )


def _find_cases(ways: Ways, kinds: Sequence[str], generator: np.random.Generator) -> Iterator[Case]:
    """Draw routes until greedy choice fails; without end, as such routes are common."""
    numbers = {kind: [n + 1 for n, each in enumerate(kinds) if each == kind] for kind in KINDS}
    seen: set[tuple[str, ...]] = set()
    for _ in range(2000):
        n_stops = int(generator.integers(N_STOPS[0], N_STOPS[1] + 1))
        stops = [str(kind) for kind in generator.choice(KINDS, size=n_stops)]
        if generator.random() < 0.5:
            stops[-1] = f"W{generator.integers(1, N_PLACES + 1)}"
        if any(one == other for one, other in itertools.pairwise(stops)):
            continue
        choices = [numbers.get(stop, [int(stop[1:])] if stop[0] == "W" else []) for stop in stops]
        best_m = min(map(ways.length_m, itertools.product(*choices)))
        greedy_m = ways.length_m(_choose_greedily(ways, choices))
        if greedy_m >= best_m + LEAST_DETOUR_M and tuple(stops) not in seen:
            seen.add(tuple(stops))
            yield Case(stops=tuple(stops), best_m=best_m, greedy_m=greedy_m)


def _choose_greedily(ways: Ways, choices: Sequence[Sequence[int]]) -> list[int]:
    chosen = [0]
    for numbers in choices:
        chosen.append(ways.nearest(chosen[-1], numbers))
    return chosen[1:]


def _is_right(ways: Ways, plan: RoutePlan, case: Case) -> bool:
    """Return True where the route chosen is as short as can be, by the benchmark's own measure."""
    length_m = ways.length_m([int(each.goal.name[1:]) for each in plan.stops])
    is_shortest = length_m <= case.best_m * (1 + SAME_RATIO) + SAME_M
    is_told = abs(plan.total_m - length_m) <= length_m * SAME_RATIO * 2 + 2 * SAME_M
    return is_shortest and is_told
