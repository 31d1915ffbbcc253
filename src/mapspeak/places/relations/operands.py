"""What the words inside a phrase mean: a name, a thing seen from a place, or "the door"."""

import re
from collections.abc import Sequence

from mapspeak.errors import GoalError
from mapspeak.places.naming import (
    MOST_NAMED,
    AmbiguousPlaceError,
    Place,
    find_named,
    say_spot,
)
from mapspeak.places.relations.referent import Referent, refer_to
from mapspeak.places.relations.words import GAP, pattern, plain
from mapspeak.semantic import name_key
from mapspeak.spatial.rooms import Region, RoomClass
from mapspeak.worldmodel.model import Atlas, RememberedPlace, RememberedThing

__all__ = ["find_by_kind", "find_known", "find_room_here"]

ROOM = pattern(r"(?:(?P<here>this|current|same) )?(?P<noun>room|corridor|hallway|open space|area)")
CLASSES = {
    "room": (RoomClass.ROOM, RoomClass.OPEN_SPACE),
    "corridor": (RoomClass.CORRIDOR,),
    "hallway": (RoomClass.CORRIDOR,),
}
"""What a word may be said of; other words of all."""
DOOR = pattern(r"(?:door|doorway)(?: (?:of|in|to) (?P<room>.+))?")
OF_PLACE = pattern(r"(?P<label>.+?) (?:of|at|seen from|from) (?P<place>.+)")


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
    return _find_thing(atlas, wanted) if place is None else refer_to(atlas, place)


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


def _find_thing(atlas: Atlas, wanted: str) -> Referent | None:
    """Finds a thing that was seen from remembered places, with "seen from W1" or without."""
    called = atlas.recollection.find_called(re.sub(GAP, " ", wanted))
    match = OF_PLACE.fullmatch(wanted)
    if not called and match is not None:
        by = find_named(atlas, plain(match["place"]))
        if by is not None and isinstance(by.thing, RememberedPlace):
            name = by.thing.waypoint.name
            called = tuple(
                each
                for each in atlas.recollection.find_called(plain(match["label"]))
                if name in each.thing.waypoints
            )
    if not called:
        return None
    located = [each for each in called if each.thing.position is not None]
    if not located:
        seen_from = [name for each in called for name in each.thing.waypoints]
        places = filter(None, map(atlas.recollection.find_place, dict.fromkeys(seen_from)))
        ids = [place.id for place in places]
        raise GoalError(
            f"{wanted[:80]!r} was seen from {', '.join(ids)}, but not in which direction.",
            hint=f"Call navigate_to with {ids[0]} and look from there.",
        )
    if len(located) > 1:
        raise _several_things(atlas, wanted, located)
    return refer_to(atlas, Place(located[0].id, located[0]))


def _several_things(
    atlas: Atlas, wanted: str, located: Sequence[RememberedThing]
) -> AmbiguousPlaceError:
    shown = "; ".join(
        f"{each.id} at {say_spot(each.point)}, in "
        f"{' or '.join(atlas.rooms_before(each)) or 'no room'}"
        for each in located[:MOST_NAMED]
    )
    return AmbiguousPlaceError(
        f"Several things are called {wanted[:80]!r}.",
        hint=f"They are {shown}. Say which one by its id.",
        words=wanted,
        meanings=[each.id for each in located],
    )


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
