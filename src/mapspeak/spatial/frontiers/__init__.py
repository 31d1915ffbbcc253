"""Frontiers between known floor and the unknown, and viewpoints to look beyond them."""

from mapspeak.spatial.frontiers.frontier import (
    Frontier,
    FrontierMerit,
    FrontierReport,
    FrontierVerdict,
    RefusalReason,
    RefusedFrontier,
    estimate_known_ratio,
    match_frontiers,
)
from mapspeak.spatial.frontiers.gaps import (
    NOTHING_TRIED,
    ProvedGap,
    Tried,
    find_proved_gap,
)
from mapspeak.spatial.frontiers.judging import find_frontiers, rerank_frontiers
from mapspeak.spatial.frontiers.viewpoints import remaining_ratio

__all__ = [
    "NOTHING_TRIED",
    "Frontier",
    "FrontierMerit",
    "FrontierReport",
    "FrontierVerdict",
    "ProvedGap",
    "RefusalReason",
    "RefusedFrontier",
    "Tried",
    "estimate_known_ratio",
    "find_frontiers",
    "find_proved_gap",
    "match_frontiers",
    "remaining_ratio",
    "rerank_frontiers",
]
