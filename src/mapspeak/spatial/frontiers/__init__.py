"""Where known floor meets the unknown, and where to go to look beyond."""

from mapspeak.spatial.frontiers.find import find_frontiers, rerank_frontiers
from mapspeak.spatial.frontiers.frontier import (
    Frontier,
    FrontierReport,
    FrontierVerdict,
    RefusalReason,
    RefusedFrontier,
)
from mapspeak.spatial.frontiers.identity import match_frontiers
from mapspeak.spatial.frontiers.progress import remaining_ratio

__all__ = [
    "Frontier",
    "FrontierReport",
    "FrontierVerdict",
    "RefusalReason",
    "RefusedFrontier",
    "find_frontiers",
    "match_frontiers",
    "remaining_ratio",
    "rerank_frontiers",
]
