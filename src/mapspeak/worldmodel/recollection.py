"""What is remembered, joined with one map: places and things under their ids, ready to be asked.

Making it is costly, so it is made when first asked for and kept until memory or map change.
"""

import logging
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from mapspeak.errors import ConfigError
from mapspeak.geometry import Point
from mapspeak.memory import SemanticMap, Waypoint
from mapspeak.memory.consistency.unseen import UnseenThings, find_near
from mapspeak.memory.search.answer import Answer, Entry, EntryKind, list_entries
from mapspeak.memory.search.index import EntryIndex
from mapspeak.memory.search.meaningindex import Embedder, TextVectors
from mapspeak.memory.store.reading import Contents
from mapspeak.memory.things.finding import Things, find_things
from mapspeak.memory.things.thing import Category
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray
from mapspeak.worldmodel.keptvalues import keep_value, lasting, load_value
from mapspeak.worldmodel.remembered import (
    Remembered,
    RememberedPlace,
    RememberedThing,
    number_places,
    number_things,
)
from mapspeak.worldmodel.reported import ReportJoiner
from mapspeak.worldmodel.thingids import IDS_FILE, ThingIds, ViewKeys

logger = logging.getLogger(__name__)

KEPT_FROM = 1000
"""Things are kept once so many views were joined anew, and their index once so many entries are
new: fewer are made in a moment."""
THINGS_FILE, INDEX_FILE = "things.cache", "index.cache"


class Search:
    """The index that answers questions, brought to what is asked for; safe between threads.

    Args:
        find_vectors: Find what compares meanings, or None.
        kept: A file for the index; None keeps none.
    """

    def __init__(
        self, find_vectors: Callable[[], TextVectors | None], *, kept: Path | None
    ) -> None:
        self._find_vectors = find_vectors
        self._kept = kept
        self._lock = threading.Lock()
        self._index: EntryIndex | None = None
        self._said: dict[Remembered, Entry] = {}

    @contextmanager
    def holding(self, recollection: "Recollection") -> Iterator[EntryIndex]:
        """Give the index with exactly the entries of this; another question waits meanwhile."""
        with self._lock:
            if self._index is None:
                with lasting() if recollection.is_large else nullcontext():
                    self._index = self._begin(is_large=recollection.is_large)
                    self._index.hold(recollection.entries)
            self._index.hold(recollection.entries)
            yield self._index

    def _begin(self, *, is_large: bool) -> EntryIndex:
        vectors, kept = self._find_vectors(), None
        if self._kept is not None and is_large:
            kept = load_value(self._kept, EntryIndex, vectors=vectors)
        return kept if kept and kept.vectors is vectors else EntryIndex(vectors=vectors)

    def keep(self) -> None:
        """Write the index if much of it is new."""
        with self._lock:
            if self._kept is not None and self._index and self._index.n_new >= KEPT_FROM:
                keep_value(self._kept, self._index)
                self._index.n_new = 0

    def list_entries(self, recollection: "Recollection") -> Mapping[str, Entry]:
        """Return what is said of places and things by their ids; of the same ones it stays."""
        everything = recollection.by_id.values()
        known = map(self._said.get, everything)
        self._said = {
            each: said or recollection.describe(each)
            for each, said in zip(everything, known, strict=True)
        }
        return dict(zip(recollection.by_id, self._said.values(), strict=True))


