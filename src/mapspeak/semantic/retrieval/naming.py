"""Tells whether a request calls a thing by its name: what each is stands last in its head."""

from collections.abc import Iterable

from mapspeak.semantic.filtering import find_head
from mapspeak.semantic.retrieval.knowledge import ends_with, find_kinds_called, head_stems, is_gone
from mapspeak.semantic.retrieval.words import content_stems, split_words

__all__ = ["calls_by_name", "is_carrier", "says_purpose"]

_CARRIERS = frozenset(
    """picture photo photograph poster painting drawing sketch image icon symbol sign signpost
    arrow pictogram sticker label notice placard plaque bracket mount holder hook outline
    silhouette""".split()  # noqa: SIM905 - as many words in quotes would hide what they are
)
"""What shows a thing, points to it or has room for it, and is not that thing."""

_OPENING = frozenset(
    """a an any are at bring can closest could do drive find for get give go goto have how i in is
    it like look looking m me most must my navigate near nearest need of on over place please point
    robot s search see show some take that the there this to towards travel us want was way we what
    where where's which with would you your""".split()  # noqa: SIM905 - as above
)
"""What people say before they come to what they mean."""

_DENIED = frozenset({"another", "no", "not", "other"})


def is_carrier(label: str) -> bool:
    """True for a label of what only shows a thing, points to it or has room for it."""
    head = find_head(label)
    return bool(head) and head[-1].removesuffix("s") in _CARRIERS


def calls_by_name(request: str, names: Iterable[str], *, other_names: Iterable[str] = ()) -> bool:
    """True where a request is for a thing of one of these names, as far as both say what it is.

    "Fire extinguisher" calls a foam fire extinguisher so, "dining table" no tennis table, and
    "mouse trap" no mouse.

    Args:
        request: What people say.
        names: What the thing is called. It may say more than the request, or less.
        other_names: What such things are also called.
    """
    words = _without_opening(request)
    if not _DENIED.isdisjoint(word for _, word in split_words(words)):
        return False
    asked, own = head_stems(words), [head_stems(name) for name in names if not is_gone(name)]
    # The end of its own name is no other one: "table" would let a "dining table" call any table.
    other = [
        stems
        for stems in map(content_stems, other_names)
        if not any(ends_with(name, stems) for name in own)
    ]
    return any(
        asked and stems and (ends_with(asked, stems) or ends_with(stems, asked))
        for stems in (*own, *other)
    )


def says_purpose(request: str, purpose: str | None) -> bool:
    """True where a request says in the very words what a thing is for, and names no thing."""
    asked = frozenset(content_stems(request))
    is_told = len(asked) > 1 and asked <= frozenset(content_stems(purpose or ""))
    return is_told and not find_kinds_called(request)


def _without_opening(request: str) -> str:
    """Gives a request from the first word on that may say what is meant."""
    words = [shown for shown, _ in split_words(request)]
    first = next((i for i, word in enumerate(words) if word.lower() not in _OPENING), 0)
    return " ".join(words[first:])
