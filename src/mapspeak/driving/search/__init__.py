"""Finding a named thing: remembered places first, then where most that is unseen can be seen."""

from mapspeak.driving.search.candidates import Candidate, CandidateKind
from mapspeak.driving.search.evidence import (
    Earlier,
    Opinions,
    find_company_score,
    leave_out_shown,
    speaks_of,
)
from mapspeak.driving.search.searcher import Choose, Judgement, Searcher
from mapspeak.driving.search.seenfloor import SeenFloor
from mapspeak.driving.search.standing import Budget, BudgetKind, SearchState, Standing

__all__ = [
    "Budget",
    "BudgetKind",
    "Candidate",
    "CandidateKind",
    "Choose",
    "Earlier",
    "Judgement",
    "Opinions",
    "SearchState",
    "Searcher",
    "SeenFloor",
    "Standing",
    "find_company_score",
    "leave_out_shown",
    "speaks_of",
]
