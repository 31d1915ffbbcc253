"""Finds remembered places and things by their names, by what they mean, or by the words used.

A name comes first. For all else meanings are compared where there is a model, and only words where
there is none: mixing the two found less than the model alone.
"""

import re
from collections import defaultdict
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mapspeak.semantic.retrieval.answer import Answer, Basis, Candidate, Thresholds, Verdict
from mapspeak.semantic.retrieval.embedder import TextVectors
from mapspeak.semantic.retrieval.entry import Entry
from mapspeak.semantic.retrieval.meaning import is_word
from mapspeak.semantic.retrieval.meaningindex import Likeness, MeaningIndex
from mapspeak.semantic.retrieval.spelling import LookAlikes
from mapspeak.semantic.retrieval.wordindex import Asked, WordIndex
from mapspeak.semantic.retrieval.words import content_words, stem
from mapspeak.semantic.waypoint import name_key

_Key = TypeVar("_Key")

__all__ = ["WORDS_ONLY", "EntryIndex"]

WORDS_ONLY = "The search compares words only; install mapspeak[semantic] to compare meanings."

WORD_THRESHOLDS = Thresholds(least_ratio=0.05, sure_ratio=1.1, same_ratio=0.02)
"""Chosen on the requests for tuning; benchmarks/requests/README.md says by which rule."""

_SAME_NAME, _SAME_WORDS, _SAME_WORDS_MISSPELT = 1.0, 0.99, 0.98
_MOST_WITHOUT_NAME = 0.97
"""How alike an entry and a request are whose words are the entry's name, and all others at most."""

_LEAST_NAME_LIKENESS = 0.75
"""From there on a request with a misspelt word counts as the name it looks like.

Of the requests for tuning all misspelt names are at least .75 like the right ones, and all others
with unknown words at most .69 like any.
"""


@dataclass(frozen=True, slots=True)
class _Asked:
    """A request, and how alike each entry is to it; the likeness where meanings were compared."""

    words: tuple[Asked, ...]
    ratios: NDArray[np.float64]
    likeness: Likeness | None

    def basis(self, number: int) -> Basis:
        if self.ratios[number] > _MOST_WITHOUT_NAME:
            return Basis.NAME
        return Basis.WORDS if self.likeness is None else Basis.MEANING


