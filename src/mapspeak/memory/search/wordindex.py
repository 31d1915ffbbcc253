"""Compare the words of a phrase with those of many records, rare words counting more."""

import difflib
import math
import re
import unicodedata
from bisect import bisect_left, insort
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import resources
from itertools import chain, takewhile

import numpy as np
from numpy.typing import NDArray

from mapspeak.memory.policy import words_of
from mapspeak.memory.search.answer import (
    FIELD_WEIGHTS,
    KIND_WEIGHTS,
    MatchEvidence,
    MatchField,
    MatchKind,
)

MOST_KEPT = 65_536
"""So many texts are taken apart once."""


@cache
def read_wordpieces() -> tuple[str, ...]:
    """Read the pieces once, in the order of their numbers; they never change."""
    text = (
        resources.files("mapspeak.memory")
        .joinpath("data/wordpieces.txt")
        .read_text(encoding="utf-8")
    )
    return tuple(text.split("\n")[:-1])


@cache
def read_words() -> frozenset[str]:
    """Read the words in small letters without accents that are a piece as a whole."""
    return frozenset(read_wordpieces())


_ENDING = re.compile(r"(?<=\w)['\u2019](?:d|ll|m|re|s|t|ve)\b", re.IGNORECASE)
"""Contracted endings in "I'm", "where's" and "won't"."""


def split_words(text: str) -> Iterator[tuple[str, str]]:
    """Return each word as written and as compared: small letters without accents."""
    for shown in re.findall(r"\w+", text):
        yield shown, shown.lower() if shown.isascii() else without_accents(shown)


SENTENCES = frozenset(
    {MatchField.DESCRIPTION, MatchField.FEATURE, MatchField.NOTE, MatchField.PLACE}
)
"""Parts of a record written in sentences; elsewhere "no entry" may be a name."""
_DENIED = re.compile(
    r"\b(?:no|without|neither|nor) (?:(?:an?|any|the|other) )?[^\W\d]\w*(?: (?!or\b)[^\W\d]\w*)?"
    r"(?: or (?:an? |any )?[^\W\d]\w*)*",
    re.IGNORECASE,
)
"""Negations: "no bin", "without a sink or a mirror"."""


def _without_denied(field: MatchField, text: str) -> str:
    """Return a text without the things it negates, so that they are not found by it."""
    return _DENIED.sub(" ", text) if field in SENTENCES else text


def without_endings(text: str) -> str:
    """Return a text without what is contracted: "I like" of "I'd like"."""
    return _ENDING.sub("", text)


def without_accents(word: str) -> str:
    """Return a text in small letters without accents."""
    letters = unicodedata.normalize("NFKD", word.casefold())
    return "".join(letter for letter in letters if not unicodedata.combining(letter))


def content_words(text: str) -> Iterator[tuple[str, str]]:
    """Return the words that matter, without "the", "where's" and "take me to"."""
    words, fillers = list(split_words(without_endings(text))), words_of("fillers")
    for number, (shown, word) in enumerate(words, 1):
        # "Aisle A" is not any aisle.
        tells_apart = len(word) == 1 and 1 < number == len(words)
        if tells_apart or word not in fillers:
            yield shown, word


@lru_cache(maxsize=MOST_KEPT)
def content_stems(text: str) -> tuple[str, ...]:
    """Return the stems of the words that matter."""
    return tuple(stem(word) for _, word in content_words(text))


_AMERICAN = {"is": "iz", "our": "or", "tre": "ter"}
_BRITISH = re.compile(r"(?<=\w\w\w)(?:is(?=(?:e[drs]?|ers|ing|ation)$)|our(?=s?$)|tre(?=s?$))")
"""Endings as in "sanitiser", "colour" and "centre"."""


@lru_cache(maxsize=MOST_KEPT)
def stem(word: str) -> str:
    """Cut an English ending off: plural, -ing, -ed, -er, a last e; spelt as in the US."""
    word = _BRITISH.sub(lambda found: _AMERICAN[found[0]], word)
    if len(word) > 4 and word.endswith("ies"):
        word = word[:-3] + "y"
    elif len(word) > 4 and word.endswith(("ses", "xes", "zes", "ches", "shes")):
        word = word[:-2]
    elif len(word) > 3 and word.endswith("s") and not word.endswith("ss"):
        word = word[:-1]
    for ending, n_left in (("ing", 3), ("ed", 3), ("er", 5)):
        if word.endswith(ending) and len(word) - len(ending) >= n_left:
            word = word.removesuffix(ending)
            return word[:-1] if word[-1] == word[-2] and word[-1] not in "ls" else word
    return word.removesuffix("e") if len(word) > 3 else word


MIN_LETTERS = 4
"""Shorter words are too similar to many others."""

