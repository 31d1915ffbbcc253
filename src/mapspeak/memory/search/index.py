"""Find remembered places and things by name, by meaning or by words.

An exact name comes first. Otherwise meanings are compared if there is a model, else words: mixing
both found less than the model alone. Texts of the record and, with a little less weight, general
knowledge of such things are compared. How sure an answer is, and whether what is meant is
remembered at all, are chances fitted to requests.
"""

import math
import re
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from itertools import chain, count
from operator import attrgetter

import numpy as np

from mapspeak.memory.quoting import name_key
from mapspeak.memory.search.answer import (
    REMEMBERED_RATIO,
    SURE_RATIO,
    WHOLE_WORD_WEIGHTS,
    WORD_THRESHOLDS,
    Answer,
    Basis,
    Entry,
    EntryCandidate,
    MatchEvidence,
    MatchField,
    Verdict,
)
from mapspeak.memory.search.kinds import (
    KindIndex,
    calls_by_name,
    denies,
    find_kinds_called,
    without_opening,
)
from mapspeak.memory.search.meaningindex import Floats, IntArray, MeaningIndex, TextVectors
from mapspeak.memory.search.wordindex import (
    MOST_KEPT,
    AskedWords,
    LookAlikes,
    Numbers,
    WordIndex,
    content_stems,
    content_words,
    explain,
    put_right,
)

WORDS_ONLY = "The search compares words only, no meanings."

_TELLS_APART = re.compile(r"\b(?:with|on|in|at|near|under|behind|beside|for|of|\w*\d\w*)\b")
"""Words that no name is misspelt by: numbers, ids, and those before a place or a detail."""

_SAME_NAME, _SAME_WORDS, _SAME_WORDS_MISSPELT = 1.0, 0.99, 0.98
_MOST_WITHOUT_NAME = 0.97
"""Highest similarity of an entry that the request does not name."""
_SAME_KIND = 0.96
"""Similarity of an entry of which the request is another name, as is commonly known."""

_LEAST_NAME_LIKENESS = 0.75
"""Similarity from which a request with a misspelt word counts as the name it resembles.

Of the requests for tuning all misspelt names are at least .75 like the right ones, and all others
with unknown words at most .69 like any.
"""


_MOST_COUNTED = 6
"""Words of a longer request do not each tell something else."""

_CONTENT = attrgetter(*(field.name for field in fields(Entry) if field.name != "id"))


@dataclass(frozen=True, slots=True)
class _Asked:
    """A request, and its similarity to each entry.

    Attributes:
        common: The same words, as found in general knowledge.
        ratios: By the texts of the entry and general knowledge.
        part_ratios: By all texts of any entry, if meanings were compared.
        missing: A kind that is not remembered and may be meant, if it can be told, with its
            similarity.
    """

    request: str
    words: tuple[AskedWords, ...]
    common: tuple[AskedWords, ...]
    ratios: Floats
    part_ratios: Floats | None
    missing: tuple[str | None, float] | None

    def basis(self, number: int) -> Basis:
        if self.ratios[number] > _MOST_WITHOUT_NAME:
            return Basis.NAME
        return Basis.WORDS if self.part_ratios is None else Basis.MEANING


