"""The findings as one report, with its verdict in words."""

import dataclasses
from collections import Counter

from mapspeak.spatial.frontiers.frontier import (
    Frontier,
    FrontierReport,
    FrontierVerdict,
    RefusalReason,
    RefusedFrontier,
)
from mapspeak.spatial.grid import OccupancyGrid

__all__ = ["build_report"]

IN_WORDS = {
    RefusalReason.SPECKLE: "too short to be more than noise",
    RefusalReason.NO_WAY: "behind walls",
    RefusalReason.TOO_NARROW: "too narrow for the robot",
    RefusalReason.NOTHING_TO_SEE: "with next to nothing to see",
    RefusalReason.LOOKED_ALREADY: "looked at already",
}


def build_report(
    grid: OccupancyGrid, ranked: list[Frontier], refused: list[RefusedFrontier]
) -> FrontierReport:
    """Gives the report of frontiers in their order, named from F1 on."""
    verdict = _verdict(grid, ranked, refused)
    named = (
        dataclasses.replace(frontier, id=f"F{number}")
        for number, frontier in enumerate(ranked, start=1)
    )
    return FrontierReport(
        frontiers=tuple(named),
        refused=tuple(sorted(refused, key=lambda each: -each.length_m)),
        verdict=verdict,
        sentence=_sentence(verdict, ranked, refused),
        n_named=len(ranked),
    )


def _verdict(
    grid: OccupancyGrid, ranked: list[Frontier], refused: list[RefusedFrontier]
) -> FrontierVerdict:
    if ranked:
        return FrontierVerdict.SOME_LEFT
    if refused:
        return FrontierVerdict.ALL_REFUSED
    return FrontierVerdict.NONE_LEFT if grid.free.any() else FrontierVerdict.NOTHING_KNOWN


def _sentence(
    verdict: FrontierVerdict, ranked: list[Frontier], refused: list[RefusedFrontier]
) -> str:
    if verdict is FrontierVerdict.NOTHING_KNOWN:
        return "No free floor is known yet."
    if verdict is FrontierVerdict.NONE_LEFT:
        return "No frontier is left: all known floor ends at walls."
    if verdict is FrontierVerdict.ALL_REFUSED:
        return f"No frontier is left to go to; refused are {_refusals(refused)}."
    others = f"; refused are {_refusals(refused)}" if refused else ""
    return f"{len(ranked)} frontier{'s' if len(ranked) > 1 else ''} to go to{others}."


def _refusals(refused: list[RefusedFrontier]) -> str:
    by_reason = Counter(each.reason for each in refused)
    return ", ".join(f"{n} {IN_WORDS[reason]}" for reason, n in by_reason.most_common())