MIN_LIKENESS_RATIO = 0.8
_MOST_MISSPELT = 3
_N_BUCKETS = 32
"""Buckets for counting letters; two letters in one let more words through, never fewer."""


class LookAlikes:
    """Index of texts by similar spelling."""

    def __init__(self, texts: Iterable[str]) -> None:
        self._texts = sorted(set(texts))
        self._letters = np.array([_letters(text) for text in self._texts]).reshape(-1, _N_BUCKETS)
        self._lengths = np.array([len(text) for text in self._texts], dtype=int)

    def find(self, text: str, *, least_ratio: float, limit: int) -> list[str]:
        """Find the texts with at least a given similarity of spelling, the most similar first."""
        # It is the bound that difflib calls quick_ratio, for all texts at once.
        n_shared = np.minimum(self._letters, _letters(text)).sum(axis=1)
        is_like = 2 * n_shared >= least_ratio * (self._lengths + len(text))
        likely = [self._texts[number] for number in np.flatnonzero(is_like)]
        return difflib.get_close_matches(text, likely, n=limit, cutoff=least_ratio)


class Vocabulary:
    """Index of the words of all records."""

    def __init__(self, words: Iterable[str] = ()) -> None:
        self._of_stem: dict[str, list[str]] = {}
        self._stems: list[str] = []
        self._stems_backwards: list[str] = []
        self._look_alikes: LookAlikes | None = None
        for word in sorted(set(words)):
            self.add(word)

    def add(self, word: str) -> None:
        """Add a word that it has not."""
        own = stem(word)
        if own not in self._of_stem:
            insort(self._stems, own)
            insort(self._stems_backwards, own[::-1])
        insort(self._of_stem.setdefault(own, []), word)
        self._look_alikes = None

    def remove(self, word: str) -> None:
        """Remove a word that it has."""
        own = stem(word)
        self._of_stem[own].remove(word)
        if not self._of_stem[own]:
            del self._of_stem[own]
            del self._stems[bisect_left(self._stems, own)]
            del self._stems_backwards[bisect_left(self._stems_backwards, own[::-1])]
        self._look_alikes = None

    def is_doubtful(self, word: str) -> bool:
        """Whether a word is neither one of these nor a known one, and so perhaps misspelt."""
        ways = set(self.find_spellings(word).values())
        return ways <= {MatchKind.MISSPELT} and word not in read_words()

    def find_spellings(self, word: str) -> dict[str, MatchKind]:
        """Find the words that count as this one, each with the kind of match."""
        # To sit on no site: who strips an e for "using" finds other words, too.
        strangers = (word + "e", word.removesuffix("e") if word.endswith("e") else "")
        alike = (each for each in self._of_stem.get(stem(word), ()) if each not in strangers)
        found = dict.fromkeys(alike, MatchKind.FORM)
        if word in found:
            found[word] = MatchKind.SAME
        found = dict.fromkeys(self._parts(stem(word)), MatchKind.PART) | found
        return found or dict.fromkeys(self._misspelt(word), MatchKind.MISSPELT)

    def _parts(self, asked: str) -> list[str]:
        n = len(asked)
        if n < MIN_LETTERS:
            return []
        begins = {asked[:end] for end in range(MIN_LETTERS, n + 1)}
        ends = {asked[start:] for start in range(n - MIN_LETTERS + 1)}
        stems = {own for own in begins | ends if own in self._of_stem}
        stems.update(_beginning_with(self._stems, asked))
        stems.update(own[::-1] for own in _beginning_with(self._stems_backwards, asked[::-1]))
        return sorted(word for own in stems for word in self._of_stem[own])

    def _misspelt(self, word: str) -> list[str]:
        if len(word) < MIN_LETTERS or word in read_words():
            return []
        if self._look_alikes is None:
            self._look_alikes = LookAlikes(chain.from_iterable(self._of_stem.values()))
        return self._look_alikes.find(word, least_ratio=MIN_LIKENESS_RATIO, limit=_MOST_MISSPELT)


def _beginning_with(words: Sequence[str], start: str) -> Iterator[str]:
    behind = (words[number] for number in range(bisect_left(words, start), len(words)))
    return takewhile(lambda word: word.startswith(start), behind)


@lru_cache(maxsize=MOST_KEPT)
def _letters(word: str) -> NDArray[np.int64]:
    return np.bincount([ord(letter) % _N_BUCKETS for letter in word], minlength=_N_BUCKETS)


Texts = Sequence[tuple[MatchField, str]]
"""The texts of a record, each with its part of the record."""


