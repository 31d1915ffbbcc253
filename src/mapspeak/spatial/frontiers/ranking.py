"""Rank frontiers: large gain soon, without having to come back for the rest."""

import functools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.frontiers.frontier import Frontier, FrontierMerit, WaysBetween
from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.paths.distances import DistanceField
from mapspeak.spatial.paths.lattice import moves_within
from mapspeak.spatial.paths.wavefront import Seeds, spread

N_WEIGHED = 9
"""Number of most promising frontiers in the computed round; others come after."""
DETOUR_WORTH_M2 = 0.5
"""A metre that has to be driven later, to come back, is worth this much new floor now."""
STOP_M = 0.5
"""Cost of a stop in addition to the way to it."""
MOST_CELLS = 4_000_000
"""Limit of cells in memory for waves that spread together."""


def gain_rate(gain_m2: float, distance_m: float) -> float:
    """Return the square metres that come into view per metre of way."""
    return gain_m2 / (distance_m + STOP_M)


def rank(
    distances: DistanceField, frontiers: Sequence[Frontier], known_ways: WaysBetween | None = None
) -> tuple[list[Frontier], WaysBetween]:
    """Return frontiers in order of preference, each with its merits.

    Gain per metre of way shows most of a building soon, but leaves corners behind. So the growth of
    the round through all frontiers, in metres, is subtracted from the gain.

    Args:
        known_ways: Between frontiers of the same map; used if they cover those compared.

    Returns:
        The frontiers, and the ways between those compared.
    """
    by_rate = sorted(frontiers, key=lambda each: -gain_rate(each.gain_m2, each.distance_m))
    weighed, others = by_rate[:N_WEIGHED], by_rate[N_WEIGHED:]
    ways = _find_ways(distances, weighed, known_ways)
    detours_m = _detours_m(weighed, ways)
    scores = []
    for frontier, detour_m in zip(weighed, detours_m, strict=True):
        left_m2 = frontier.gain_m2 - DETOUR_WORTH_M2 * detour_m
        scores.append(gain_rate(left_m2, frontier.distance_m) if left_m2 > 0 else left_m2)
    order = np.argsort(-np.array(scores), kind="stable")
    ranked = [
        *(replace(weighed[index], detour_m=detours_m[index]) for index in order),
        *(replace(frontier, detour_m=None) for frontier in others),
    ]
    return _with_merits(ranked), ways


def _with_merits(ranked: Sequence[Frontier]) -> list[Frontier]:
    """Return frontiers in their order, each with its merits."""
    if len(ranked) == 1:
        return [replace(ranked[0], merits=(FrontierMerit.ONLY,))]
    rates = [gain_rate(frontier.gain_m2, frontier.distance_m) for frontier in ranked]
    best_rate = max(rates, default=0.0)
    most_m2 = max((frontier.gain_m2 for frontier in ranked), default=0.0)
    least_m = min((frontier.distance_m for frontier in ranked), default=0.0)
    found = []
    for index, (frontier, rate) in enumerate(zip(ranked, rates, strict=True)):
        has = {
            FrontierMerit.BEST: index == 0,
            FrontierMerit.MOST_PER_METRE: rate == best_rate,
            FrontierMerit.MOST_TO_SEE: frontier.gain_m2 == most_m2 and rate < best_rate,
            FrontierMerit.NEAREST: frontier.distance_m == least_m,
        }
        merits = tuple(merit for merit, is_true in has.items() if is_true)
        found.append(replace(frontier, merits=merits))
    return found


def _find_ways(
    distances: DistanceField, frontiers: list[Frontier], known: WaysBetween | None
) -> WaysBetween:
    """Return the ways between frontiers in their order, from known ones if these have all."""
    stops = tuple(each.pose.point for each in frontiers)
    if known is not None and set(stops) <= set(known.stops):
        picked = [known.stops.index(stop) for stop in stops]
        return WaysBetween(stops, known.metres[np.ix_(picked, picked)])
    if len(stops) < 2:
        return WaysBetween(stops, np.zeros((len(stops), len(stops))))
    return WaysBetween(stops, find_ways_between(distances, list(stops)))