class Recollection:
    """All that is remembered, on one map; compared by identity.

    Args:
        places: The records under their ids.
        things: The things of these under their ids, in the order of these.
        ids: The numbers that views bear.
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
        ids: ThingIds,
        unseen: UnseenThings,
        search: Search,
    ) -> None:
        self.memory = memory
        self.grid = grid
        self.found = found
        self.places = tuple(places)
        self.things = tuple(things)
        self.ids = ids
        self.unseen = unseen
        self._search = search
        self._around: dict[tuple[Point, float], FloatArray] = {}

    def is_of(self, memory: SemanticMap, grid: OccupancyGrid) -> bool:
        """Return True when it was made of these records and this very map."""
        return self.grid is grid and self.memory.waypoints == memory.waypoints

    @property
    def is_large(self) -> bool:
        """True where making it takes so long that it is worth keeping."""
        return len(self.places) + len(self.things) >= KEPT_FROM

    @cached_property
    def by_id(self) -> Mapping[str, Remembered]:
        """The places, then the things, each under its id."""
        everything: tuple[Remembered, ...] = (*self.places, *self.things)
        return {each.id: each for each in everything}

    def prepare(self) -> None:
        """Bring the index that answers questions to this; a question meanwhile waits for it."""
        with self._search.holding(self):
            pass

    def find(self, query: str, *, among: frozenset[str] | None = None, limit: int = 5) -> Answer:
        """Find places and things by name, meaning or words; the entries have their ids.

        Args:
            among: The ids to choose from; all where None.
        """
        with self._search.holding(self) as index:
            return index.find(query, among=among, limit=limit)

    def find_called(self, words: str) -> tuple[RememberedThing, ...]:
        """Find the things with that very name: case, plural and typing errors do not count."""
        with self._search.holding(self) as index:
            ids = index.find_called(words)
        return tuple(each for each in self.things if each.id in ids)

    def find_thing(self, thing_id: str) -> RememberedThing | None:
        """Return the thing with that id, or None."""
        found = self.by_id.get(thing_id)
        return found if isinstance(found, RememberedThing) else None

    def find_became(self, thing_id: str) -> RememberedThing | None:
        """Return the thing that has most views of one whose id is gone; None where none has any."""
        keys = ViewKeys(self.memory.waypoints)
        shared = [self.ids.count_bearing(thing_id, keys.of(each.thing)) for each in self.things]
        return self.things[shared.index(max(shared))] if any(shared) else None

    def find_around(self, point: Point, reach_m: float) -> FloatArray:
        """Return where things are, one at the point itself too, within reach; shape (n, 2)."""
        known = self._around.get((point, reach_m))
        if known is None:
            at = self.unseen.at
            known = at[find_near(at, (point.x, point.y), reach_m)]
            self._around[point, reach_m] = known
        return known

    def find_place(self, name: str) -> RememberedPlace | None:
        """Return the record of exactly that name, or None."""
        return self._by_name.get(name)

    @cached_property
    def _by_name(self) -> dict[str, RememberedPlace]:
        return {place.waypoint.name: place for place in self.places}

    @cached_property
    def entries(self) -> Mapping[str, Entry]:
        """What is said of places and things, by their ids."""
        return self._search.list_entries(self)

    def describe(self, each: Remembered) -> Entry:
        """Return what is said of a place or a thing."""
        if isinstance(each, RememberedPlace):
            return _place_entry(each)
        return _thing_entry(each, self._by_name)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KeptMemory:
    """What is kept of a memory for a later session.

    Attributes:
        contents: The records as they were parsed: the very ones that things were joined of.
    """

    contents: Contents
    found: Things


class Recollector:
    """Keeps what was made of a memory and a map until one of them changes.

    Args:
        find_model: Finds what compares meanings, once; None compares words.
        kept: A folder for the vectors of texts and the things, so that a later session need not
            compute them again; None keeps none. One that cannot be written costs only that.

    Attributes:
        reports: Joins what the robot's detector reported and nobody wrote down.
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
        self._n_new = 0
        self._earlier: KeptMemory | None = None
        self._contents = Contents()
        self._search = Search(self._find_vectors, kept=kept and kept / INDEX_FILE)
        self._ids = ThingIds(kept and kept / IDS_FILE)
        self.reports = ReportJoiner()

    def recollect(self, memory: SemanticMap, grid: OccupancyGrid) -> Recollection:
        """Return what is remembered on a map; things keep their ids."""
        with self._lock:
            latest = self._latest
            if latest is None or not latest.is_of(memory, grid):
                is_first = latest is None and len(memory.waypoints) >= KEPT_FROM
                with lasting() if is_first else nullcontext():
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
        if (vectors := self._made_vectors) is not None:
            vectors.keep()

    def keep_if_many(self) -> None:
        """Write them once there are so many that it is worth it."""
        if (vectors := self._made_vectors) is not None:
            vectors.keep_if_many()

    @property
    def _made_vectors(self) -> TextVectors | None:
        found: TextVectors | None = self.__dict__.get("_vectors")
        return found

    def load_records(self) -> Contents | None:
        """Return the records that were kept with the things; they are read only once."""
        path = self._kept and self._kept / THINGS_FILE
        self._earlier = None if path is None else load_value(path, KeptMemory)
        if self._earlier is None:
            return None
        self._contents = self._earlier.contents
        return self._contents

    def keep_records(self, contents: Contents) -> None:
        """Keep these records with the things, once there are any."""
        with self._lock:
            self._contents = contents
            self._n_new += KEPT_FROM

    def keep_things(self) -> None:
        """Write the things and their index if most of the work would be done again."""
        self._search.keep()
        with self._lock:
            latest, n_new = self._latest, self._n_new
        if self._kept is not None and latest is not None and n_new >= KEPT_FROM:
            kept = KeptMemory(contents=self._contents, found=latest.found)
            keep_value(self._kept / THINGS_FILE, kept)
            self._n_new -= n_new

    def _take_kept(self, memory: SemanticMap) -> Things | None:
        if sum(len(place.landmarks) for place in memory.waypoints) < KEPT_FROM:
            return None
        if self._earlier is None:
            self.load_records()
        earlier, self._earlier = self._earlier, None
        return None if earlier is None else earlier.found

    def _make(
        self, memory: SemanticMap, grid: OccupancyGrid, earlier: Recollection | None
    ) -> Recollection:
        known = earlier.found if earlier else self._take_kept(memory)
        found = find_things(memory, grid, earlier=known)
        self._n_new += found.n_joined
        before, keys = earlier.things if earlier else (), ViewKeys(memory.waypoints)
        return Recollection(
            memory,
            grid,
            found,
            places=number_places(memory.waypoints, () if earlier is None else earlier.places),
            things=number_things(found.things, before, self._ids, keys),
            ids=self._ids,
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