@dataclass(frozen=True, slots=True)
class AskedWords:
    """A word of the phrase.

    Attributes:
        spellings: The words of the records that count as this one, the likeliest misspelt first.
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
    """The words of records, each with the numbers of the records that say it."""

    def __init__(self) -> None:
        self._n_records = 0
        self._weights: dict[str, dict[int, float]] = {}
        self._postings: dict[str, tuple[NDArray[np.intp], NDArray[np.float64]]] = {}
        self._vocabulary = Vocabulary()

    def add(self, number: int, texts: Texts) -> None:
        """Add a record under a number that none has."""
        self._n_records += 1
        for word, weight in _weigh_words(texts).items():
            if word not in self._weights:
                self._weights[word] = {}
                self._vocabulary.add(word)
            self._weights[word][number] = weight
            self._postings.pop(word, None)

    def remove(self, number: int, texts: Texts) -> None:
        """Remove the record of a number, which was added with these texts."""
        self._n_records -= 1
        for word in _weigh_words(texts):
            del self._weights[word][number]
            self._postings.pop(word, None)
            if not self._weights[word]:
                del self._weights[word]
                self._vocabulary.remove(word)

    def ask(self, phrase: str) -> tuple[AskedWords, ...]:
        """Return words of a phrase that say what is meant, and what the records have of them."""
        found = []
        for shown, compared in content_words(phrase):
            spellings = self._vocabulary.find_spellings(compared)
            n_with = sum(len(self._weights[spelling]) for spelling in spellings)
            weight = math.log1p(self._n_records / max(n_with, 1))
            is_doubtful = self._vocabulary.is_doubtful(compared)
            found.append(AskedWords(shown, spellings, weight, is_doubtful))
        return tuple(found)

    def score_ratios(
        self,
        asked: Sequence[AskedWords],
        kind_weights: Mapping[MatchKind, float] = KIND_WEIGHTS,
        *,
        size: int,
    ) -> NDArray[np.float64]:
        """Return, by number, how much of a phrase a record says; rare words count more.

        Args:
            size: More than every number.
        """
        found = np.zeros(size)
        for word in asked:
            best = np.zeros(size)
            for spelling, kind in word.spellings.items():
                numbers, weights = self._find_postings(spelling)
                best[numbers] = np.maximum(best[numbers], weights * kind_weights[kind])
            found += word.weight * best
        return found / max(sum(word.weight for word in asked), 1e-9)

    def _find_postings(self, word: str) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        if word not in self._postings:
            found = self._weights[word]
            numbers = np.fromiter(found, dtype=np.intp, count=len(found))
            self._postings[word] = numbers, np.array(list(found.values()))
        return self._postings[word]


def explain(asked: Sequence[AskedWords], texts: Texts) -> tuple[MatchEvidence, ...]:
    """Return at most one finding in a record for each word of a phrase, in their order."""
    findings = (_find_word(word, texts) for word in asked)
    return tuple(finding for finding in findings if finding)


def _find_word(asked: AskedWords, texts: Texts) -> MatchEvidence | None:
    """Return the weightiest place in a record that says a word."""
    findings = (
        MatchEvidence(
            query_word=asked.shown,
            found_word=shown,
            field=field,
            text=text,
            kind=asked.spellings[compared],
        )
        for field, text in texts
        for shown, compared in split_words(_without_denied(field, text))
        if compared in asked.spellings
    )
    return max(findings, key=lambda finding: finding.weight, default=None)


class Numbers:
    """The numbers of entries, by what they are called."""

    def __init__(self) -> None:
        self._numbers: dict[str, set[int]] = {}

    def add(self, number: int, keys: Iterable[str]) -> None:
        """Add a number under keys."""
        for key in keys:
            self._numbers.setdefault(key, set()).add(number)

    def remove(self, number: int, keys: Iterable[str]) -> None:
        """Remove a number that is under these keys."""
        for key in keys:
            self._numbers[key].remove(number)
            if not self._numbers[key]:
                del self._numbers[key]

    def find(self, key: str) -> list[int]:
        """Return the numbers under a key."""
        return list(self._numbers.get(key, ()))

    def __contains__(self, key: object) -> bool:
        return key in self._numbers


def _weigh_words(texts: Texts) -> dict[str, float]:
    weights: dict[str, float] = {}
    for field, text in texts:
        for word in _words_said(_without_denied(field, text)):
            weights[word] = max(weights.get(word, 0.0), FIELD_WEIGHTS[field])
    return weights


@lru_cache(maxsize=MOST_KEPT)
def _words_said(text: str) -> tuple[str, ...]:
    """Return the words of a text, each once; many records say the same."""
    return tuple(dict.fromkeys(word for _, word in split_words(text)))


def put_right(query: str, words: Iterable[AskedWords]) -> str:
    """Return the request with corrected words where only a misspelling explains them."""
    for word in words:
        if word.corrected != word.shown:
            query = re.sub(rf"\b{re.escape(word.shown)}\b", word.corrected, query)
    return query
