"""A search in words: why a call ended, and what earlier pictures count for."""

from mapspeak.driving.search.candidates import CandidateKind, SearchCandidate
from mapspeak.driving.search.evidence import Earlier
from mapspeak.driving.search.progress import BudgetKind, SearchProgress, SearchState
from mapspeak.server.text.exploration import say_trip_end

STATES = {
    SearchState.DRIVING: "The robot is on its way.",
    SearchState.LOOK: "The robot looks at a new place.",
    SearchState.NOT_FOUND: "There is nowhere left to look.",
    SearchState.INTERRUPTED: "The drive was ended.",
}


def say_standing(standing: SearchProgress) -> str:
    """Say why a call of a search ended as it did, and what is new since the call before."""
    earlier = "" if standing.earlier is None else _say_earlier(standing.earlier)
    anew = "Nothing new is left: what only earlier pictures showed is looked at anew."
    told = (_say_state(standing), earlier, anew if standing.looks_anew else "")
    return " ".join(filter(None, told))


def _say_state(standing: SearchProgress) -> str:
    match standing.state:
        case SearchState.REPORTED:
            return f"The robot's detector reports {standing.label}."
        case SearchState.FOUND:
            return f"{standing.thing} was found."
        case SearchState.INTERRUPTED if said := say_trip_end(standing.trip_end):
            return said
        case SearchState.BUDGET_SPENT:
            return _say_spent(standing)
    return STATES[standing.state]


def _say_spent(standing: SearchProgress) -> str:
    if standing.spent is BudgetKind.LOOKS:
        return f"{standing.budget.n_looks} pictures were looked at."
    return f"{standing.budget.driven_m:.0f} m were driven."


def _say_earlier(earlier: Earlier) -> str:
    """Say what earlier pictures count for; nothing where there were none."""
    told = []
    if earlier.looks:
        told.append(f"{len(earlier.looks)} earlier pictures count as looked at, and had none")
    if earlier.reporting:
        ids = ", ".join(each.id for each in earlier.reporting)
        told.append(f"the detector reported it in {ids}")
    if earlier.n_unread:
        told.append(f"{earlier.n_unread} earlier pictures do not count: nobody looked for it then")
    said = "; ".join(told)
    return f"{said[:1].upper()}{said[1:]}." if said else ""


def say_candidate(candidate: SearchCandidate) -> str:
    """Say where the robot could look, and why there, with numbers."""
    return f"{candidate.id}: {_say_why(candidate)}"


def _say_why(candidate: SearchCandidate) -> str:
    away = f"{candidate.path_m:.1f} m away"
    if candidate.kind is CandidateKind.REMEMBERED:
        is_thing = candidate.id.startswith("T")
        what = "thing that is remembered" if is_thing else "remembered place"
        return f"a {what} speaks of it, {away}"
    if candidate.kind is CandidateKind.PICTURED:
        return f"the detector reported it in this picture, {away}"
    what = "unknown or unseen floor" if candidate.frontier else "floor not looked at yet"
    liking = "" if candidate.score == 0.5 else f", score {candidate.score:.2f}"
    return f"{candidate.area_m2:.1f} m2 of {what}, {away}{liking}"
