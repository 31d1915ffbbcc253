"""What is remembered, joined with one map: places and things under their ids, ready to be asked.

Making it is costly, so it is made when first asked for and kept until memory or map change.
"""

import logging
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from functools import cached_property
from pathlib import Path

import numpy as np

from mapspeak.errors import ConfigError
from mapspeak.geometry import Point
from mapspeak.memory import SemanticMap, Waypoint
from mapspeak.memory.consistency.checking import MemoryCheck
from mapspeak.memory.consistency.findings import MemoryFinding, Trust, judge_trust
from mapspeak.memory.consistency.unseen import UnseenThings
from mapspeak.memory.search.answer import Answer, Entry, EntryKind, list_entries
from mapspeak.memory.search.index import EntryIndex
from mapspeak.memory.search.meaningindex import Embedder, TextVectors
from mapspeak.memory.things.finding import Things, find_things
from mapspeak.memory.things.thing import Category
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray
from mapspeak.worldmodel.keptthings import keep_things, load_things
from mapspeak.worldmodel.remembered import (
    Remembered,
    RememberedPlace,
    RememberedThing,
    number_places,
    number_things,
)

logger = logging.getLogger(__name__)

KEPT_FROM = 1000
"""Things are kept once so many views were joined anew; fewer are joined in a moment."""
THINGS_FILE = "things.cache"


class Search:
    """The index that answers questions, brought to what is asked for; safe between threads.

    Args:
        find_vectors: Find what compares meanings, or None.
    """

    def __init__(self, find_vectors: Callable[[], TextVectors | None]) -> None:
        self._find_vectors = find_vectors
        self._lock = threading.Lock()
        self._index: EntryIndex | None = None
        self._entries: dict[Remembered, Entry] = {}

    @contextmanager
    def holding(self, entries: Sequence[Entry]) -> Iterator[EntryIndex]:
        """Give the index with exactly these entries; another question waits meanwhile."""
        with self._lock:
            if self._index is None:
                self._index = EntryIndex(vectors=self._find_vectors())
            self._index.hold(entries)
            yield self._index

    def list_entries(self, recollection: "Recollection") -> tuple[Entry, ...]:
        """Return what is said of places and things; what is known of the same ones stays."""
        known = self._entries
        entries = {
            each: known.get(each) or recollection.describe(each) for each in recollection.everything
        }
        self._entries = entries
        return tuple(entries.values())


class Recollection:
    """All that is remembered, on one map; compared by identity.

    Args:
        places: The records under their ids.
        things: The things of these under their ids, in the order of these.
        n_named: How many ids were ever given.
        unseen: What looks say of the things that they do not name.
        search: Answers questions.
    """

    def __init__(
        self,
        memory: SemanticMap,
        grid: OccupancyGrid,
        found: Things,
        *,
        places: Sequence[RememberedPlace],
        things: Sequence[RememberedThing],
        n_named: int,
        unseen: UnseenThings,
        search: Search,
    ) -> None:
        self.memory = memory
        self.grid = grid
        self.found = found
        self.places = tuple(places)
        self.things = tuple(things)
        self.n_named = n_named
        self.unseen = unseen
        self._search = search

    def is_of(self, memory: SemanticMap, grid: OccupancyGrid) -> bool:
        """Return True when it was made of these records and this very map."""
        return self.grid is grid and self.memory.waypoints == memory.waypoints

    @property
    def everything(self) -> tuple[Remembered, ...]:
        """The places, then the things."""
        return (*self.places, *self.things)

    def prepare(self) -> None:
        """Bring the index that answers questions to this; a question meanwhile waits for it."""
        with self._search.holding(self._entries):
            pass

    def find(self, query: str, *, among: frozenset[str] | None = None, limit: int = 5) -> Answer:
        """Find places and things by name, meaning or words; the entries have their ids.

        Args:
            among: The ids to choose from; all where None.
        """
        with self._search.holding(self._entries) as index:
            return index.find(query, among=among, limit=limit)

    def find_called(self, words: str) -> tuple[RememberedThing, ...]:
        """Find the things with that very name: case, plural and typing errors do not count."""
        with self._search.holding(self._entries) as index:
            ids = index.find_called(words)
        return tuple(each for each in self.things if each.id in ids)

    def find_thing(self, thing_id: str) -> RememberedThing | None:
        """Return the thing with that id, or None."""
        return next((each for each in self.things if each.id == thing_id), None)

    def find_around(self, point: Point, reach_m: float) -> FloatArray:
        """Return where things are, one at the point itself too, within reach; shape (n, 2)."""
        off_m = np.hypot(self._positions[:, 0] - point.x, self._positions[:, 1] - point.y)
        return self._positions[off_m <= reach_m]

    @cached_property
    def _positions(self) -> FloatArray:
        known = (each.thing.position for each in self.things)
        return np.array([(at.x, at.y) for at in known if at is not None]).reshape(-1, 2)

    def find_place(self, name: str) -> RememberedPlace | None:
        """Return the record of exactly that name, or None."""
        return self._by_name.get(name)

    @cached_property
    def _by_name(self) -> dict[str, RememberedPlace]:
        return {place.waypoint.name: place for place in self.places}

    @cached_property
    def _entries(self) -> tuple[Entry, ...]:
        return self._search.list_entries(self)

    def describe(self, each: Remembered) -> Entry:
        """Return what is said of a place or a thing."""
        if isinstance(each, RememberedPlace):
            return _place_entry(each)
        return _thing_entry(each, self._by_name)


class Judge:
    """Says how far each remembered place and thing may be trusted.

    Args:
        check: Finds what speaks against them.
    """

    def __init__(self, check: MemoryCheck) -> None:
        self._check = check

    @property
    def findings(self) -> tuple[MemoryFinding, ...]:
        """All that is odd about the memory."""
        return self._check.findings

    def judge_thing(self, remembered: RememberedThing, *, now: datetime | None) -> Trust:
        """Return the trust that a thing deserves at a moment; without one its age is no matter."""
        thing = remembered.thing
        return judge_trust(thing, self._check.find_of_thing(thing), now=now)

    def judge_place(self, place: RememberedPlace) -> Trust:
        """Return the trust that a record deserves: it is sure until something speaks against it."""
        ratio, against = 1.0, []
        for finding in self._check.find_of_place(place.waypoint):
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
        self._search = Search(self._find_vectors)

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
        self._n_joined += found.n_joined
        things, n_named = number_things(
            found.things,
            () if earlier is None else earlier.things,
            n_named=0 if earlier is None else earlier.n_named,
        )
        return Recollection(
            memory,
            grid,
            found,
            places=number_places(memory.waypoints, () if earlier is None else earlier.places),
            things=things,
            n_named=n_named,
            unseen=UnseenThings(memory, found, earlier=None if earlier is None else earlier.unseen),
            search=self._search,
        )


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
