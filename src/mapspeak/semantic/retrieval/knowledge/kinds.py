"""Kinds of things, read from the list beside this file: general knowledge, of no one building."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType

from mapspeak.semantic.retrieval.words import content_stems

__all__ = ["Kind", "find_kinds", "find_named_kinds", "read_kinds"]


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

    The longest name at the end of the label counts, whatever its form.
    """
    stems = content_stems(label)
    tails = (stems[start:] for start in range(len(stems)))
    return next((found for tail in tails if (found := _kinds_by_stems().get(tail))), ())


def find_named_kinds(text: str) -> frozenset[Kind]:
    """Finds the kinds that a text names anywhere."""
    stems = content_stems(text)
    spans = (
        stems[start : start + n]
        for n in range(1, _longest() + 1)
        for start in range(len(stems) - n + 1)
    )
    return frozenset(kind for span in spans for kind in _kinds_by_stems().get(span, ()))


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
