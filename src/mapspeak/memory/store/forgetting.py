"""Forgetting places and things, so that it can be undone."""

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, replace

from mapspeak.memory.quoting import name_key
from mapspeak.memory.store.memorystore import MemoryStore
from mapspeak.memory.waypoint import Landmark, SemanticMap, Waypoint

Seen = tuple[str, str, float | None, float | None]
"""One view of a thing: the `name_key` of the place, label, bearing and range."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Forgotten:
    """What was forgotten, or is remembered again.

    Attributes:
        places: Names of places that are so as a whole.
        seen_from: Names of places of which single landmarks are so.
        n_landmarks: How many these are.
    """

    places: tuple[str, ...] = ()
    seen_from: tuple[str, ...] = ()
    n_landmarks: int = 0


def view_of(waypoint: str, landmark: Landmark) -> Seen:
    """Return by what a view is known again, in whichever frame the place is."""
    return name_key(waypoint), landmark.label, landmark.bearing_rad, landmark.range_m


def forget_place(store: MemoryStore, name: str) -> Forgotten:
    """Forget a place with all that was seen from there."""
    return _change(store, lambda place: name_key(place.name) == name_key(name), _keep, is_gone=True)


def forget_views(store: MemoryStore, views: Collection[Seen]) -> Forgotten:
    """Forget landmarks: all views of a thing, whatever records have them."""
    return _change(
        store, _no_place, lambda place, each: view_of(place.name, each) in views, is_gone=True
    )


def forget_label(store: MemoryStore, label: str) -> Forgotten:
    """Forget every landmark of a label, wherever it was seen."""
    key = name_key(label)
    return _change(store, _no_place, lambda _, each: name_key(each.label) == key, is_gone=True)


def restore(store: MemoryStore, name: str) -> Forgotten:
    """Remember again what was forgotten under a name: a place, or landmarks of that label."""
    key = name_key(name)
    return _change(
        store,
        lambda place: name_key(place.name) == key,
        lambda _, each: name_key(each.label) == key,
        is_gone=False,
    )


def _keep(_: Waypoint, __: Landmark) -> bool:
    return False


def _no_place(_: Waypoint) -> bool:
    return False


def _change(
    store: MemoryStore,
    is_place: Callable[[Waypoint], bool],
    is_landmark: Callable[[Waypoint, Landmark], bool],
    *,
    is_gone: bool,
) -> Forgotten:
    done: list[Forgotten] = []

    def change(known: SemanticMap) -> Iterable[Waypoint]:
        changed = [
            (place, _changed(place, is_place, is_landmark, is_gone=is_gone))
            for place in known.waypoints
        ]
        done.append(_tell(changed))
        return [after for before, after in changed if after != before]

    store.write_all(change)
    return done[-1]


def _changed(
    place: Waypoint,
    is_place: Callable[[Waypoint], bool],
    is_landmark: Callable[[Waypoint, Landmark], bool],
    *,
    is_gone: bool,
) -> Waypoint:
    def marked(landmarks: Iterable[Landmark]) -> Iterator[Landmark]:
        for each in landmarks:
            yield replace(each, is_gone=is_gone) if is_landmark(place, each) else each

    return replace(
        place,
        is_gone=is_gone if is_place(place) else place.is_gone,
        safety_landmarks=tuple(marked(place.safety_landmarks)),
        functional_landmarks=tuple(marked(place.functional_landmarks)),
    )


def _tell(changed: Iterable[tuple[Waypoint, Waypoint]]) -> Forgotten:
    places, seen_from, n_landmarks = [], [], 0
    for before, after in changed:
        if before.is_gone != after.is_gone:
            places.append(after.name)
        n_here = sum(
            one.is_gone != other.is_gone
            for one, other in zip(before.landmarks, after.landmarks, strict=True)
        )
        if n_here:
            seen_from.append(after.name)
            n_landmarks += n_here
    return Forgotten(places=tuple(places), seen_from=tuple(seen_from), n_landmarks=n_landmarks)
