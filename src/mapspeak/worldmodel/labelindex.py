"""Which labels words name, by the same words as for remembered things: only labels are known."""

import threading
from collections.abc import Iterable

from mapspeak.memory.search.answer import Entry, EntryKind, Verdict
from mapspeak.memory.search.index import EntryIndex
from mapspeak.memory.search.kinds import calls_by_name
from mapspeak.memory.things.labels import names_no_less

LEAST_LIKE_RATIO = 0.35
"""Words are about a label by what such things are for from this similarity on."""


class LabelIndex:
    """Finds labels by name, by another name of the kind, or by what such things are for.

    Words alone are compared. Safe between threads; labels that were asked about before cost
    nothing anew.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._index = EntryIndex()
        self._entries: dict[str, Entry] = {}

    def find_called(self, words: str, labels: Iterable[str]) -> tuple[str, ...]:
        """Return the labels of things that are called so: "first-aid box" for "first aid kits"."""
        among = dict.fromkeys(labels)
        with self._lock:
            called = self._knowing(among).find_called(words)
        return tuple(each for each in among if each in called or names_no_less(each, words))

    def find_meant(self, words: str, labels: Iterable[str]) -> tuple[str, ...]:
        """Return the labels of things that are called so, else of those that may be meant."""
        among = dict.fromkeys(labels)
        called = self.find_called(words, among)
        if called := called or tuple(each for each in among if calls_by_name(words, [each])):
            return called
        with self._lock:
            answer = self._knowing(among).find(words, among=among)
        if answer.verdict is Verdict.NOT_REMEMBERED:
            return ()
        meant = answer.candidates[: answer.n_meant]
        return tuple(each.entry.id for each in meant if each.score_ratio >= LEAST_LIKE_RATIO)

    def _knowing(self, labels: Iterable[str]) -> EntryIndex:
        """Return the index with some labels among those that it holds."""
        new = [each for each in labels if each not in self._entries]
        if new:
            added = (Entry(id=each, kind=EntryKind.THING, name=each) for each in new)
            self._entries = self._entries | {each.id: each for each in added}
            self._index.hold(self._entries)
        return self._index
