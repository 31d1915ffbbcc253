"""Kinds of things from general knowledge, and the kinds that a request names."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import resources
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from mapspeak.memory.policy import find_head, words_of
from mapspeak.memory.quoting import name_key
from mapspeak.memory.search.answer import WHOLE_WORD_WEIGHTS, Entry, EntryKind, MatchField
from mapspeak.memory.search.meaningindex import LESS_FOR_COMMON, TextVectors
from mapspeak.memory.search.wordindex import (
    MOST_KEPT,
    Texts,
    WordIndex,
    content_stems,
    split_words,
    without_endings,
)


@dataclass(frozen=True, slots=True)
class ThingKind:
    """A kind of thing.

    Attributes:
        names: Its names; any of them may be used for the same thing.
        uses: Its purposes, and the problems that it solves.
    """

    names: tuple[str, ...]
    uses: tuple[str, ...]


@cache
def read_kinds() -> tuple[ThingKind, ...]:
    """Read the kinds once, in the order of the list; they never change."""
    text = resources.files("mapspeak.memory").joinpath("data/kinds.txt").read_text(encoding="utf-8")
    lines = (line for line in text.splitlines() if line and not line.startswith("#"))
    parts = (line.split(": ", 1) for line in lines)
    return tuple(ThingKind(tuple(n.split(", ")), tuple(uses.split("; "))) for n, uses in parts)


def find_kinds(label: str) -> tuple[ThingKind, ...]:
    """Find the kinds that a label names: "foam fire extinguisher" is a fire extinguisher.

    The longest name at the end of the label's head counts, whatever its form: a "sofa by the
    window" is a sofa. A name may reach beyond the head, as "box of returns" does.
    """
    words = find_head(label)
    if not words_of("gone").isdisjoint(words):
        return ()
    whole = content_stems(label)
    head = content_stems(" ".join(words)) or whole
    tails = [stems[start:] for stems in (whole, head) for start in range(len(head))]
    return next((found for tail in tails if (found := _kinds_of(tail))), ())


def find_kinds_called(name: str) -> tuple[ThingKind, ...]:
    """Find the kinds with exactly this name."""
    return _kinds_of(content_stems(name))


def find_names(kind: ThingKind, label: str) -> tuple[str, ...]:
    """Return the names of a kind that a thing of that label may have.

    A "tennis table" is a table, and no "dining table": there are many tables, and the label says
    which. A "foam extinguisher" is a "fire extinguisher", since no other kind is called that way.
    """
    *before, noun = find_head(label) or ("",)
    head = content_stems(
        " ".join([*(word for word in before if word not in words_of("descriptive")), noun])
    )
    names = {name: content_stems(name) for name in kind.names}
    own = max((stems for stems in names.values() if ends_with(head, stems)), key=len, default=())
    if own in (head, ()) or not _tells_little(own):
        return kind.names
    return tuple(
        name
        for name, stems in names.items()
        if len(stems) <= len(own) or not ends_with(stems, own) or ends_with(head, stems)
    )


def is_gone(label: str) -> bool:
    """Return True for a label of an absent thing: "missing fire extinguisher"."""
    return not words_of("gone").isdisjoint(find_head(label))


def head_stems(label: str) -> tuple[str, ...]:
    """Return the stems of the words of a label up to the one that says what the thing is."""
    return content_stems(" ".join(find_head(label))) or content_stems(label)


def ends_with(stems: tuple[str, ...], ending: tuple[str, ...]) -> bool:
    """Return True where one row of stems ends with another."""
    return stems[len(stems) - len(ending) :] == ending if len(ending) <= len(stems) else False


@lru_cache(maxsize=MOST_KEPT)
def find_named_kinds(text: str) -> frozenset[ThingKind]:
    """Find the kinds that a text names anywhere."""
    stems = content_stems(text)
    spans = (
        stems[start : start + n]
        for n in range(1, _longest() + 1)
        for start in range(len(stems) - n + 1)
    )
    return frozenset(kind for span in spans for kind in _kinds_of(span))


@cache
def _tells_little(ending: tuple[str, ...]) -> bool:
    """Return True for a word that ends the names of several kinds: "table"."""
    found = {
        kind
        for stems, kinds in _kinds_by_stems().items()
        if ends_with(stems, ending)
        for kind in kinds
    }
    return len(found) > 1


@cache
def _longest() -> int:
    return max(map(len, _kinds_by_stems()))


def _kinds_of(stems: tuple[str, ...]) -> tuple[ThingKind, ...]:
    """Return the kinds of a name, written in one word or in several: "night stand"."""
    return _kinds_by_stems().get(stems, ()) or _kinds_by_letters().get("".join(stems), ())


@cache
def _kinds_by_letters() -> MappingProxyType[str, tuple[ThingKind, ...]]:
    kinds: dict[str, dict[ThingKind, None]] = defaultdict(dict)
    for kind in read_kinds():
        for name in kind.names:
            # The stem of "houseplant" is not the stems of "house" and "plant".
            for stems in (content_stems(name), content_stems(name.replace(" ", ""))):
                kinds["".join(stems)][kind] = None
    return MappingProxyType({letters: tuple(found) for letters, found in kinds.items()})


@cache
def _kinds_by_stems() -> MappingProxyType[tuple[str, ...], tuple[ThingKind, ...]]:
    kinds: dict[tuple[str, ...], dict[ThingKind, None]] = defaultdict(dict)
    for kind in read_kinds():
        for name in kind.names:
            kinds[content_stems(name)][kind] = None
    return MappingProxyType({stems: tuple(found) for stems, found in kinds.items()})


_SAME_KIND_RATIO = 0.75
"""A label that names no kind belongs to the kind with a name at least this similar."""

_AT_ONCE = 512

_NAMING = frozenset(MatchField) - {MatchField.PURPOSE, MatchField.CATEGORY}
"""Parts of a record that name things that are there; its purpose may name others."""

Floats = NDArray[np.float64]


class KindIndex:
    """The kinds of some entries, and the names of all other kinds."""

    def __init__(self, vectors: TextVectors | None) -> None:
        numbered = list(enumerate(read_kinds()))
        names = [(name, number) for number, kind in numbered for name in kind.names]
        uses = [(use, number) for number, kind in numbered for use in kind.uses]
        self._numbers = np.array([number for _, number in (*names, *uses)], dtype=np.intp)
        self._n_names = len(names)
        texts = [text for text, _ in (*names, *uses)]
        self._embedded = vectors
        self._vectors = None if vectors is None else vectors.find(texts).astype(np.float64)
        self._kinds_of: dict[str, tuple[ThingKind, ...]] = {}
        self._n_known: dict[ThingKind, int] = {}
        self._absent: NDArray[np.bool_] | None = None
        self._said_of: dict[tuple[str, ...], Texts] = {}

    def add(self, entries: Sequence[Entry]) -> None:
        """Count the kinds of entries as remembered."""
        new = {name for entry in entries for name in entry.names} - self._kinds_of.keys()
        self._kinds_of |= {label: find_kinds(label) for label in new}
        if self._embedded is not None and self._vectors is not None:
            self._find_by_meaning(new, self._embedded, self._vectors[: self._n_names])
        for entry in entries:
            self._count(entry, 1)

    def remove(self, entry: Entry) -> None:
        """Count the kinds of an entry no more."""
        self._count(entry, -1)

    def _count(self, entry: Entry, n: int) -> None:
        for kind in self._kinds_told(entry):
            before = self._n_known.get(kind, 0)
            self._n_known[kind] = before + n
            if 0 in (before, before + n):
                self._absent = None

    def _kinds_told(self, entry: Entry) -> set[ThingKind]:
        told = {kind for name in entry.names for kind in self._kinds_of[name]}
        # Things mentioned in a description are remembered, too.
        described = (find_named_kinds(text) for field, text in entry.texts if field in _NAMING)
        return told.union(*described)

    def _find_absent(self) -> NDArray[np.bool_]:
        """Return for each kind, in the order of all, True if it is not remembered."""
        if self._absent is None:
            self._absent = np.array([not self._n_known.get(kind) for kind in read_kinds()])
        return self._absent

    def say_of(self, entry: Entry) -> Texts:
        """Return general knowledge of a thing: its other names, then its uses."""
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

    def find_missing(self, vector: Floats) -> tuple[str, float] | None:
        """Find the kind that is not remembered and has a name or use most similar to a request.

        Returns:
            Its first name, and the similarity.
        """
        absent = self._find_absent()[self._numbers]
        if self._vectors is None or not absent.any():
            return None
        ratios = np.round(self._vectors @ vector, 6)
        ratios[self._n_names :] -= LESS_FOR_COMMON
        row = int(np.where(absent, ratios, -1.0).argmax())
        return read_kinds()[self._numbers[row]].names[0], float(ratios[row])

    def find_missing_said(self, request: str) -> tuple[str | None, float] | None:
        """Find the kind that is not remembered and that a request names, or says most of.

        Returns:
            Its first name, None where the request says no name of it, and the similarity.
        """
        called, stems = find_kinds_called(request), content_stems(request)
        absent = (kind for kind in called if not self._n_known.get(kind))
        names = (name for kind in absent for name in kind.names if content_stems(name) == stems)
        if (named := next(names, None)) is not None:
            return named, 1.0
        if called:
            return None
        kinds, words = read_kinds(), _index_words()
        ratios = words.score_ratios(words.ask(request), WHOLE_WORD_WEIGHTS, size=len(kinds))
        number = int(np.where(self._find_absent(), ratios, 0.0).argmax())
        if ratios[number] <= 0:
            return None
        is_named = says_name(request, kinds[number])
        return kinds[number].names[0] if is_named else None, float(ratios[number])

    def _find_by_meaning(
        self, labels: Iterable[str], vectors: TextVectors, of_names: Floats
    ) -> None:
        """Assign to labels that name no kind the kind with the most similar name."""
        unknown = sorted(
            label
            for label in labels
            if not (self._kinds_of[label] or is_carrier(label) or is_gone(label))
        )
        # A part at a time: the similarities of ten thousand labels fill hundreds of megabytes.
        for start in range(0, len(unknown), _AT_ONCE):
            some = unknown[start : start + _AT_ONCE]
            heads = [" ".join(find_head(label)) or label for label in some]
            ratios = np.round(vectors.find(heads).astype(np.float64) @ of_names.T, 6)
            for label, own in zip(some, ratios, strict=True):
                number = int(own.argmax())
                if own[number] >= _SAME_KIND_RATIO:
                    self._kinds_of[label] = (read_kinds()[self._numbers[number]],)


@cache
def _index_words() -> WordIndex:
    """Return the words of all kinds, each by its number in the list; they never change."""
    index = WordIndex()
    for number, kind in enumerate(read_kinds()):
        names = ((MatchField.OTHER_NAME, name) for name in kind.names)
        index.add(number, (*names, *((MatchField.USE, use) for use in kind.uses)))
    return index


def is_carrier(label: str) -> bool:
    """Return True for a label of something that merely shows, points to or holds a thing."""
    head = find_head(label)
    return bool(head) and head[-1].removesuffix("s") in words_of("showing")


def calls_by_name(request: str, names: Iterable[str]) -> bool:
    """Return True if a request is for a thing of one of these names, as far as both show.

    "Fire extinguisher" calls a foam fire extinguisher so, and "mouse trap" no mouse.

    Args:
        names: The names of the thing; more or less specific than the request.
    """
    if denies(request):
        return False
    asked = head_stems(without_opening(request))
    own = [head_stems(name) for name in names if not is_gone(name)]
    return any(
        asked and stems and (ends_with(asked, stems) or ends_with(stems, asked)) for stems in own
    )


def says_name(request: str, kind: ThingKind) -> bool:
    """Return True if a request says a name of a kind, or a word of one and another of its uses."""
    stems = set(content_stems(request))
    named = [set(content_stems(name)) for name in kind.names]
    if calls_by_name(request, kind.names) or any(name <= stems for name in named):
        return True
    used = set().union(*map(content_stems, kind.uses))
    called = stems & set().union(*named)
    return bool(called) and bool(stems & used - called)


def denies(request: str) -> bool:
    """Return True for a request that begins with what is not meant: "another", "not the"."""
    words = (word for _, word in split_words(without_opening(request)))
    return not words_of("denied").isdisjoint(words)


def without_opening(request: str) -> str:
    """Return a request without the words that people say before they come to what they mean."""
    words = [shown for shown, _ in split_words(without_endings(request))]
    first = next((i for i, word in enumerate(words) if word.lower() not in words_of("opening")), 0)
    return " ".join(words[first:])
