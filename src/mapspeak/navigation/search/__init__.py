"""Finding a named thing: remembered places first, then where most that is unseen can be seen."""

from mapspeak.navigation.search.candidates import Candidate, CandidateKind
from mapspeak.navigation.search.company import find_company_score
from mapspeak.navigation.search.earlier import leave_out_shown
from mapspeak.navigation.search.opinions import Opinions
from mapspeak.navigation.search.searcher import Budget, Choose, Judgement, Searcher
from mapspeak.navigation.search.seenfloor import SeenFloor
from mapspeak.navigation.search.standing import SearchState, Standing
from mapspeak.navigation.search.words import speaks_of

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
