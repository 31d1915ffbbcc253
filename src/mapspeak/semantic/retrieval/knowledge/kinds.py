"""Kinds of things, read from the list beside this file: general knowledge, of no one building."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType

from mapspeak.semantic.filtering import find_head
from mapspeak.semantic.retrieval.words import content_stems
from mapspeak.semantic.vocabulary import DESCRIPTIVE

__all__ = [
    "Kind",
    "ends_with",
    "find_kinds",
    "find_kinds_called",
    "find_named_kinds",
    "find_names",
    "head_stems",
    "is_gone",
    "read_kinds",
]

_GONE = frozenset({"absent", "former", "missing", "removed"})


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of thing.

    Attributes:
        names: What it is called; any of them may be used for the same thing.
        uses: What it is good for, and what is the matter when somebody needs it.
    """

    names: tuple[str, ...]
    uses: tuple[str, ...]


@cache
def read_kinds() -> tuple[Kind, ...]:
    """Reads the kinds in the order of the list, once: nothing ever changes them."""
    text = resources.files(__package__).joinpath("things.txt").read_text(encoding="utf-8")
    return tuple(_kinds_in(text))


def find_kinds(label: str) -> tuple[Kind, ...]:
    """Finds the kinds that a label names: "foam fire extinguisher" is a fire extinguisher.

    The longest name at the end of the label's head counts, whatever its form: a "sofa by the
    window" is a sofa. A name may reach beyond the head, as "box of returns" does.
    """
    words = find_head(label)
    if not _GONE.isdisjoint(words):
        return ()
    whole = content_stems(label)
    head = content_stems(" ".join(words)) or whole
    tails = [stems[start:] for stems in (whole, head) for start in range(len(head))]
    return next((found for tail in tails if (found := _kinds_by_stems().get(tail))), ())


def find_kinds_called(name: str) -> tuple[Kind, ...]:
    """Finds the kinds of which that is a name, with nothing added to it."""
    return _kinds_by_stems().get(content_stems(name), ())


def find_names(kind: Kind, label: str) -> tuple[str, ...]:
    """Gives the names of a kind that a thing of that label may have.

    A "tennis table" is a table, and no "dining table": there are many tables, and the label says
    which. A "foam extinguisher" is a "fire extinguisher", since no other kind is called that way.
    """
    *before, noun = find_head(label) or ("",)
    head = content_stems(" ".join([*(word for word in before if word not in DESCRIPTIVE), noun]))
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
    """True for a label of what is not there: "missing fire extinguisher"."""
    return not _GONE.isdisjoint(find_head(label))


def head_stems(label: str) -> tuple[str, ...]:
    """Gives the stems of the words of a label up to the one that says what the thing is."""
    return content_stems(" ".join(find_head(label))) or content_stems(label)


def ends_with(stems: tuple[str, ...], ending: tuple[str, ...]) -> bool:
    """True where one row of stems ends with another."""
    return stems[len(stems) - len(ending) :] == ending if len(ending) <= len(stems) else False


def find_named_kinds(text: str) -> frozenset[Kind]:
    """Finds the kinds that a text names anywhere."""
    stems = content_stems(text)
    spans = (
        stems[start : start + n]
        for n in range(1, _longest() + 1)
        for start in range(len(stems) - n + 1)
    )
    return frozenset(kind for span in spans for kind in _kinds_by_stems().get(span, ()))


@cache
def _tells_little(ending: tuple[str, ...]) -> bool:
    """True for what the names of several kinds end with: "table"."""
    found = {
        kind
        for stems, kinds in _kinds_by_stems().items()
        if ends_with(stems, ending)
        for kind in kinds
    }
    return len(found) > 1


def _kinds_in(text: str) -> Iterator[Kind]:
    for line in text.splitlines():
        if line and not line.startswith("#"):
            names, uses = line.split(": ", 1)
            yield Kind(tuple(names.split(", ")), tuple(uses.split("; ")))


@cache
def _longest() -> int:
    return max(map(len, _kinds_by_stems()))


@cache
def _kinds_by_stems() -> MappingProxyType[tuple[str, ...], tuple[Kind, ...]]:
    kinds: dict[tuple[str, ...], dict[Kind, None]] = defaultdict(dict)
    for kind in read_kinds():
        for name in kind.names:
            kinds[content_stems(name)][kind] = None
    return MappingProxyType({stems: tuple(found) for stems, found in kinds.items()})