class EntryIndex:
    """Search index of the memory.

    Args:
        entries: In any order, with unique ids.
        vectors: Compares meanings; None without a model.

    Attributes:
        n_new: How many entries were added since it was made, or kept on the disk.
    """

    def __init__(
        self, entries: Sequence[Entry] = (), *, vectors: TextVectors | None = None
    ) -> None:
        self.n_new = 0
        self._entries: dict[int, Entry] = {}
        self._number_of: dict[str, int] = {}
        self._held: Mapping[str, Entry] = {}
        self.vectors = vectors
        self._kinds = KindIndex(vectors)
        self._words = WordIndex()
        # With a model, general knowledge is compared by meaning and needs no words.
        self._common_words = WordIndex()
        self._meanings = None if vectors is None else MeaningIndex(vectors)
        self._thresholds = WORD_THRESHOLDS if vectors is None else vectors.embedder.thresholds
        self._of_key, self._of_letters, self._of_other = (Numbers() for _ in range(3))
        self._look_alikes: LookAlikes | None = None
        self.hold({each.id: each for each in entries})

    def hold(self, entries: Mapping[str, Entry]) -> None:
        """Hold exactly these entries, each under its id; those that it has cost next to nothing."""
        held, self._held = self._held, entries
        if entries is held:
            return
        # By identity: most are the very same each time, and to compare them as values is slow.
        changed = {id_: each for id_, each in entries.items() if held.get(id_) is not each}
        gone: dict[tuple[object, ...], list[int]] = {}
        for id_, before in held.items():
            if (now := entries.get(id_)) is before:
                continue
            if now == before:
                # The same, made again.
                self._entries[self._number_of[id_]] = changed.pop(id_)
            else:
                gone.setdefault(_CONTENT(before), []).append(self._number_of.pop(id_))
        new = []
        for id_, entry in changed.items():
            if numbers := gone.get(_CONTENT(entry)):
                # The same under another id.
                number = numbers.pop()
                self._entries[number], self._number_of[id_] = entry, number
            else:
                new.append(entry)
        for number in chain.from_iterable(gone.values()):
            self._remove(number)
        self._add(new)

    def _add(self, entries: Sequence[Entry]) -> None:
        self._kinds.add(entries)
        self.n_new += len(entries)
        free = (number for number in count() if number not in self._entries)
        added = []
        for entry in entries:
            number = next(free)
            self._entries[number], self._number_of[entry.id] = entry, number
            said, common = entry.texts, self._kinds.say_of(entry)
            self._words.add(number, said)
            if self._meanings is None:
                self._common_words.add(number, common)
            added.append((number, entry, said, common))
            for numbers, keys in self._keys_of(entry):
                numbers.add(number, keys)
        if self._meanings is not None:
            self._meanings.add(added)
        self._look_alikes = None

    def _remove(self, number: int) -> None:
        entry = self._entries.pop(number)
        self._words.remove(number, entry.texts)
        if self._meanings is None:
            self._common_words.remove(number, self._kinds.say_of(entry))
        else:
            self._meanings.remove(number)
        for numbers, keys in self._keys_of(entry):
            numbers.remove(number, keys)
        self._kinds.remove(entry)
        self._look_alikes = None

    def _keys_of(self, entry: Entry) -> Iterator[tuple[Numbers, set[str]]]:
        """Return what an entry is called, in the forms that requests are compared with."""
        yield self._of_key, {name_key(name) for name in entry.names}
        yield self._of_letters, {"".join(content_stems(name)) for name in entry.names}
        others = (t for field, t in self._kinds.say_of(entry) if field is MatchField.OTHER_NAME)
        yield self._of_other, {_letters_of(text) for text in others}

    def __getstate__(self) -> dict[str, object]:
        """Return what is kept on the disk: all but what holds in this process alone."""
        return self.__dict__ | {"_look_alikes": None, "n_new": 0}

    def find(self, query: str, *, among: Container[str] | None = None, limit: int = 5) -> Answer:
        """Find what a request may mean.

        Args:
            query: In people's words: a name, a thing, its purpose, a problem.
        """
        words = self._words.ask(query)
        understood = self._understand(query, words)
        asked = self._compare(query, understood, words)
        likely = self._find_likely(asked.ratios, among)
        order = self._order(asked.ratios, likely, limit)
        n_meant = self._count_meant(asked, order, likely)
        verdict, is_sure = self._judge(asked, order, n_meant)
        said = self._words.score_ratios(words, WHOLE_WORD_WEIGHTS, size=len(asked.ratios))
        return Answer(
            query=query,
            understood=understood,
            verdict=verdict,
            candidates=tuple(self._candidate(number, asked, said) for number in order[:limit]),
            n_meant=n_meant,
            is_sure=is_sure,
            missing=self._find_missing(asked, order, limit),
            limits=WORDS_ONLY if self._meanings is None else None,
        )

    def find_called(self, query: str) -> set[str]:
        """Return the ids of entries with that very name, whatever its case, number or spelling.

        Where none has it, of those of a kind that is called so too: "first-aid kit" for a box.
        """
        understood = self._understand(query, self._words.ask(query))
        numbers = chain(
            self._of_key.find(name_key(query)),
            self._of_letters.find(_letters_of(query)),
            self._of_letters.find(_letters_of(understood)),
        )
        called = set(numbers) or self._of_other.find(_letters_of(understood))
        return {self._entries[number].id for number in called}

    def _understand(self, query: str, words: tuple[AskedWords, ...]) -> str:
        """Return the request with its spelling corrected, or the name that it resembles."""
        spelt = put_right(query, words)
        letters = _letters_of(spelt)
        is_known = letters in self._of_letters or letters in self._of_other
        if is_known or find_kinds_called(spelt) or not any(each.is_doubtful for each in words):
            return spelt
        if self._look_alikes is None:
            names = (" ".join(_words_of(n)) for each in self._entries.values() for n in each.names)
            self._look_alikes = LookAlikes(filter(None, names))
        likest = self._look_alikes.find(
            " ".join(_words_of(query)), least_ratio=_LEAST_NAME_LIKENESS, limit=1
        )
        return likest[0] if likest and _says_no_more(query, likest[0]) else spelt

    def _compare(self, query: str, understood: str, words: tuple[AskedWords, ...]) -> _Asked:
        common: tuple[AskedWords, ...] = ()
        size = max(self._entries, default=-1) + 1
        part_ratios, missing = None, None
        # An English model cannot compare other scripts.
        is_latin = any(word.isascii() for _, word in content_words(understood))
        if self.vectors is None or self._meanings is None or not is_latin:
            ratios = self._words.score_ratios(words, size=size)
            if self.vectors is None:
                common = self._common_words.ask(understood)
                ratios = np.maximum(
                    ratios, self._common_words.score_ratios(common, WHOLE_WORD_WEIGHTS, size=size)
                )
                missing = self._kinds.find_missing_said(understood)
        else:
            vector = self.vectors.embedder.embed([understood])[0].astype(np.float64)
            part_ratios, missing = self._meanings.compare(vector), self._kinds.find_missing(vector)
            ratios = self._meanings.ratios(part_ratios, size)
        ratios = np.clip(ratios, 0.0, _MOST_WITHOUT_NAME)
        ratios[self._of_other.find(_letters_of(understood))] = _SAME_KIND
        ratios[self._of_letters.find(_letters_of(understood))] = _SAME_WORDS_MISSPELT
        ratios[self._of_letters.find(_letters_of(query))] = _SAME_WORDS
        ratios[self._of_key.find(name_key(query))] = _SAME_NAME
        return _Asked(understood, words, common, ratios, part_ratios, missing)

    def _find_missing(self, asked: _Asked, order: list[int], limit: int) -> str | None:
        """Return a kind that is meant and not remembered; none by the whole name of what is."""
        if asked.missing is None or _missing_ratio(asked, order) <= 0:
            return None
        said = set(content_stems(asked.request))
        likest = self._order(asked.ratios, self._find_likely(asked.ratios, None), limit)
        names = (set(content_stems(name)) for n in likest for name in self._entries[n].names)
        return None if any(name and name <= said for name in names) else asked.missing[0]

    def _find_likely(self, ratios: Floats, among: Container[str] | None) -> IntArray:
        likely = np.flatnonzero(ratios > 0)
        if among is not None:
            likely = likely[[self._entries[number].id in among for number in likely.tolist()]]
        return likely

    def _order(self, ratios: Floats, likely: IntArray, limit: int) -> list[int]:
        """Return the likeliest; of equally likely ones those with the first ids."""
        if len(likely) > limit > 0:
            least = np.partition(ratios[likely], -limit)[-limit]
            likely = likely[ratios[likely] >= least]
        return sorted(likely.tolist(), key=lambda n: (-ratios[n], self._entries[n].id))

    def _count_meant(self, asked: _Asked, order: list[int], likely: IntArray) -> int:
        if not order:
            return 0
        margin = 0.0 if asked.basis(order[0]) is Basis.NAME else self._thresholds.same_ratio
        return int(np.count_nonzero(asked.ratios[likely] >= asked.ratios[order[0]] - margin))

    def _judge(self, asked: _Asked, order: list[int], n_meant: int) -> tuple[Verdict, bool]:
        """Return the trust in the likeliest entry, and whether its kind is surely the one meant."""
        if not order:
            return Verdict.NOT_REMEMBERED, False
        first = order[0]
        likeness, missing = float(asked.ratios[first]), _missing_ratio(asked, order)
        is_sure = likeness >= _SAME_KIND
        if not is_sure:
            lead = self._lead_ratio(asked.ratios, first)
            n_words = 1 if self._meanings else min(len(asked.words), _MOST_COUNTED)
            there, right = (
                chance.ratio(likeness, lead, missing, n_words=n_words)
                for chance in (self._thresholds.there, self._thresholds.right)
            )
            if there < REMEMBERED_RATIO:
                return Verdict.NOT_REMEMBERED, False
            is_sure = right >= SURE_RATIO and not self._is_beside(asked.request, first)
        if not is_sure:
            return Verdict.UNSURE, False
        return Verdict.FOUND if n_meant == 1 else Verdict.SEVERAL, True

    def _is_beside(self, request: str, number: int) -> bool:
        """Return True where a request says words of a label, but not what the thing is."""
        entry, stems = self._entries[number], content_stems(request)
        names = [
            *entry.names,
            *(text for field, text in self._kinds.say_of(entry) if field is MatchField.OTHER_NAME),
        ]
        is_said = any(not set(stems).isdisjoint(content_stems(name)) for name in entry.names)
        return denies(request) or (is_said and not calls_by_name(request, names))

    def _lead_ratio(self, ratios: Floats, first: int) -> float:
        """Return the lead of an entry over the next one with another name.

        All entries count, even if only some may be chosen: a sink in another room does not make
        a toilet in this one likelier to be meant.
        """
        name = name_key(self._entries[first].name)
        is_other = np.zeros(len(ratios), dtype=bool)
        is_other[list(self._entries)] = True
        is_other[self._of_key.find(name)] = False
        return float(ratios[first] - ratios[is_other].max()) if is_other.any() else 0.0

    def _candidate(self, number: int, asked: _Asked, said: Floats) -> EntryCandidate:
        entry, basis = self._entries[number], asked.basis(number)
        evidence = self._explain(asked, number)
        field, text = entry.texts[0]
        if basis is Basis.MEANING and self._meanings and asked.part_ratios is not None:
            field, text = self._meanings.nearest_text(asked.part_ratios, number)
        elif basis is Basis.WORDS:
            best = max(evidence, key=lambda each: each.weight, default=None)
            field, text = (field, text) if best is None else (best.field, best.text)
        return EntryCandidate(
            entry=entry,
            score_ratio=float(asked.ratios[number]),
            basis=basis,
            field=field,
            text=text,
            evidence=evidence,
            said_ratio=float(said[number]),
        )

    def _explain(self, asked: _Asked, number: int) -> tuple[MatchEvidence, ...]:
        entry = self._entries[number]
        said = explain(asked.words, entry.texts)
        return said or explain(asked.common, self._kinds.say_of(entry))


def _missing_ratio(asked: _Asked, order: list[int]) -> float:
    """Return the lead of a kind that is not remembered over the likeliest remembered one."""
    if asked.missing is None or (order and asked.basis(order[0]) is Basis.NAME):
        return -math.inf
    if not order:
        return math.inf
    return asked.missing[1] - float(asked.ratios[order[0]])


@lru_cache(maxsize=MOST_KEPT)
def _letters_of(request: str) -> str:
    """Return the stems of a request without what leads to it, in one: "night stand", too."""
    return "".join(content_stems(without_opening(request)))


def _words_of(text: str) -> list[str]:
    return [word for _, word in content_words(text)]


def _says_no_more(query: str, name: str) -> bool:
    """Return False for a request that says where, or which number, of which a name says nothing."""
    said, known = (set(_TELLS_APART.findall(each.casefold())) for each in (query, name))
    return said <= known