def _detours_m(frontiers: list[Frontier], ways: WaysBetween) -> list[float]:
    """Return for each frontier how much longer the round that begins there is than the shortest."""
    if len(frontiers) < 2:
        return [0.0] * len(frontiers)
    from_robot_m = np.array([each.distance_m for each in frontiers])
    through_robot_m = from_robot_m[:, None] + from_robot_m
    rounds_m = find_shortest_rounds(from_robot_m, np.minimum(ways.metres, through_robot_m))
    return [float(round_m - rounds_m.min()) for round_m in rounds_m]


def find_ways_between(distances: DistanceField, stops: list[Point]) -> FloatArray:
    """Return the lengths of ways between reachable places, shape (n, n), in metres.

    They are estimates, on the coarsest cells at which walls, widened by the robot's radius on both
    sides, do not vanish.
    """
    grid = distances.grid
    factor = max(int(distances.radius_m / math.sqrt(2) / grid.resolution_m), 1)
    rows, cols = grid.cells_at(np.array([[stop.x, stop.y] for stop in stops]))
    # The way through the robot's own position joins any two of them, so no way is longer.
    from_robot_m = distances.distances_at(rows, cols)
    reach = math.ceil(float(from_robot_m.max()) / grid.resolution_m) + 1
    window = grid.window(rows, cols, margin=reach)
    coarse = _coarser(distances.reachable[window], factor)
    cells: IntArray = np.ravel_multi_index(
        ((rows - window[0].start) // factor, (cols - window[1].start) // factor), coarse.shape
    )
    at_once = max(MOST_CELLS // coarse.size, 1)
    ways = [
        _spread_together(coarse, cells[start : start + at_once], cells)
        for start in range(0, cells.size, at_once)
    ]
    return np.concatenate(ways) * factor * grid.resolution_m


def _spread_together(distances: Mask, starts: IntArray, goals: IntArray) -> FloatArray:
    """Return the ways in cells from each start to all goals, shape (starts, goals).

    Each wave spreads on its own copy of the floor; the copies are stacked, as the number of steps
    determines the time.
    """
    n_copies = len(starts)
    moves = np.tile(moves_within(distances), (n_copies, 1))
    first = np.arange(n_copies) * distances.size
    seeds = Seeds(first + starts, np.zeros(n_copies, dtype=np.float32))
    ends = first[:, None] + goals
    costs = spread(moves, None, seeds, goals=ends.ravel())
    return np.asarray(costs[ends], dtype=np.float64)


def find_shortest_rounds(from_start_m: FloatArray, between_m: FloatArray) -> FloatArray:
    """Return for each stop the length of the shortest way that passes it first and then all others.

    Exact, by dynamic programming over sets of stops (Held and Karp, 1962); for a dozen at most.

    Args:
        from_start_m: To each of n stops, shape (n,).
        between_m: From stop to stop, shape (n, n).
    """
    n_stops = len(from_start_m)
    bits = 1 << np.arange(n_stops)
    rest_m = np.full((1 << n_stops, n_stops), np.inf)
    rest_m[bits, np.arange(n_stops)] = 0.0
    visited = np.arange(1 << n_stops)
    n_visited = ((visited[:, None] & bits) != 0).sum(axis=1)
    for n_left in range(2, n_stops + 1):
        for first, bit in enumerate(bits):
            sets = visited[(n_visited == n_left) & (visited & bit != 0)]
            rest_m[sets, first] = (between_m[first] + rest_m[sets ^ bit]).min(axis=1)
    return np.asarray(from_start_m + rest_m[-1], dtype=np.float64)


def _coarser(mask: Mask, factor: int) -> Mask:
    """Return the mask in cells of factor by factor; true where one of them was."""
    n_rows, n_cols = mask.shape
    padded = np.pad(mask, ((0, -n_rows % factor), (0, -n_cols % factor)))
    parts = (padded[down::factor, right::factor] for down, right in np.ndindex(factor, factor))
    return functools.reduce(np.logical_or, parts)
