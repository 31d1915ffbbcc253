"""What can be found: a remembered place, or a thing at one."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.semantic.retrieval.evidence import MatchField
from mapspeak.semantic.waypoint import Landmark, SemanticMap, Waypoint, name_key

__all__ = ["Entry", "EntryKind", "list_entries"]


class EntryKind(StrEnum):
    """What sort of thing is remembered."""

    PLACE = "place"
    THING = "thing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A place or a thing, with all that is said of it.

    Attributes:
        id: What its owner knows it by; no two entries share it.
        kind: Whether it is a place or a thing.
        name: The place's name or the thing's label.
        category: What sort of equipment it is.
        purpose: What it is good for.
        note: Anything else.
        description: The same in whole sentences.
        features: Persistent layout, such as "corner of two walls".
        place: For a thing, the name of the place where it is.
        surroundings: What is said of that place.
        other_names: What else it is called.
    """

    id: str
    kind: EntryKind
    name: str
    category: str | None = None
    purpose: str | None = None
    note: str | None = None
    description: str = ""
    features: tuple[str, ...] = ()
    place: str | None = None
    surroundings: tuple[str, ...] = ()
    other_names: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All that it is called, its own name first."""
        return (self.name, *self.other_names)

    @property
    def texts(self) -> tuple[tuple[MatchField, str], ...]:
        """All that is said of it, its name first; each text with the part of the record it is."""
        return tuple((field, text) for field, text in self._fields() if text)

    def _fields(self) -> Iterator[tuple[MatchField, str | None]]:
        called = MatchField.NAME if self.kind is EntryKind.PLACE else MatchField.LABEL
        yield from ((called, name) for name in self.names)
        yield MatchField.CATEGORY, self.category
        yield MatchField.PURPOSE, self.purpose
        yield MatchField.NOTE, self.note
        yield MatchField.DESCRIPTION, self.description
        yield from ((MatchField.FEATURE, feature) for feature in self.features)
        yield MatchField.PLACE, self.place
        yield from ((MatchField.PLACE, text) for text in self.surroundings)


def list_entries(semantic_map: SemanticMap) -> tuple[Entry, ...]:
    """Gives each place followed by the landmarks seen from it.

    A place is known by the key of its name; its landmark by both keys and, where one label stands
    there several times, by its number among those.
    """
    return tuple(entry for place in semantic_map.waypoints for entry in _entries_of(place))


def _entries_of(place: Waypoint) -> Iterator[Entry]:
    yield Entry(
        id=name_key(place.name),
        kind=EntryKind.PLACE,
        name=place.name,
        description=place.description,
        features=place.geometric_features,
    )
    n_before: Counter[str] = Counter()
    for landmark in place.landmarks:
        key = name_key(landmark.label)
        n_before[key] += 1
        number = f" / {n_before[key]}" if n_before[key] > 1 else ""
        yield _thing(landmark, place, id_=f"{name_key(place.name)} / {key}{number}")


def _thing(landmark: Landmark, place: Waypoint, *, id_: str) -> Entry:
    return Entry(
        id=id_,
        kind=EntryKind.THING,
        name=landmark.label,
        category="safety equipment" if landmark in place.safety_landmarks else None,
        purpose=landmark.purpose,
        note=landmark.note,
        place=place.name,
        surroundings=(place.description, *place.geometric_features),
    )
