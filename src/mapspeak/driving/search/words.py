"""Whether a few words speak of the thing that is looked for."""

from mapspeak.semantic.retrieval import Entry, EntryIndex, EntryKind

__all__ = ["speaks_of"]

LEAST_SAID_RATIO = 0.25
"""Of what is looked for, words say at least so much that speak of it.

Little, since what a detector reports is shown before anybody relies on it.
"""


def speaks_of(words: str, thing: str) -> bool:
    """True when words, such as a detector's label, name a thing; by the rules of the memory."""
    named = Entry(id=words, kind=EntryKind.PLACE, name=words)
    answer = EntryIndex([named]).find(thing)
    return bool(answer.find_speaking(least_said_ratio=LEAST_SAID_RATIO))
