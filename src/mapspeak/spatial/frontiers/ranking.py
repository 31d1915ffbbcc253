"""Which frontier first."""

import dataclasses

from mapspeak.spatial.frontiers.frontier import Frontier
from mapspeak.spatial.paths.distances import DistanceField

__all__ = ["gain_rate", "rank"]


def gain_rate(gain_m2: float, distance_m: float) -> float:
    """Gives the square metres that come into view per metre of way."""
    return gain_m2 / (distance_m + 0.5)


def rank(distances: DistanceField, frontiers: list[Frontier]) -> list[Frontier]:
    """Gives frontiers in the order in which to think of them, each with its reason."""
    ranked = sorted(frontiers, key=lambda f: -gain_rate(f.gain_m2, f.distance_m))
    return [
        dataclasses.replace(f, reason=f"{f.gain_m2:.0f} m2 in sight, {f.distance_m:.1f} m away")
        for f in ranked
    ]
