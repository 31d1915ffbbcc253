"""What distinguishes each frontier of a ranking from the others, in few words."""

import dataclasses
from collections.abc import Sequence

from mapspeak.spatial.frontiers.frontier import Frontier

__all__ = ["with_reasons"]

MOST_SIGNS = 59
LEAST_DETOUR_M = 2.0
"""A round that grows by less is as short as another."""


def with_reasons(
    ranked: Sequence[Frontier], detours_m: Sequence[float | None], rates: Sequence[float]
) -> list[Frontier]:
    """Gives frontiers in their order, each with what sets it apart.

    Args:
        ranked: Best first.
        detours_m: By how much the round through all grows that begins with each; None where that
            was not reckoned.
        rates: New floor per metre of way.
    """
    if len(ranked) == 1:
        return [dataclasses.replace(ranked[0], reason="the only one")]
    best_rate, most_m2 = max(rates, default=0.0), max((f.gain_m2 for f in ranked), default=0.0)
    least_m = min((each.distance_m for each in ranked), default=0.0)
    reasoned = []
    for index, frontier in enumerate(ranked):
        clauses = [
            *(["best"] if index == 0 else []),
            *(["most to see per metre"] if rates[index] == best_rate else []),
            *(["most to see"] if frontier.gain_m2 == most_m2 and rates[index] < best_rate else []),
            *(["nearest"] if frontier.distance_m == least_m else []),
            _on_round(detours_m[index]),
        ]
        reasoned.append(dataclasses.replace(frontier, reason=_joined(clauses)))
    return reasoned


def _on_round(detour_m: float | None) -> str:
    if detour_m is None:
        return "little to see per metre"
    if detour_m < LEAST_DETOUR_M:
        return "on the way"
    return f"going first costs {detour_m:.0f} m more in all"


def _joined(clauses: Sequence[str]) -> str:
    """Gives the clauses as one; where it gets too long, those before the last make way."""
    *others, last = clauses
    while others and len(", ".join([*others, last])) > MOST_SIGNS:
        others.pop()
    return ", ".join([*others, last])
