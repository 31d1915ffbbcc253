"""What is remembered, joined with one map: places and things under their ids, ready to be asked.

Making it is costly, so it is made when first asked for and kept until memory or map change.
"""

import logging
import threading
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import cached_property
from pathlib import Path

from mapspeak.errors import ConfigError
from mapspeak.geometry import Point
from mapspeak.memory import SemanticMap, Waypoint
from mapspeak.memory.consistency.findings import MemoryFinding, Trust, judge_trust
from mapspeak.memory.search.answer import Answer, Basis, Entry, EntryKind, list_entries
from mapspeak.memory.search.index import EntryIndex
from mapspeak.memory.search.meaningindex import Embedder, TextVectors
from mapspeak.memory.things.finding import Things, find_things
from mapspeak.memory.things.labels import name_the_same
from mapspeak.memory.things.thing import Category, Thing
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms.identity import match_best_first
from mapspeak.worldmodel.keptthings import keep_things, load_things

logger = logging.getLogger(__name__)

KEPT_FROM = 1000
"""Things are kept once so many views were joined anew; fewer are joined in a moment."""
THINGS_FILE = "things.cache"
SAME_THING_M = 1.0
"""A thing of the same name within this distance of an earlier one is that one, seen better."""
MOST_CALLED = 1000
"""Largest number of things of one name that are told apart."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RememberedPlace:
    """A waypoint of the semantic map under its id, "W1" for the first in the file."""

    id: str
    waypoint: Waypoint


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class RememberedThing:
    """A thing that was seen from remembered places; compared by identity.

    Attributes:
        id: "T1"; it stays while the thing does.
    """

    id: str
    thing: Thing

    @property
    def point(self) -> Point:
        """Where it is; of one without a position, where it was seen from."""
        return self.thing.position or self.thing.supporting[0].place


Remembered = RememberedPlace | RememberedThing


class Recollection:
    """All that is remembered, on one map; compared by identity.

    Args:
        things: The same under their ids, in the order of these.
        n_named: How many ids were ever given.
        find_vectors: Find what compares meanings, or None.
    """

    def __init__(
        self,
        memory: SemanticMap,
        found: Things,
        *,
        things: Sequence[RememberedThing],
        n_named: int,
        find_vectors: Callable[[], TextVectors | None],
    ) -> None:
        self.memory = memory
        self.found = found
        self.things = tuple(things)
        self.n_named = n_named
        self.places = number_places(memory.waypoints)
        self._find_vectors = find_vectors
        self._lock = threading.Lock()
        self._index: EntryIndex | None = None

    def is_of(self, memory: SemanticMap, grid: OccupancyGrid) -> bool:
        """Return True when it was made of these records and this very map."""
        return self.found.sight.grid is grid and self.memory.waypoints == memory.waypoints

    @property
    def everything(self) -> tuple[Remembered, ...]:
        """The places, then the things."""
        return (*self.places, *self.things)

    def prepare(self) -> None:
        """Build the index that answers questions; a question asked meanwhile waits for it."""
        with self._lock:
            if self._index is None:
                self._index = EntryIndex(self._entries, vectors=self._find_vectors())

    def find(self, query: str, *, among: frozenset[str] | None = None, limit: int = 5) -> Answer:
        """Find places and things by name, meaning or words; the entries have their ids.

        Args:
            among: The ids to choose from; all where None.
        """
        self.prepare()
        assert self._index is not None  # noqa: S101 - it was just prepared
        return self._index.find(query, among=among, limit=limit)

    def find_called(self, words: str) -> tuple[RememberedThing, ...]:
        """Find the things with that very name: case, plural and typing errors do not count."""
        answer = self._names.find(words, limit=MOST_CALLED)
        ids = {each.entry.id for each in answer.candidates if each.basis is Basis.NAME}
        return tuple(each for each in self.things if each.id in ids)

    def find_thing(self, thing_id: str) -> RememberedThing | None:
        """Return the thing with that id, or None."""
        return next((each for each in self.things if each.id == thing_id), None)

    def find_place(self, name: str) -> RememberedPlace | None:
        """Return the record of exactly that name, or None."""
        return self._by_name.get(name)

    @cached_property
    def _by_name(self) -> dict[str, RememberedPlace]:
        return {place.waypoint.name: place for place in self.places}

    @cached_property
    def _names(self) -> EntryIndex:
        """The index of names alone, for which no meanings are compared."""
        bare = (
            Entry(
                id=each.id,
                kind=EntryKind.THING,
                name=each.thing.label,
                other_names=each.thing.other_labels,
            )
            for each in self.things
        )
        return EntryIndex(tuple(bare))

    @cached_property
    def _entries(self) -> tuple[Entry, ...]:
        places = (_place_entry(each) for each in self.places)
        return (*places, *(_thing_entry(each, self._by_name) for each in self.things))


class Judge:
    """All findings of a memory, and how far each remembered place and thing may be trusted."""

    def __init__(self, findings: Iterable[MemoryFinding]) -> None:
        self.findings = tuple(findings)
        # By identity: findings hold the very things, and comparing those as values is slow.
        self._of_thing: dict[int, list[int]] = defaultdict(list)
        self._of_waypoint: dict[str, list[int]] = defaultdict(list)
        for number, finding in enumerate(self.findings):
            for thing in finding.things:
                self._of_thing[id(thing)].append(number)
            for name in () if finding.things else finding.waypoints:
                self._of_waypoint[name].append(number)

    def judge_thing(self, remembered: RememberedThing, *, now: datetime | None) -> Trust:
        """Return the trust that a thing deserves at a moment; without one its age is no matter."""
        thing = remembered.thing
        numbers = set(self._of_thing.get(id(thing), ()))
        for name in thing.waypoints:
            numbers.update(self._of_waypoint.get(name, ()))
        return judge_trust(thing, [self.findings[each] for each in sorted(numbers)], now=now)

    def judge_place(self, place: RememberedPlace) -> Trust:
        """Return the trust that a record deserves: it is sure until something speaks against it."""
        ratio, against = 1.0, []
        for number in self._of_waypoint.get(place.waypoint.name, ()):
            finding = self.findings[number]
            if finding.label is None and finding.weight < 1.0:
                ratio *= finding.weight
                against.append(finding)
        return Trust(ratio, tuple(against))


class Recollector:
    """Keeps what was made of a memory and a map until one of them changes.

    Args:
        find_model: Finds what compares meanings, once; None compares words.
        kept: A folder for the vectors of texts and the things, so that a later session need not
            compute them again; None keeps none. One that cannot be written costs only that.
    """

    def __init__(
        self, find_model: Callable[[], Embedder | None] = lambda: None, *, kept: Path | None = None
    ) -> None:
        self._find_model = find_model
        self._kept = kept
        self._lock = threading.Lock()
        # Held while the model is loaded, by the first question or ahead of it.
        self._loading = threading.RLock()
        self._latest: Recollection | None = None
        self._n_joined = 0

    def recollect(self, memory: SemanticMap, grid: OccupancyGrid) -> Recollection:
        """Return what is remembered on a map; things keep their ids."""
        with self._lock:
            latest = self._latest
            if latest is None or not latest.is_of(memory, grid):
                self._latest = latest = self._make(memory, grid, latest)
            return latest

    @property
    def latest(self) -> Recollection | None:
        """What was made last; makes none anew."""
        return self._latest

    def warm(self, memory: SemanticMap) -> None:
        """Load the model and make the vectors of a memory's texts, so that no question need.

        A question that comes meanwhile waits for it; without a model there is nothing to do.
        """
        with self._loading:
            if self._vectors is not None:
                EntryIndex(list_entries(memory), vectors=self._vectors)

    @property
    def embedder(self) -> Embedder | None:
        """What compares meanings; None where no model is installed, or a broken one."""
        with self._loading:
            return self._embedder

    @cached_property
    def _embedder(self) -> Embedder | None:
        try:
            return self._find_model()
        except ConfigError as error:
            logger.warning("Meanings are not compared: %s", error)
            return None

    @cached_property
    def _vectors(self) -> TextVectors | None:
        return (
            None
            if self._embedder is None
            else TextVectors(self._embedder, kept=self._kept and self._kept / "vectors.npz")
        )

    def _find_vectors(self) -> TextVectors | None:
        with self._loading:
            return self._vectors

    def keep(self) -> None:
        """Write the vectors of texts that are new since they were written last."""
        vectors: TextVectors | None = self.__dict__.get("_vectors")
        if vectors is not None:
            vectors.keep()

    def keep_things(self) -> None:
        """Write the things if most of the work to find them would be done again."""
        with self._lock:
            latest, n_joined = self._latest, self._n_joined
        if self._kept is not None and latest is not None and n_joined >= KEPT_FROM:
            keep_things(self._kept / THINGS_FILE, latest.found)
            self._n_joined -= n_joined

    def _load_things(self, memory: SemanticMap) -> Things | None:
        is_large = sum(len(place.landmarks) for place in memory.waypoints) >= KEPT_FROM
        return load_things(self._kept / THINGS_FILE) if self._kept and is_large else None

    def _make(
        self, memory: SemanticMap, grid: OccupancyGrid, earlier: Recollection | None
    ) -> Recollection:
        known = earlier.found if earlier else self._load_things(memory)
        found = find_things(memory, grid, earlier=known)
        joined = found.pools.keys() - known.pools.keys() if known else found.pools.keys()
        self._n_joined += sum(map(len, joined))
        things, n_named = number_things(
            found.things,
            () if earlier is None else earlier.things,
            n_named=0 if earlier is None else earlier.n_named,
        )
        return Recollection(
            memory, found, things=things, n_named=n_named, find_vectors=self._find_vectors
        )


def number_places(waypoints: Sequence[Waypoint]) -> tuple[RememberedPlace, ...]:
    """Return waypoints as remembered places with ids, in the order of the file."""
    return tuple(
        RememberedPlace(id=f"W{number}", waypoint=waypoint)
        for number, waypoint in enumerate(waypoints, start=1)
    )


def number_things(
    things: Sequence[Thing], earlier: Sequence[RememberedThing], *, n_named: int
) -> tuple[tuple[RememberedThing, ...], int]:
    """Return things under the ids that they had before, and new things under new ones.

    Args:
        n_named: How many ids were ever given; a thing that is gone leaves its id unused.

    Returns:
        The things in the order of their ids, and how many ids were ever given.
    """
    # By identity first: that is most of them, and to compare them as values is slow.
    very_same = {id(each.thing): each for each in earlier}
    ids: dict[int, RememberedThing] = {
        number: very_same.pop(id(thing))
        for number, thing in enumerate(things)
        if id(thing) in very_same
    }
    same = {each.thing: each for each in very_same.values()}
    for number, thing in enumerate(things):
        if number not in ids and thing in same:
            ids[number] = replace(same.pop(thing), thing=thing)
    new = [number for number in range(len(things)) if number not in ids]
    gone = list(same.values())
    seen_better = match_best_first(
        ((rank, number), each.id, number)
        for number in new
        for each in gone
        if (rank := _sameness(things[number], each.thing)) is not None
    )
    for number, thing_id in seen_better.items():
        ids[number] = RememberedThing(id=thing_id, thing=things[number])
    for number in new:
        if number not in ids:
            n_named += 1
            ids[number] = RememberedThing(id=f"T{n_named}", thing=things[number])
    return tuple(sorted(ids.values(), key=lambda each: int(each.id[1:]))), n_named


def _sameness(thing: Thing, before: Thing) -> tuple[int, float] | None:
    """Rank how surely one thing is another that was known before; None for another thing."""
    if not name_the_same(thing.label, before.label):
        return None
    n_shared = len(_views_of(thing) & _views_of(before))
    if thing.position is None or before.position is None:
        return (-n_shared, 0.0) if n_shared else None
    away_m = thing.position.distance_to(before.position)
    return (-n_shared, away_m) if n_shared or away_m <= SAME_THING_M else None


def _views_of(thing: Thing) -> set[tuple[str, str]]:
    return {(view.waypoint, view.landmark.label) for view in thing.supporting}


def _place_entry(place: RememberedPlace) -> Entry:
    return Entry(
        id=place.id,
        kind=EntryKind.PLACE,
        name=place.waypoint.name,
        description=place.waypoint.description,
        features=place.waypoint.geometric_features,
    )


def _thing_entry(remembered: RememberedThing, by_name: dict[str, RememberedPlace]) -> Entry:
    thing = remembered.thing
    seen_from = [by_name[name].waypoint for name in dict.fromkeys(thing.waypoints)]
    notes = dict.fromkeys(view.landmark.note for view in thing.supporting if view.landmark.note)
    return Entry(
        id=remembered.id,
        kind=EntryKind.THING,
        name=thing.label,
        other_names=thing.other_labels,
        category="safety equipment" if thing.category is Category.SAFETY else None,
        # Each is compared as a sentence of its own.
        purpose="\n".join(thing.purposes) or None,
        note="\n".join(notes) or None,
        place="\n".join(place.name for place in seen_from),
        surroundings=tuple(dict.fromkeys(_said_of(seen_from))),
    )


def _said_of(places: Sequence[Waypoint]) -> Iterator[str]:
    for place in places:
        yield place.description
        yield from place.geometric_features