class EntryIndex:
    """All that is remembered, ready to be searched; built anew when anything changes.

    Args:
        entries: In any order, each with an id of its own.
        vectors: What compares meanings; None where there is no model. Given again to the next
            index, it embeds only the texts that are new.
    """

    def __init__(self, entries: Sequence[Entry], *, vectors: TextVectors | None = None) -> None:
        self._entries = sorted(entries, key=lambda entry: entry.id)
        self._words = WordIndex([entry.texts for entry in self._entries], is_known=is_word)
        self._meanings = None if vectors is None else MeaningIndex(self._entries, vectors)
        self._thresholds = WORD_THRESHOLDS if vectors is None else vectors.embedder.thresholds
        names = [entry.names for entry in self._entries]
        self._of_key = _numbers_by({name_key(name) for name in each} for each in names)
        self._of_stems = _numbers_by({_stems(name) for name in each} for each in names)
        plain = {_plain(name) for each in names for name in each}
        self._look_alikes = LookAlikes(plain - {""})

    def find(self, query: str, *, among: Container[str] | None = None, limit: int = 5) -> Answer:
        """Finds what a request may mean.

        Args:
            query: What people say: a name, a thing, what it is for, what is the matter.
            among: The ids to choose from; all where None.
            limit: How many candidates at most.
        """
        words = self._words.ask(query)
        understood = self._understand(query, words)
        asked = self._compare(query, understood, words)
        order = self._order(asked.ratios, among)
        n_meant = self._count_meant(asked, order)
        return Answer(
            query=query,
            understood=understood,
            verdict=self._judge(asked, order, n_meant),
            candidates=tuple(self._candidate(number, asked) for number in order[:limit]),
            n_meant=n_meant,
            limits=WORDS_ONLY if self._meanings is None else None,
        )

    def _understand(self, query: str, words: tuple[Asked, ...]) -> str:
        """Gives the request with its words put right, or the name that it looks like."""
        put_right = _put_right(query, words)
        if _stems(put_right) in self._of_stems or not any(word.is_doubtful for word in words):
            return put_right
        likest = self._look_alikes.find(_plain(query), least_ratio=_LEAST_NAME_LIKENESS, limit=1)
        return likest[0] if likest else put_right

    def _compare(self, query: str, understood: str, words: tuple[Asked, ...]) -> _Asked:
        likeness = None
        if self._meanings is not None and _is_in_latin_letters(understood):
            likeness = self._meanings.compare(understood)
        ratios = self._words.score_ratios(words) if likeness is None else likeness.ratios
        ratios = np.clip(ratios, 0.0, _MOST_WITHOUT_NAME)
        ratios[self._of_stems.get(_stems(understood), [])] = _SAME_WORDS_MISSPELT
        ratios[self._of_stems.get(_stems(query), [])] = _SAME_WORDS
        ratios[self._of_key.get(name_key(query), [])] = _SAME_NAME
        return _Asked(words, ratios, likeness)

    def _order(self, ratios: NDArray[np.float64], among: Container[str] | None) -> list[int]:
        """Gives the numbers of the entries that say anything of it, the likeliest first."""
        likely = np.flatnonzero(ratios > 0)
        if among is not None:
            likely = likely[[self._entries[number].id in among for number in likely]]
        order: list[int] = likely[np.argsort(-ratios[likely], kind="stable")].tolist()
        return order

    def _count_meant(self, asked: _Asked, order: list[int]) -> int:
        if not order:
            return 0
        margin = 0.0 if asked.basis(order[0]) is Basis.NAME else self._thresholds.same_ratio
        return int(np.count_nonzero(asked.ratios[order] >= asked.ratios[order[0]] - margin))

    def _judge(self, asked: _Asked, order: list[int], n_meant: int) -> Verdict:
        if not order:
            return Verdict.NOT_REMEMBERED
        if asked.basis(order[0]) is not Basis.NAME:
            sureness = asked.ratios[order[0]] + self._lead_ratio(asked.ratios, order[0])
            if sureness < self._thresholds.least_ratio:
                return Verdict.NOT_REMEMBERED
            if sureness < self._thresholds.sure_ratio:
                return Verdict.AMBIGUOUS
        return Verdict.FOUND if n_meant == 1 else Verdict.AMBIGUOUS

    def _lead_ratio(self, ratios: NDArray[np.float64], first: int) -> float:
        """Says how far one is ahead of the next of all that is remembered and called otherwise.

        Of all, also where only some may be chosen: that a sink stands in another room makes a
        toilet in this one no likelier to be meant.
        """
        name = name_key(self._entries[first].name)
        is_other = np.ones(len(ratios), dtype=bool)
        is_other[self._of_key[name]] = False
        return float(ratios[first] - ratios[is_other].max()) if is_other.any() else 0.0

    def _candidate(self, number: int, asked: _Asked) -> Candidate:
        entry, evidence = self._entries[number], self._words.explain(asked.words, number)
        basis = asked.basis(number)
        field, text = entry.texts[0]
        if basis is Basis.MEANING and asked.likeness is not None:
            field, text = asked.likeness.nearest_text(number)
        elif basis is Basis.WORDS and evidence:
            best = max(evidence, key=lambda each: each.weight)
            field, text = best.field, best.text
        return Candidate(
            entry=entry,
            score_ratio=float(asked.ratios[number]),
            basis=basis,
            field=field,
            text=text,
            evidence=evidence,
        )


def _numbers_by(keys: Iterable[Iterable[_Key]]) -> dict[_Key, list[int]]:
    numbers: dict[_Key, list[int]] = defaultdict(list)
    for number, each in enumerate(keys):
        for key in each:
            numbers[key].append(number)
    return numbers


def _put_right(query: str, words: Iterable[Asked]) -> str:
    """Gives the request with the words put right that only a misspelt word explains."""
    for word in words:
        if word.corrected != word.shown:
            query = re.sub(rf"\b{re.escape(word.shown)}\b", word.corrected, query)
    return query


def _plain(text: str) -> str:
    return " ".join(word for _, word in content_words(text))


def _stems(text: str) -> tuple[str, ...]:
    return tuple(stem(word) for _, word in content_words(text))


def _is_in_latin_letters(text: str) -> bool:
    """Whether a model of English has anything to compare."""
    return any(word.isascii() for _, word in content_words(text))
