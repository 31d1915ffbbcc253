"""Which words of a vocabulary count as a word that was asked for, and which texts look like one."""

import difflib
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from mapspeak.semantic.retrieval.evidence import MatchKind
from mapspeak.semantic.retrieval.words import stem

__all__ = ["LookAlikes", "Vocabulary"]

_MIN_LETTERS = 4
"""A shorter word has too many others near it."""

_MIN_LIKENESS_RATIO = 0.8
_MOST_MISSPELT = 3
_N_BUCKETS = 32
"""Letters are counted in so many; two in one bucket let more words through, never fewer."""


class LookAlikes:
    """Texts, ready to be asked for those that are spelt like another."""

    def __init__(self, texts: Iterable[str]) -> None:
        self._texts = sorted(set(texts))
        self._letters = np.array([_letters(text) for text in self._texts]).reshape(-1, _N_BUCKETS)
        self._lengths = np.array([len(text) for text in self._texts], dtype=int)

    def find(self, text: str, *, least_ratio: float, limit: int) -> list[str]:
        """Finds the texts whose spelling is at least so much like this one's, the likest first."""
        # It is the bound that difflib calls quick_ratio, for all texts at once.
        n_shared = np.minimum(self._letters, _letters(text)).sum(axis=1)
        is_like = 2 * n_shared >= least_ratio * (self._lengths + len(text))
        likely = [self._texts[number] for number in np.flatnonzero(is_like)]
        return difflib.get_close_matches(text, likely, n=limit, cutoff=least_ratio)


class Vocabulary:
    """The words of all records, ready to be asked for one of them.

    Args:
        words: As they are compared.
        is_known: Whether it is a word of the language, and so not a misspelt one.
    """

    def __init__(
        self, words: Iterable[str], *, is_known: Callable[[str], bool] = lambda _: False
    ) -> None:
        self._words = sorted(set(words))
        self._look_alikes = LookAlikes(self._words)
        self._is_known = is_known
        self._of_stem: dict[str, list[str]] = defaultdict(list)
        for word in self._words:
            self._of_stem[stem(word)].append(word)
        self._stems = sorted(self._of_stem)
        self._stems_backwards = sorted(own[::-1] for own in self._stems)

    def is_doubtful(self, word: str) -> bool:
        """Whether a word is neither one of these nor a known one, and so perhaps misspelt."""
        ways = set(self.find_spellings(word).values())
        return ways <= {MatchKind.MISSPELT} and not self._is_known(word)

    def find_spellings(self, word: str) -> dict[str, MatchKind]:
        """Finds the words that count as this one, each with how; none where no word does."""
        found = dict.fromkeys(self._of_stem.get(stem(word), ()), MatchKind.FORM)
        if word in found:
            found[word] = MatchKind.SAME
        found = dict.fromkeys(self._parts(stem(word)), MatchKind.PART) | found
        return found or dict.fromkeys(self._misspelt(word), MatchKind.MISSPELT)

    def _parts(self, asked: str) -> list[str]:
        """Gives the words that begin or end with this stem, or that it begins or ends with."""
        n = len(asked)
        if n < _MIN_LETTERS:
            return []
        begins = {asked[:end] for end in range(_MIN_LETTERS, n + 1)}
        ends = {asked[start:] for start in range(n - _MIN_LETTERS + 1)}
        stems = {own for own in begins | ends if own in self._of_stem}
        stems.update(_beginning_with(self._stems, asked))
        stems.update(own[::-1] for own in _beginning_with(self._stems_backwards, asked[::-1]))
        return sorted(word for own in stems for word in self._of_stem[own])

    def _misspelt(self, word: str) -> list[str]:
        if len(word) < _MIN_LETTERS or self._is_known(word):
            return []
        return self._look_alikes.find(word, least_ratio=_MIN_LIKENESS_RATIO, limit=_MOST_MISSPELT)


def _beginning_with(words: Sequence[str], start: str) -> Iterator[str]:
    """Gives the words that begin so, of words in order."""
    behind = (words[number] for number in range(bisect_left(words, start), len(words)))
    return takewhile(lambda word: word.startswith(start), behind)


def _letters(word: str) -> NDArray[np.int64]:
    return np.bincount([ord(letter) % _N_BUCKETS for letter in word], minlength=_N_BUCKETS)
