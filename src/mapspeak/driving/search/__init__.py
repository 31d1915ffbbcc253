"""Finding a named thing: remembered places first, then where most that is unseen can be seen."""

from mapspeak.driving.search.candidates import Candidate, CandidateKind
from mapspeak.driving.search.company import find_company_score
from mapspeak.driving.search.earlier import leave_out_shown
from mapspeak.driving.search.opinions import Opinions
from mapspeak.driving.search.searcher import Budget, Choose, Judgement, Searcher
from mapspeak.driving.search.seenfloor import SeenFloor
from mapspeak.driving.search.standing import SearchState, Standing
from mapspeak.driving.search.words import speaks_of

__all__ = [
    "Budget",
    "Candidate",
    "CandidateKind",
    "Choose",
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
