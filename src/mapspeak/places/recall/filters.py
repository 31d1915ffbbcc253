"""What a request is looked for in: the places and things that pass all filters."""

from collections.abc import Iterator
from datetime import datetime

from mapspeak.geometry import Point
from mapspeak.places.recall.answer import RecallQuery
from mapspeak.semantic import Landmark
from mapspeak.semantic.retrieval import EntryKind
from mapspeak.worldmodel.model import Atlas
from mapspeak.worldmodel.recollection import Remembered, RememberedPlace

__all__ = ["find_passing", "find_rooms", "kind_of", "last_seen", "list_views", "point_of"]


def find_passing(atlas: Atlas, query: RecallQuery) -> Iterator[Remembered]:
    """Gives the places, then the things, that pass every filter of a request."""
    everything: list[Remembered] = [*atlas.recollection.places, *atlas.things]
    return (each for each in everything if _passes(atlas, each, query))


def kind_of(remembered: Remembered) -> EntryKind:
    """Says whether it is a place or a thing."""
    return EntryKind.PLACE if isinstance(remembered, RememberedPlace) else EntryKind.THING


def point_of(remembered: Remembered) -> Point:
    """Gives where it is; of a thing without a position, where it was seen from."""
    if isinstance(remembered, RememberedPlace):
        return remembered.waypoint.pose.point
    return remembered.point


def find_rooms(atlas: Atlas, remembered: Remembered) -> tuple[str, ...]:
    """Gives the rooms it may be in, by id."""
    if isinstance(remembered, RememberedPlace):
        room_id = atlas.find_room_id(point_of(remembered))
        return () if room_id is None else (room_id,)
    return atlas.rooms_before(remembered)


def last_seen(atlas: Atlas, remembered: Remembered) -> datetime | None:
    """Gives when it was seen last, by the calendar; None where nobody noted it."""
    if isinstance(remembered, RememberedPlace):
        return remembered.waypoint.recorded_at
    times = (view.recorded_at for _, view in list_views(atlas, remembered))
    return max(filter(None, times), default=None)


def list_views(atlas: Atlas, remembered: Remembered) -> Iterator[tuple[RememberedPlace, Landmark]]:
    """Gives what was seen of a thing, each with its time and picture, and from where."""
    if isinstance(remembered, RememberedPlace):
        return
    for view in remembered.thing.supporting:
        place = atlas.recollection.find_place(view.waypoint)
        if place is not None:
            yield place, place.waypoint.dated(view.landmark)


def _passes(atlas: Atlas, remembered: Remembered, query: RecallQuery) -> bool:
    if query.kind not in (None, kind_of(remembered)):
        return False
    if query.near is not None and point_of(remembered).distance_to(query.near) > query.near_m:
        return False
    if query.since is not None or query.until is not None:
        seen_at = last_seen(atlas, remembered)
        if seen_at is None or not _is_between(seen_at, query):
            return False
    return query.room_id is None or query.room_id in find_rooms(atlas, remembered)


def _is_between(moment: datetime, query: RecallQuery) -> bool:
    is_late = query.since is None or moment >= query.since
    return is_late and (query.until is None or moment < query.until)
