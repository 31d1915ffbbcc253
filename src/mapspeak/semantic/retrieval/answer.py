"""What a search says: candidates with their evidence, and how far to trust the first."""

import math
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.semantic.retrieval.entry import Entry
from mapspeak.semantic.retrieval.evidence import MatchEvidence, MatchField

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

    How sure an answer is, is how alike the request and what is said of the first candidate are,
    plus how far that is ahead of the first that is called otherwise.

    Attributes:
        least_ratio: Surer than that something may be meant; else it is not remembered.
        sure_ratio: As sure as that the first candidate's kind is the one meant.
        same_ratio: Scores no further apart are as good as equal.
        absent_ratio: Where a kind of thing that is not remembered is so much more like a request
            than anything that is, that kind is meant; never where infinite.
    """

    least_ratio: float
    sure_ratio: float
    same_ratio: float
    absent_ratio: float = math.inf


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
        said_ratio: How much of the request the record says word for word; rare words and names
            count more, parts of words nothing.
    """

    entry: Entry
    score_ratio: float
    basis: Basis
    field: MatchField
    text: str
    evidence: tuple[MatchEvidence, ...]
    said_ratio: float


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
        is_sure: Whether what is meant is called as the first is, however many of it there are.
        limits: What the search could not do, in words; None where nothing was missing.
        missing: A kind of thing that is not remembered and more like the request than anything
            that is; None where there is none, or no model to compare them.
    """

    query: str
    understood: str
    verdict: Verdict
    candidates: tuple[Candidate, ...]
    n_meant: int
    is_sure: bool
    limits: str | None = None
    missing: str | None = None

    def find_speaking(self, *, least_said_ratio: float) -> tuple[Candidate, ...]:
        """Gives the candidates that are surely meant, or that say enough of the request."""
        n_sure = self.n_meant if self.is_sure else 0
        return tuple(
            each
            for number, each in enumerate(self.candidates)
            if number < n_sure or each.said_ratio >= least_said_ratio
        )
