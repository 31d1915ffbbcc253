"""Finding a named thing: remembered places first, then where most that is unseen can be seen."""

from mapspeak.driving.search.candidates import CandidateKind, SearchCandidate
from mapspeak.driving.search.evidence import (
    Earlier,
    Opinions,
    find_company_score,
    leave_out_shown,
    speaks_of,
)
from mapspeak.driving.search.searcher import Choose, Judgement, Searcher
from mapspeak.driving.search.seenfloor import SeenFloor
from mapspeak.driving.search.standing import Budget, BudgetKind, SearchProgress, SearchState

__all__ = [
    "Budget",
    "BudgetKind",
    "CandidateKind",
    "Choose",
    "Earlier",
    "Judgement",
    "Opinions",
    "SearchCandidate",
    "SearchProgress",
    "SearchState",
    "Searcher",
    "SeenFloor",
    "find_company_score",
    "leave_out_shown",
    "speaks_of",
]
