"""What the words inside a phrase mean: a name, a thing seen from a place, or "the door"."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

from mapspeak.errors import GoalError
from mapspeak.geometry import Point
from mapspeak.navigation.atlas import Atlas, RememberedPlace
from mapspeak.navigation.naming import (
    MOST_NAMED,
    AmbiguousPlaceError,
    Place,
    find_named,
    say_spot,
)
from mapspeak.navigation.relations.referent import Referent, refer_to, refer_to_point
from mapspeak.navigation.relations.words import GAP, pattern, plain
from mapspeak.semantic import Landmark, name_key
from mapspeak.spatial.paths import cells_on_line
from mapspeak.spatial.rooms import Region, RoomClass

__all__ = ["find_by_kind", "find_known", "find_room_here"]

SAME_THING_M = 0.5
"""Things of one name so near to each other are one."""
ROOM = pattern(r"(?:(?P<here>this|current|same) )?(?P<noun>room|corridor|hallway|open space|area)")
CLASSES = {
    "room": (RoomClass.ROOM, RoomClass.OPEN_SPACE),
    "corridor": (RoomClass.CORRIDOR,),
    "hallway": (RoomClass.CORRIDOR,),
}
"""What a word may be said of; other words of all."""
DOOR = pattern(r"(?:door|doorway)(?: (?:of|in|to) (?P<room>.+))?")
OF_PLACE = pattern(r"(?P<label>.+?) (?:of|at|seen from|from) (?P<place>.+)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """A thing that was seen from a remembered place.

    Attributes:
        seen_from: The place.
        landmark: The thing.
        point: Where it is.
    """

    seen_from: RememberedPlace
    landmark: Landmark
    point: Point


def find_known(atlas: Atlas, words: str) -> Referent | None:
    """Finds what is called so, without reading any relation in it; None where nothing is.

    Raises:
        GoalError: Several things are called so, or nobody noted where the thing is.
    """
    for wanted in dict.fromkeys((words.strip(), plain(words))):
        place = find_named(atlas, wanted) or _find_loosely(atlas, wanted)
        if place is not None:
            return refer_to(atlas, place)
    wanted = plain(words)
    place = find_by_kind(atlas, wanted)
    return _find_sighting(atlas, wanted) if place is None else refer_to(atlas, place)


def find_by_kind(atlas: Atlas, words: str) -> Place | None:
    """Finds "the room", "the corridor" and "the door", where only one can be meant.

    Raises:
        GoalError: Several can be meant, or none.
    """
    wanted = plain(words)
    if (match := ROOM.fullmatch(wanted)) is not None:
        room = _find_room(atlas, match)
        return Place(room.id, room)
    return _find_only_door(atlas, wanted)


def find_room_here(atlas: Atlas) -> Region:
    """Gives the region that the robot stands in.

    Raises:
        GoalError: It stands in none.
    """
    region = atlas.rooms.find_region_at(atlas.robot.point)
    if region is None:
        raise GoalError("The robot stands in no room.", hint="Name the room by its id, such as R1.")
    return region


def _find_room(atlas: Atlas, match: re.Match[str]) -> Region:
    """Gives the room that "the room" means: where the robot stands, or the only one there is."""
    classes = CLASSES.get(match["noun"].casefold(), tuple(RoomClass))
    here = atlas.rooms.find_region_at(atlas.robot.point)
    if here is not None and here.room_class in classes:
        return here
    others = [each for each in atlas.rooms.regions if each.room_class in classes]
    if len(others) == 1 and not match["here"]:
        return others[0]
    where = "no room" if here is None else here.id
    ids = ", ".join(each.id for each in others[:MOST_NAMED]) or "none known"
    raise AmbiguousPlaceError(
        f"The robot stands in {where}; which {match['noun']} is meant?",
        hint=f"Say it by its id: {ids}.",
        words=match[0],
        meanings=[each.id for each in others],
    )


def _loose_key(name: str) -> str:
    return name_key(re.sub(GAP, " ", name))


def _find_loosely(atlas: Atlas, wanted: str) -> Place | None:
    """Finds a remembered name, spelt with underscores or hyphens instead of spaces."""
    key = _loose_key(wanted)
    names = {each.waypoint.name for each in atlas.places if _loose_key(each.waypoint.name) == key}
    return find_named(atlas, names.pop()) if len(names) == 1 else None


def _find_sighting(atlas: Atlas, wanted: str) -> Referent | None:
    """Finds a thing that was seen from a remembered place, with "seen from W1" or without."""
    seen = [(place, thing) for place, thing in _sights(atlas) if _is_called(thing, wanted)]
    match = OF_PLACE.fullmatch(wanted)
    if not seen and match is not None:
        by = find_named(atlas, plain(match["place"]))
        seen = [
            (place, thing)
            for place, thing in _sights(atlas)
            if _is_called(thing, match["label"]) and by is not None and by.thing is place
        ]
    if not seen:
        return None
    located = [
        Sighting(seen_from=place, landmark=thing, point=point)
        for place, thing in seen
        if (point := _where(place, thing)) is not None
    ]
    if not located:
        ids = ", ".join(dict.fromkeys(place.id for place, _ in seen))
        raise GoalError(
            f"{wanted[:80]!r} was seen from {ids}, but not how far off in which direction.",
            hint=f"Call navigate_to with {seen[0][0].id} and look from there.",
        )
    return _refer_to_only(atlas, wanted, located)


def _refer_to_only(atlas: Atlas, wanted: str, located: list[Sighting]) -> Referent:
    first = located[0]
    if any(each.point.distance_to(first.point) > SAME_THING_M for each in located):
        shown = "; ".join(
            f"the one seen from {each.seen_from.id}, at {say_spot(each.point)}"
            for each in located[:MOST_NAMED]
        )
        raise AmbiguousPlaceError(
            f"Several things are called {wanted[:80]!r}.",
            hint=f"They are {shown}. Say which, such as "
            f"'{wanted[:80]} seen from {first.seen_from.id}', or give x, y.",
            words=wanted,
            meanings=[
                f"{each.point.x:.3f}, {each.point.y:.3f}"
                for n, each in enumerate(located)
                if all(each.point.distance_to(other.point) > SAME_THING_M for other in located[:n])
            ],
        )
    home = _last_region_before(atlas, first)
    name = f"{first.landmark.label} (seen from {first.seen_from.id})"
    return refer_to_point(atlas, name, first.point, home=home)


def _last_region_before(atlas: Atlas, sighting: Sighting) -> Region | None:
    """Gives the region of the last floor on the line of sight: a thing may hang on a wall."""
    start = sighting.seen_from.waypoint.pose.point
    rows, cols = cells_on_line(atlas.grid, start, sighting.point)
    inside = (rows >= 0) & (rows < atlas.grid.n_rows) & (cols >= 0) & (cols < atlas.grid.n_cols)
    indices = [
        int(atlas.rooms.labels[row, col])
        for row, col in zip(rows[inside].tolist(), cols[inside].tolist(), strict=True)
        if atlas.grid.free[row, col] and atlas.rooms.labels[row, col]
    ]
    return next((each for each in atlas.rooms.regions if indices[-1:] == [each.index]), None)


def _sights(atlas: Atlas) -> Iterator[tuple[RememberedPlace, Landmark]]:
    for place in atlas.places:
        for landmark in place.waypoint.landmarks:
            yield place, landmark


def _where(place: RememberedPlace, landmark: Landmark) -> Point | None:
    """Gives where a thing is; None where its bearing or range was not noted."""
    if landmark.bearing_rad is None or landmark.range_m is None:
        return None
    ahead_m = landmark.range_m * math.cos(landmark.bearing_rad)
    left_m = landmark.range_m * math.sin(landmark.bearing_rad)
    return place.waypoint.pose.transform(Point(ahead_m, left_m))


def _is_called(thing: Landmark, wanted: str) -> bool:
    return _loose_key(thing.label) == _loose_key(plain(wanted))


def _find_only_door(atlas: Atlas, wanted: str) -> Place | None:
    """Finds "the door": the only one of the room that is named, or that the robot stands in."""
    match = DOOR.fullmatch(wanted)
    if match is None:
        return None
    room = find_room_here(atlas)
    if match["room"] is not None:
        known = find_known(atlas, match["room"])
        if known is None or known.region is None:
            return None
        room = known.region
    doors = atlas.rooms.doors_of(room)
    if len(doors) == 1:
        return Place(doors[0].id, doors[0])
    ids = ", ".join(door.id for door in doors[:MOST_NAMED]) or "none"
    raise GoalError(f"{room.id} has {len(doors)} doors.", hint=f"Say which one by its id: {ids}.")
