"""Compares the meaning of a phrase with those of many records."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.semantic.retrieval.embedder import TextVectors
from mapspeak.semantic.retrieval.entry import Entry
from mapspeak.semantic.retrieval.evidence import MatchField

__all__ = ["Likeness", "MeaningIndex"]

_COMPARED = (
    MatchField.PURPOSE,
    MatchField.NOTE,
    MatchField.DESCRIPTION,
    MatchField.FEATURE,
    MatchField.PLACE,
)
_AT_ONCE = 4096
_LEAST_LENGTH = 1e-3

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Part:
    """Something said of an entry: its name alone, or its name with one sentence more."""

    name: str
    field: MatchField
    text: str


class Likeness:
    """How alike some entries and a phrase are.

    Args:
        parts: What is said of the entries, one after another.
        starts: Where each entry's first part stands.
        part_ratios: How alike each part and the phrase are, from -1 to 1.
    """

    def __init__(
        self, parts: Sequence[_Part], starts: NDArray[np.int64], part_ratios: Floats
    ) -> None:
        self._parts, self._starts, self._part_ratios = parts, starts, part_ratios
        self.ratios = np.maximum.reduceat(part_ratios, starts) if len(starts) else part_ratios

    def nearest_text(self, number: int) -> tuple[MatchField, str]:
        """Gives the text of an entry that is most like the phrase, and which part it is."""
        following = self._starts[number + 1 :]
        own = slice(self._starts[number], following[0] if len(following) else None)
        part = self._parts[own][int(self._part_ratios[own].argmax())]
        return part.field, part.text


class MeaningIndex:
    """The vectors of all that is said of some entries.

    The vector of "ladder: for reaching the top" is the sum of those of its two halves, which count
    the same. It finds as much as that of the whole would, and each text need be embedded only once,
    however many things are called a ladder or stand in one place.
    """

    def __init__(self, entries: Sequence[Entry], vectors: TextVectors) -> None:
        self._vectors = vectors
        parts = [list(_parts(entry)) for entry in entries]
        self._parts = [part for own in parts for part in own]
        self._starts = np.cumsum([0, *map(len, parts)])[:-1]
        texts = sorted({text for part in self._parts for text in (part.name, part.text)})
        number_of = {text: number for number, text in enumerate(texts)}
        self._texts = vectors.find(texts).astype(np.float64)
        self._names = np.array([number_of[part.name] for part in self._parts], dtype=int)
        self._contexts = np.array([number_of[part.text] for part in self._parts], dtype=int)
        # Never 0: halves may be unknown words, or say the very opposite.
        self._lengths = np.maximum(self._lengths_of_sums(), _LEAST_LENGTH)

    def compare(self, phrase: str) -> Likeness:
        """Gives how alike each entry and a phrase are: as its part that is most like the phrase."""
        vector = self._vectors.embedder.embed([phrase])[0].astype(np.float64)
        likeness = self._texts @ vector
        ratios = likeness[self._names] + likeness[self._contexts]
        # Rounded, since the order of the rows may change the last digit of a product.
        return Likeness(self._parts, self._starts, np.round(ratios / self._lengths, 6))

    def _lengths_of_sums(self) -> Floats:
        lengths = np.empty(len(self._parts))
        for start in range(0, len(lengths), _AT_ONCE):
            rows = slice(start, start + _AT_ONCE)
            sums = self._texts[self._names[rows]] + self._texts[self._contexts[rows]]
            lengths[rows] = np.linalg.norm(sums, axis=1)
        return lengths


def _parts(entry: Entry) -> Iterator[_Part]:
    for field, text in entry.texts[: len(entry.names)]:
        yield _Part(text, field, text)
    for field, text in entry.texts[len(entry.names) :]:
        if field in _COMPARED and text not in entry.surroundings:
            for sentence in _sentences(text):
                yield _Part(entry.name, field, sentence)


def _sentences(text: str) -> list[str]:
    return [part for part in re.split(r"(?<=[.!?])\s+|\n+", text) if part]
