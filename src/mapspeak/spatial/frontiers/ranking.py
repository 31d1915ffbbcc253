"""Rank frontiers: large gain soon, without having to come back for the rest."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapspeak.spatial.frontiers.frontier import Frontier, FrontierMerit, WaysBetween
from mapspeak.spatial.paths.distances import DistanceField
from mapspeak.spatial.paths.rounds import find_shortest_rounds, find_ways_between

N_WEIGHED = 9
"""Number of most promising frontiers in the computed round; others come after."""
DETOUR_WORTH_M2 = 0.5
"""A metre that has to be driven later, to come back, is worth this much new floor now."""
STOP_M = 0.5
"""Cost of a stop in addition to the way to it."""


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
    return WaysBetween(stops, find_ways_between(distances, stops))


def _detours_m(frontiers: list[Frontier], ways: WaysBetween) -> list[float]:
    """Return for each frontier how much longer the round that begins there is than the shortest."""
    if len(frontiers) < 2:
        return [0.0] * len(frontiers)
    from_robot_m = np.array([each.distance_m for each in frontiers])
    rounds_m = find_shortest_rounds(from_robot_m, ways.metres)
    return [float(round_m - rounds_m.min()) for round_m in rounds_m]
