"""What can be asked of the memory, and what comes back, with how far to trust it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime

from mapspeak.geometry import Point, Pose
from mapspeak.semantic.consistency import Trust
from mapspeak.semantic.quoting import quote
from mapspeak.semantic.retrieval import Answer, Basis, Candidate, EntryKind, MatchEvidence, Verdict
from mapspeak.semantic.waypoint import name_key

NEAR_M = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RecallQuery:
    """What is looked for among what passes every filter that is given.

    Attributes:
        words: What people say: a name, a thing, what it is for, what is the matter.
        near: Not farther than `near_m` from this point of the map frame.
        near_m: How near, straight.
        room_id: In this room or corridor.
        since: Last seen at this moment or later.
        until: Last seen before.
        kind: Only places, or only things.
        n: How many candidates, at most.
    """

    words: str
    near: Point | None = None
    near_m: float = NEAR_M
    room_id: str | None = None
    since: datetime | None = None
    until: datetime | None = None
    kind: EntryKind | None = None
    n: int = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class RecallCandidate:
    """A place or a thing that may be meant.

    Attributes:
        id: "T1" or "W1": a goal for the robot.
        kind: A place or a thing.
        name: What it is called in the memory.
        score_ratio: How alike it and the request are; 1 for its very name.
        evidence: Why it is here, in words.
        seen_from: Ids of the places that it was seen from; of a place, its own.
        pictures: That it was seen in, by their relative names.
        position: Where it is; None where nobody noted a direction.
        uncertainty_m: The radius around that which holds it with 90 %; None without a position,
            and for a place.
        room_ids: The rooms it may be in.
        pose: Where the robot would stand: of a thing, near it and facing it where it can.
        is_faced: True when it would stand near it and face it.
        faced_ratio: The share of where a thing may be that it would face there.
        problem: Why the robot cannot drive there; empty where it can.
        path_m: The way there; None where there is none.
        last_seen: By the calendar; None where nobody noted it.
        trust: How far to trust it, and why.
    """

    id: str
    kind: EntryKind
    name: str
    score_ratio: float
    evidence: str
    seen_from: tuple[str, ...]
    pictures: tuple[str, ...]
    position: Point | None
    uncertainty_m: float | None
    room_ids: tuple[str, ...]
    pose: Pose
    is_faced: bool
    faced_ratio: float
    problem: str
    path_m: float | None
    last_seen: datetime | None
    trust: Trust


@dataclass(frozen=True, slots=True, kw_only=True)
class Recall:
    """What is remembered of a request.

    Attributes:
        verdict: How far the first candidate may be taken for what is meant.
        advice: The same in words, with what to do next.
        candidates: The likeliest first; of equally likely ones the nearest by path. Where nothing
            is remembered they are the nearest in meaning, and probably none is meant.
        n_meant: How many, of all that passes the filters, fit as well as the first.
        n_searched: How many places and things pass the filters.
        understood: The request with misspelt words put right.
        limits: What the search could not do, in words; None where nothing was missing.
    """

    verdict: Verdict
    advice: str
    candidates: tuple[RecallCandidate, ...]
    n_meant: int
    n_searched: int
    understood: str
    limits: str | None


SURE_RATIO = 0.98
"""A thing that two good views agree on is surer than that, and one view alone is not."""
DOUBTFUL_RATIO = 0.5
LARGEST_OFF_M = 1.2
"""A thing whose place is known no better is not sure to be ahead of who goes there."""
LEAST_FACED_RATIO = 0.3
"""Of where a thing may be, less than that ahead is too little to promise that it will be faced."""
LONGEST_QUOTE = 120


def say_evidence(found: Candidate) -> str:
    """Gives why a candidate is one: its name, its meaning, or which words stand where."""
    match found.basis:
        case Basis.NAME:
            return f"called {quote(found.text, most=LONGEST_QUOTE)}"
        case Basis.MEANING:
            return (
                f"its {found.field} {quote(found.text, most=LONGEST_QUOTE)} is like it in meaning"
            )
        case Basis.WORDS:
            return "; ".join(_say_words(found.evidence)) or f"its {found.field}"


def _say_words(evidence: Sequence[MatchEvidence]) -> Iterator[str]:
    """Gives each text once that says words of the request, with these words."""
    words_of: dict[str, list[str]] = {}
    for each in evidence:
        is_same = each.query_word.casefold() == each.found_word.casefold()
        said = each.found_word if is_same else f"{each.found_word} for {each.query_word}"
        words_of.setdefault(f"its {each.field} {quote(each.text, most=LONGEST_QUOTE)}", []).append(
            said
        )
    for text, words in words_of.items():
        yield f"{text} says {', '.join(words)}"


def say_advice(
    answer: Answer,
    candidates: Sequence[RecallCandidate],
    *,
    n_searched: int,
    is_empty: bool,
    doubt: str,
) -> str:
    """Gives the verdict in words, with what to do next.

    Args:
        answer: What the search says.
        candidates: Those that are shown, the likeliest first.
        n_searched: How many places and things were searched.
        is_empty: Nothing is remembered at all.
        doubt: Why the first may still be wrong; empty where nothing speaks for that.
    """
    if not n_searched:
        if is_empty:
            return "Not remembered: nothing is remembered yet. Look for it with search_for."
        return "Not remembered: nothing passes these filters. Leave filters out, or search_for it."
    match answer.verdict:
        case Verdict.NOT_REMEMBERED:
            missing = answer.missing
            kind = f" (it sounds like {quote(missing)}, and none is)" if missing else ""
            first = _name(candidates[0]) if candidates else ""
            nearest = f"; the nearest is {first}, which is probably not meant" if first else ""
            return (
                f"Not remembered{kind}{nearest}. Say it in other words, or look for it with "
                "search_for."
            )
        case Verdict.AMBIGUOUS:
            return _say_ambiguous(answer, candidates)
        case Verdict.FOUND | Verdict.LIKELY:
            return _say_found(candidates[0], doubt) + _say_others(answer.n_meant - 1)


def find_doubt(first: RecallCandidate, *, room_id: str | None) -> str:
    """Gives why what was found may still be wrong, in words; empty where nothing speaks for that.

    Args:
        first: The only one that is meant.
        room_id: Where it was asked for.
    """
    doubts = _doubt_thing(first, room_id) if first.kind is EntryKind.THING else _doubt_place(first)
    return next(doubts, "")


def _doubt_place(first: RecallCandidate) -> Iterator[str]:
    if first.trust.ratio < DOUBTFUL_RATIO:
        yield "its record is doubtful"


def _doubt_thing(first: RecallCandidate, room_id: str | None) -> Iterator[str]:
    if first.position is None or first.uncertainty_m is None:
        yield "where it is was not noted"
        return
    if first.trust.ratio < DOUBTFUL_RATIO:
        yield "what was noted of it does not go together"
    if first.trust.ratio < SURE_RATIO:
        yield "no two good views of it agree so far"
    if first.uncertainty_m > LARGEST_OFF_M:
        yield f"its place is known to within {first.uncertainty_m:.1f} m only"
    if room_id is not None and set(first.room_ids) != {room_id}:
        yield f"it may be in {' or '.join(first.room_ids) or 'no room'}"
    if first.problem:
        return
    if not first.is_faced:
        yield "no place is known from which it would be in sight near by"
    elif first.faced_ratio < LEAST_FACED_RATIO:
        yield "much of where it may be would not be in sight from any place near by"


def _say_found(first: RecallCandidate, doubt: str) -> str:
    said = f"Likely {_name(first)}, not sure: {doubt}." if doubt else f"Found: {_name(first)}."
    if first.problem:
        return f"{said} But the robot cannot go there: {first.problem}"
    if doubt and first.position is None:
        return f"{said} navigate_to {first.id} goes where it was seen."
    look = "; look before you rely on it" if doubt else ""
    return f"{said} navigate_to takes {first.id}{look}."


def _say_others(n_others: int) -> str:
    """Gives a sentence for things of the name that fewer views speak for; nothing for none."""
    if not n_others:
        return ""
    are = "others are" if n_others > 1 else "other is"
    return f" {n_others} {are} called so, of which fewer views agree."


def _say_ambiguous(answer: Answer, candidates: Sequence[RecallCandidate]) -> str:
    first = candidates[0]
    if answer.candidates[0].basis is Basis.NAME:
        nearest = f"; {first.id} is the nearest by path" if first.path_m is not None else ""
        return (
            f"Ambiguous: {answer.n_meant} are called so{nearest}. Choose by room, or ask which is "
            "meant, then navigate_to its id."
        )
    kind = f" (it is more like {quote(answer.missing)})" if answer.missing else ""
    n_same = sum(name_key(each.entry.name) == name_key(first.name) for each in answer.candidates)
    of_several = f", of {n_same} the nearest by path" if n_same > 1 else ""
    return (
        f"Ambiguous: nothing is called so{kind}. The likeliest is {_name(first)}{of_several}; what "
        "is meant may also not be remembered. See why each is listed, and navigate_to an id only "
        "if it fits; else say it in other words, or search_for it."
    )


def _name(candidate: RecallCandidate) -> str:
    return f"{candidate.id} {quote(candidate.name, most=LONGEST_QUOTE)}"
