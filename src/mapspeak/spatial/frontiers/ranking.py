"""Which frontier first: much to see soon, without having to come back for the rest."""

from collections.abc import Sequence

import numpy as np

from mapspeak.spatial.frontiers.frontier import Frontier, WaysBetween
from mapspeak.spatial.frontiers.reasons import with_reasons
from mapspeak.spatial.frontiers.rounds import find_shortest_rounds, find_ways_between
from mapspeak.spatial.frontiers.terrain import Terrain

__all__ = ["gain_rate", "rank"]

N_WEIGHED = 9
"""The round is reckoned through so many frontiers, the most promising ones; others come after."""
DETOUR_WORTH_M2 = 0.5
"""A metre that has to be driven later, to come back, is worth this much new floor now."""
STOP_M = 0.5
"""What a stop costs beside the way to it."""


def gain_rate(gain_m2: float, distance_m: float) -> float:
    """Gives the square metres that come into view per metre of way."""
    return gain_m2 / (distance_m + STOP_M)


def rank(
    terrain: Terrain, frontiers: Sequence[Frontier], known_ways: WaysBetween | None = None
) -> tuple[list[Frontier], WaysBetween]:
    """Gives frontiers in the order in which to think of them, each with its reason.

    Gain per metre of way is what shows most of a building soon. It leaves corners behind, though,
    so the metres by which the round through all frontiers grows are set against the gain.

    Args:
        terrain: The map, seen from where the robot is.
        frontiers: In any order.
        known_ways: Between frontiers of the same map; used if they are those that matter.

    Returns:
        The frontiers, and the ways between those that were weighed.
    """
    by_rate = sorted(frontiers, key=lambda each: -gain_rate(each.gain_m2, each.distance_m))
    weighed, others = by_rate[:N_WEIGHED], by_rate[N_WEIGHED:]
    ways = _find_ways(terrain, weighed, known_ways)
    detours_m = _detours_m(weighed, ways)
    scores = [_score(each, detour_m) for each, detour_m in zip(weighed, detours_m, strict=True)]
    order = np.argsort(-np.array(scores), kind="stable")
    ranked = [*(weighed[index] for index in order), *others]
    reasoned = with_reasons(
        ranked,
        [*(detours_m[index] for index in order), *([None] * len(others))],
        [gain_rate(each.gain_m2, each.distance_m) for each in ranked],
    )
    return reasoned, ways


def _score(frontier: Frontier, detour_m: float) -> float:
    """Gives what is left of the gain after the detour: per metre of way, where anything is left."""
    left_m2 = frontier.gain_m2 - DETOUR_WORTH_M2 * detour_m
    return gain_rate(left_m2, frontier.distance_m) if left_m2 > 0 else left_m2


def _find_ways(
    terrain: Terrain, frontiers: list[Frontier], known: WaysBetween | None
) -> WaysBetween:
    """Gives the ways between frontiers in their order, out of known ones where these have all."""
    stops = tuple(each.pose.point for each in frontiers)
    if known is not None and set(stops) <= set(known.stops):
        picked = [known.stops.index(stop) for stop in stops]
        return WaysBetween(stops, known.metres[np.ix_(picked, picked)])
    if len(stops) < 2:
        return WaysBetween(stops, np.zeros((len(stops), len(stops))))
    return WaysBetween(stops, find_ways_between(terrain, list(stops)))


def _detours_m(frontiers: list[Frontier], ways: WaysBetween) -> list[float]:
    """Gives how much longer than the shortest round the one is that begins with each."""
    if len(frontiers) < 2:
        return [0.0] * len(frontiers)
    from_robot_m = np.array([each.distance_m for each in frontiers])
    through_robot_m = from_robot_m[:, None] + from_robot_m
    rounds_m = find_shortest_rounds(from_robot_m, np.minimum(ways.metres, through_robot_m))
    return [float(round_m - rounds_m.min()) for round_m in rounds_m]
