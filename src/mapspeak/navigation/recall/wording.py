"""Why something was found, and how far to trust the answer, in words."""

from collections.abc import Iterator, Sequence

from mapspeak.navigation.recall.answer import RecallCandidate
from mapspeak.semantic.retrieval import (
    Answer,
    Basis,
    Candidate,
    EntryKind,
    MatchEvidence,
    Verdict,
)

__all__ = ["SURE_RATIO", "say_advice", "say_evidence"]

SURE_RATIO = 0.98
"""A thing that two good views agree on is surer than that, and one view alone is not."""
DOUBTFUL_RATIO = 0.5
LONGEST_QUOTE = 120


def say_evidence(found: Candidate) -> str:
    """Gives why a candidate is one: its name, its meaning, or which words stand where."""
    match found.basis:
        case Basis.NAME:
            return f"called {_quote(found.text)}"
        case Basis.MEANING:
            return f"its {found.field} {_quote(found.text)} is like it in meaning"
        case Basis.WORDS:
            return "; ".join(_say_words(found.evidence)) or f"its {found.field}"


def _say_words(evidence: Sequence[MatchEvidence]) -> Iterator[str]:
    """Gives each text once that says words of the request, with these words."""
    words_of: dict[str, list[str]] = {}
    for each in evidence:
        is_same = each.query_word.casefold() == each.found_word.casefold()
        said = each.found_word if is_same else f"{each.found_word} for {each.query_word}"
        words_of.setdefault(f"its {each.field} {_quote(each.text)}", []).append(said)
    for text, words in words_of.items():
        yield f"{text} says {', '.join(words)}"


def _quote(text: str) -> str:
    line = " ".join(text.split())
    return f'"{line[:LONGEST_QUOTE]}"'


def say_advice(answer: Answer, candidates: Sequence[RecallCandidate], *, n_searched: int) -> str:
    """Gives the verdict in words, with what to do next.

    Args:
        answer: What the search says.
        candidates: Those that are shown, the likeliest first.
        n_searched: How many places and things were searched.
    """
    if not n_searched:
        return (
            "Not remembered: nothing passes these filters, or nothing is remembered at all. Leave "
            "filters out, or search_for it."
        )
    match answer.verdict:
        case Verdict.NOT_REMEMBERED:
            nearest = f"; the nearest is {_name(candidates[0])}" if candidates else ""
            return (
                f"Not remembered{nearest}, which is probably not meant. Say it in other words, or "
                "look for it with search_for."
            )
        case Verdict.AMBIGUOUS:
            return _say_ambiguous(answer, candidates)
        case Verdict.FOUND:
            return _say_found(candidates[0])


def _say_found(first: RecallCandidate) -> str:
    said = f"Found: {_name(first)}."
    if first.problem:
        return f"{said} But the robot cannot go there: {first.problem}"
    if first.trust.ratio < DOUBTFUL_RATIO:
        return f"{said} It is doubtful: look before you rely on it. navigate_to takes {first.id}."
    if first.kind is EntryKind.THING and first.position is None:
        return f"{said} Where it is was not noted; navigate_to {first.id} goes where it was seen."
    if first.kind is EntryKind.THING and first.trust.ratio < SURE_RATIO:
        return (
            f"{said} Likely, not sure: it was not seen from several sides. navigate_to takes "
            f"{first.id}."
        )
    return f"{said} navigate_to takes {first.id}."


def _say_ambiguous(answer: Answer, candidates: Sequence[RecallCandidate]) -> str:
    first = candidates[0]
    if answer.candidates[0].basis is Basis.NAME:
        nearest = f"; {first.id} is the nearest by path" if first.path_m is not None else ""
        return (
            f"Ambiguous: {answer.n_meant} are called so{nearest}. Choose by room, or ask which is "
            "meant, then navigate_to its id."
        )
    return (
        f"Ambiguous: nothing is called so; the likeliest is {_name(first)}. Look at why each is "
        "listed, and navigate_to an id only if it fits; else say it in other words."
    )


def _name(candidate: RecallCandidate) -> str:
    return f'{candidate.id} "{candidate.name[:LONGEST_QUOTE]}"'
