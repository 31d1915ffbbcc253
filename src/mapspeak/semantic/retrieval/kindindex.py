"""What is commonly known of the things that are remembered, and of those that are not."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.semantic.filtering import find_head
from mapspeak.semantic.retrieval.embedder import TextVectors
from mapspeak.semantic.retrieval.entry import Entry, EntryKind
from mapspeak.semantic.retrieval.evidence import MatchField
from mapspeak.semantic.retrieval.knowledge import (
    find_kinds,
    find_kinds_called,
    find_named_kinds,
    find_names,
    is_gone,
    read_kinds,
)
from mapspeak.semantic.retrieval.naming import is_carrier
from mapspeak.semantic.retrieval.wordindex import Texts
from mapspeak.semantic.retrieval.words import content_stems
from mapspeak.semantic.waypoint import name_key

__all__ = ["KindIndex", "Missing"]

_SAME_KIND_RATIO = 0.75
"""A label that names no kind is of the kind whose name is so much like it."""

_NAMING = frozenset(MatchField) - {MatchField.PURPOSE, MatchField.CATEGORY}
"""What a record says in these is there; what a thing is for need not be."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Missing:
    """A kind of thing of which none is remembered.

    Attributes:
        name: What it is called.
        ratio: How alike its name and a request are.
    """

    name: str
    ratio: float


class KindIndex:
    """The kinds of some entries, and the names of all other kinds.

    Args:
        entries: What is remembered.
        said: The texts of each.
        vectors: What compares meanings; None where there is no model.
    """

    def __init__(
        self, entries: Sequence[Entry], said: Sequence[Texts], vectors: TextVectors | None
    ) -> None:
        names = [(name, kind) for kind in read_kinds() for name in kind.names]
        self._names = [name for name, _ in names]
        self._kinds = [kind for _, kind in names]
        self._vectors = None if vectors is None else _find(vectors, self._names)
        labels = {name for entry in entries for name in entry.names}
        self._kinds_of = {label: find_kinds(label) for label in labels}
        if vectors is not None and self._vectors is not None:
            self._find_by_meaning(vectors, self._vectors)
        known = {kind for kinds in self._kinds_of.values() for kind in kinds}
        # What a description mentions is remembered, too.
        texts = {text for own in said for field, text in own if field in _NAMING}
        known.update(kind for text in texts for kind in find_named_kinds(text))
        self._absent = np.array([kind not in known for kind in self._kinds], dtype=bool)
        self._said_of: dict[tuple[str, ...], Texts] = {}

    def say_of(self, entry: Entry) -> Texts:
        """Gives what is commonly known of a thing: its other names, then its uses."""
        if entry.kind is not EntryKind.THING:
            return ()
        if entry.names not in self._said_of:
            self._said_of[entry.names] = self._say_of_called(entry.names)
        return self._said_of[entry.names]

    def _say_of_called(self, labels: tuple[str, ...]) -> Texts:
        called_kinds = [(label, kind) for label in labels for kind in self._kinds_of[label]]
        kinds = dict.fromkeys(kind for _, kind in called_kinds)
        called = {name_key(label) for label in labels}
        names = dict.fromkeys(
            name for label, kind in called_kinds for name in find_names(kind, label)
        )
        uses = dict.fromkeys(use for kind in kinds for use in kind.uses)
        return (
            *((MatchField.OTHER_NAME, name) for name in names if name_key(name) not in called),
            *((MatchField.USE, use) for use in uses),
        )

    def find_missing(self, vector: Floats) -> Missing | None:
        """Finds the kind whose name is most like a request, of those that are not remembered."""
        if self._vectors is None or not self._absent.any():
            return None
        ratios = np.where(self._absent, np.round(self._vectors @ vector, 6), -1.0)
        number = int(ratios.argmax())
        return Missing(self._names[number], float(ratios[number]))

    def find_missing_called(self, request: str) -> Missing | None:
        """Finds the kind that a request names and nothing else, if it is not remembered."""
        stems = content_stems(request)
        is_absent = dict(zip(self._kinds, self._absent.tolist(), strict=True))
        called = (kind for kind in find_kinds_called(request) if is_absent[kind])
        names = (name for kind in called for name in kind.names if content_stems(name) == stems)
        return next((Missing(name, 1.0) for name in names), None)

    def _find_by_meaning(self, vectors: TextVectors, of_names: Floats) -> None:
        """Gives labels that name no kind the one whose name is most like them."""
        unknown = sorted(
            label
            for label, kinds in self._kinds_of.items()
            if not (kinds or is_carrier(label) or is_gone(label))
        )
        if not unknown:
            return
        heads = [" ".join(find_head(label)) or label for label in unknown]
        ratios = np.round(_find(vectors, heads) @ of_names.T, 6)
        for label, own in zip(unknown, ratios, strict=True):
            number = int(own.argmax())
            if own[number] >= _SAME_KIND_RATIO:
                self._kinds_of[label] = (self._kinds[number],)


def _find(vectors: TextVectors, texts: Sequence[str]) -> Floats:
    return vectors.find(texts).astype(np.float64)
