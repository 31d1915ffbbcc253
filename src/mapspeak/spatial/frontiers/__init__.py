"""Frontiers between known floor and the unknown, and viewpoints to look beyond them."""

from mapspeak.spatial.frontiers.frontier import (
    Frontier,
    FrontierMerit,
    FrontierReport,
    FrontierVerdict,
    RefusalReason,
    RefusedFrontier,
    match_frontiers,
)
from mapspeak.spatial.frontiers.judging import find_frontiers, rerank_frontiers
from mapspeak.spatial.frontiers.viewpoints import remaining_ratio

__all__ = [
    "Frontier",
    "FrontierMerit",
    "FrontierReport",
    "FrontierVerdict",
    "RefusalReason",
    "RefusedFrontier",
    "find_frontiers",
    "match_frontiers",
    "remaining_ratio",
    "rerank_frontiers",
]
