"""Compares the words of a phrase with those of many records, rare words counting more."""

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.semantic.retrieval.evidence import (
    FIELD_WEIGHTS,
    KIND_WEIGHTS,
    MatchEvidence,
    MatchField,
    MatchKind,
)
from mapspeak.semantic.retrieval.spelling import Vocabulary
from mapspeak.semantic.retrieval.words import content_words, split_words

__all__ = ["Asked", "Texts", "WordIndex"]

Texts = Sequence[tuple[MatchField, str]]
"""What a record says, each text with the part of the record it is."""


@dataclass(frozen=True, slots=True)
class Asked:
    """A word of the phrase.

    Attributes:
        shown: As it stands there.
        spellings: The words of the records that count as this one, the likeliest misspelt first.
        weight: The rarer in the records, the more.
        is_doubtful: Whether neither records nor language know the word as it is spelt.
    """

    shown: str
    spellings: dict[str, MatchKind]
    weight: float
    is_doubtful: bool

    @property
    def corrected(self) -> str:
        """The word as it should have been spelt, where it counts as misspelt."""
        is_misspelt = MatchKind.MISSPELT in self.spellings.values()
        return next(iter(self.spellings)) if is_misspelt else self.shown


class WordIndex:
    """The words of records, each with the numbers of the records that say it.

    Args:
        records: What each record says.
        is_known: Whether it is a word of the language, and so not a misspelt one.
    """

    def __init__(
        self, records: Sequence[Texts], *, is_known: Callable[[str], bool] = lambda _: False
    ) -> None:
        self._records = records
        weights: dict[str, dict[int, float]] = defaultdict(dict)
        # Many records say the same.
        words_of: dict[str, list[str]] = {}
        for number, texts in enumerate(records):
            for field, text in texts:
                if text not in words_of:
                    words_of[text] = [word for _, word in split_words(text)]
                for word in words_of[text]:
                    least = weights[word].get(number, 0.0)
                    weights[word][number] = max(least, FIELD_WEIGHTS[field])
        self._postings = {
            word: (np.array(list(found)), np.array(list(found.values())))
            for word, found in weights.items()
        }
        self._vocabulary = Vocabulary(self._postings, is_known=is_known)

    def ask(self, phrase: str) -> tuple[Asked, ...]:
        """Gives the words of a phrase that say what is meant, and what the records have of them."""
        found = []
        for shown, compared in content_words(phrase):
            spellings = self._vocabulary.find_spellings(compared)
            n_with = sum(len(self._postings[spelling][0]) for spelling in spellings)
            weight = math.log1p(len(self._records) / max(n_with, 1))
            is_doubtful = self._vocabulary.is_doubtful(compared)
            found.append(Asked(shown, spellings, weight, is_doubtful))
        return tuple(found)

    def score_ratios(self, asked: Sequence[Asked]) -> NDArray[np.float64]:
        """Gives, for each record, how much of a phrase it says; rare words count more."""
        return self._score_ratios(asked, KIND_WEIGHTS)

    def said_ratios(self, asked: Sequence[Asked]) -> NDArray[np.float64]:
        """Gives the same where a part of a longer word counts as nothing."""
        return self._score_ratios(asked, KIND_WEIGHTS | {MatchKind.PART: 0.0})

    def _score_ratios(
        self, asked: Sequence[Asked], kind_weights: Mapping[MatchKind, float]
    ) -> NDArray[np.float64]:
        found = np.zeros(len(self._records))
        for word in asked:
            best = np.zeros(len(self._records))
            for spelling, kind in word.spellings.items():
                numbers, weights = self._postings[spelling]
                best[numbers] = np.maximum(best[numbers], weights * kind_weights[kind])
            found += word.weight * best
        return found / max(sum(word.weight for word in asked), 1e-9)

    def explain(self, asked: Sequence[Asked], number: int) -> tuple[MatchEvidence, ...]:
        """Gives at most one finding in a record for each word of a phrase, in their order."""
        findings = (self._finding(word, number) for word in asked)
        return tuple(finding for finding in findings if finding)

    def _finding(self, asked: Asked, number: int) -> MatchEvidence | None:
        """Gives the weightiest place in a record that says a word."""
        findings = (
            MatchEvidence(
                query_word=asked.shown,
                found_word=shown,
                field=field,
                text=text,
                kind=asked.spellings[compared],
            )
            for field, text in self._records[number]
            for shown, compared in split_words(text)
            if compared in asked.spellings
        )
        return max(findings, key=lambda finding: finding.weight, default=None)
