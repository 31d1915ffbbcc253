"""The findings as one report, with its verdict in words."""

import dataclasses
from collections import Counter

from mapspeak.spatial.frontiers.frontier import (
    Frontier,
    FrontierReport,
    FrontierVerdict,
    RefusalReason,
    RefusedFrontier,
    WaysBetween,
)
from mapspeak.spatial.frontiers.terrain import Terrain

__all__ = ["build_report"]

IN_WORDS = {
    RefusalReason.NO_WAY: "behind walls",
    RefusalReason.TOO_NARROW: "too narrow for the robot",
    RefusalReason.NOTHING_TO_SEE: "with next to nothing to see",
    RefusalReason.LOOKED_ALREADY: "looked at already",
}


def build_report(
    terrain: Terrain,
    ranked: list[Frontier],
    refused: list[RefusedFrontier],
    *,
    ways: WaysBetween,
    n_specks: int,
) -> FrontierReport:
    """Gives the report of frontiers in their order, named from F1 on."""
    verdict = _verdict(terrain, ranked, is_refused=bool(refused or n_specks))
    named = (
        dataclasses.replace(frontier, id=f"F{number}")
        for number, frontier in enumerate(ranked, start=1)
    )
    return FrontierReport(
        frontiers=tuple(named),
        refused=tuple(sorted(refused, key=lambda each: -each.length_m)),
        n_specks=n_specks,
        verdict=verdict,
        sentence=_sentence(terrain, verdict, ranked, refused),
        n_named=len(ranked),
        ways=ways,
    )


def _verdict(terrain: Terrain, ranked: list[Frontier], *, is_refused: bool) -> FrontierVerdict:
    if ranked:
        return FrontierVerdict.SOME_LEFT
    if is_refused:
        return FrontierVerdict.ALL_REFUSED
    return FrontierVerdict.NONE_LEFT if terrain.free.any() else FrontierVerdict.NOTHING_KNOWN


def _sentence(
    terrain: Terrain,
    verdict: FrontierVerdict,
    ranked: list[Frontier],
    refused: list[RefusedFrontier],
) -> str:
    if verdict is FrontierVerdict.NOTHING_KNOWN:
        return "No free floor is known yet."
    if verdict is FrontierVerdict.NONE_LEFT:
        return "No frontier is left: all known floor ends at walls."
    if not terrain.reachable.any():
        return "No frontier can be reached: no free floor with room for the robot is near it."
    if verdict is FrontierVerdict.ALL_REFUSED:
        others = _refusals(refused) or "specks too short to be more than noise"
        return f"No frontier is left to go to; refused are {others}."
    others = f"; refused are {_refusals(refused)}" if refused else ""
    return f"{len(ranked)} frontier{'s' if len(ranked) > 1 else ''} to go to{others}."


def _refusals(refused: list[RefusedFrontier]) -> str:
    by_reason = Counter(each.reason for each in refused)
    return ", ".join(f"{n} {IN_WORDS[reason]}" for reason, n in by_reason.most_common())
