"""Forget places and things reversibly."""

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, replace

from mapspeak.errors import SemanticMapError
from mapspeak.memory.quoting import name_key
from mapspeak.memory.store.memorystore import MemoryStore, Records
from mapspeak.memory.waypoint import Landmark, SemanticMap, Waypoint

Seen = tuple[str, str, float | None, float | None]
"""One view of a thing: the `name_key` of the place, label, bearing and range."""

_Test = Callable[[Waypoint, Landmark | None], bool]
"""Returns True for the places, or landmarks, to change."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Forgotten:
    """Records that were forgotten, or are remembered again.

    Attributes:
        places: Names of whole places.
        seen_from: Names of places with single such landmarks.
        n_landmarks: Number of these landmarks.
    """

    places: tuple[str, ...] = ()
    seen_from: tuple[str, ...] = ()
    n_landmarks: int = 0


def view_of(waypoint: str, landmark: Landmark) -> Seen:
    """Return the key of a view, independent of the frame of its place."""
    return name_key(waypoint), landmark.label, landmark.bearing_rad, landmark.range_m


def forget_place(store: MemoryStore, name: str) -> Forgotten:
    """Forget a place with all that was seen from there."""
    key = name_key(name)
    return _mark(store, lambda place, each: each is None and name_key(place.name) == key)


def forget_views(store: MemoryStore, views: Collection[Seen]) -> Forgotten:
    """Forget landmarks: all views of a thing, whatever records have them."""
    return _mark(store, lambda place, each: each is not None and view_of(place.name, each) in views)


def forget_label(store: MemoryStore, label: str) -> Forgotten:
    """Forget every landmark of a label, wherever it was seen."""
    key = name_key(label)
    return _mark(store, lambda _, each: each is not None and name_key(each.label) == key)


def restore(store: MemoryStore, name: str) -> Forgotten:
    """Restore a place, or landmarks, forgotten under a name."""
    key = name_key(name)
    return _mark(
        store,
        lambda place, each: name_key(place.name if each is None else each.label) == key,
        is_gone=False,
    )


def rename_place(store: MemoryStore, name: str, *, to: str) -> None:
    """Rename a place; nothing is left under the old name.

    Raises:
        SemanticMapError: There is no such place, or another one has that name.
    """

    def change(records: Records) -> None:
        named = {name_key(place.name): place for place in records.read().waypoints}
        place, taken = named.get(name_key(name)), named.get(name_key(to))
        if place is None or place.is_gone:
            raise SemanticMapError(f"Nothing is remembered as {name[:80]!r}.", hint="Look again.")
        if taken is not None and taken is not place and not taken.is_gone:
            raise SemanticMapError(f"Another place is called {to[:80]!r}.", hint="Choose a name.")
        records.rename_place(name_key(name), replace(place, name=to))

    store.change(change, alone=True)


def _mark(store: MemoryStore, is_meant: _Test, *, is_gone: bool = True) -> Forgotten:
    """Mark the matching records as gone or not, all or none."""
    done: list[Forgotten] = []

    def is_to_change(place: Waypoint, each: Landmark | None) -> bool:
        return (each or place).is_gone != is_gone and is_meant(place, each)

    def change(known: SemanticMap) -> Iterable[Waypoint]:
        views = {
            place.name: [each for each in place.landmarks if is_to_change(place, each)]
            for place in known.waypoints
        }
        whole = [place.name for place in known.waypoints if is_to_change(place, None)]
        done.append(
            Forgotten(
                places=tuple(whole),
                seen_from=tuple(name for name, seen in views.items() if seen),
                n_landmarks=sum(map(len, views.values())),
            )
        )
        return [
            replace(
                place,
                is_gone=is_gone if place.name in whole else place.is_gone,
                safety_landmarks=mark(place.safety_landmarks, views[place.name]),
                functional_landmarks=mark(place.functional_landmarks, views[place.name]),
            )
            for place in known.waypoints
            if place.name in whole or views[place.name]
        ]

    def mark(landmarks: Iterable[Landmark], meant: Collection[Landmark]) -> tuple[Landmark, ...]:
        marked = (
            each if each not in meant else replace(each, is_gone=is_gone) for each in landmarks
        )
        return tuple(marked)

    store.write_all(change)
    return done[-1]
