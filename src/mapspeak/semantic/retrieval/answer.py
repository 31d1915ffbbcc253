"""What a search says: candidates with their evidence, and how far to trust the first."""

from dataclasses import dataclass
from enum import StrEnum

from mapspeak.semantic.retrieval.entry import Entry
from mapspeak.semantic.retrieval.evidence import MatchEvidence, MatchField
from mapspeak.semantic.waypoint import name_key

__all__ = ["Answer", "Basis", "Candidate", "Thresholds", "Verdict"]


class Verdict(StrEnum):
    """How far an answer may be trusted.

    Likely: one fits, but what is remembered of it is not sure. A search of words alone never says
    that; who knows the views of a thing does.
    """

    FOUND = "found"
    LIKELY = "likely"
    AMBIGUOUS = "ambiguous"
    NOT_REMEMBERED = "not_remembered"


class Basis(StrEnum):
    """What speaks for a candidate: its name, what it means, or the words said of it."""

    NAME = "name"
    MEANING = "meaning"
    WORDS = "words"


@dataclass(frozen=True, slots=True, kw_only=True)
class Thresholds:
    """How likenesses are judged; each way of comparing has a scale of its own.

    How sure an answer is, is the first candidate's score, plus how far it is ahead of the first
    that is called otherwise.

    Attributes:
        least_ratio: Surer than that something may be meant; else it is not remembered.
        sure_ratio: As sure as that the first candidate's kind is the one meant.
        same_ratio: Scores no further apart are as good as equal.
    """

    least_ratio: float
    sure_ratio: float
    same_ratio: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """Something that a request may mean.

    Attributes:
        entry: The place or thing.
        score_ratio: How alike it and the request are; 1 for its very name.
        basis: What the score compares.
        field: Which part of the record is most like the request.
        text: What stands there.
        evidence: The words of the request that the record says.
    """

    entry: Entry
    score_ratio: float
    basis: Basis
    field: MatchField
    text: str
    evidence: tuple[MatchEvidence, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What is remembered of a request.

    Attributes:
        query: The request, as it was given.
        understood: The same with misspelt words put right.
        verdict: How far to trust the first candidate. Where nothing is remembered the candidates
            are only the nearest things, and probably none of them is meant.
        candidates: The likeliest first.
        n_meant: How many, of all that is remembered, fit as well as the first.
        limits: What the search could not do, in words; None where nothing was missing.
    """

    query: str
    understood: str
    verdict: Verdict
    candidates: tuple[Candidate, ...]
    n_meant: int
    limits: str | None = None

    @property
    def is_one_kind(self) -> bool:
        """Whether all listed candidates that fit equally well are called the same."""
        meant = self.candidates[: self.n_meant]
        return len({name_key(candidate.entry.name) for candidate in meant}) == 1
