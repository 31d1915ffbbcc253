"""Remembered things by what they are called: one, all, and those to be forgotten."""

import re
from collections.abc import Iterable, Sequence

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point
from mapspeak.memory import MemoryStore
from mapspeak.memory.quoting import name_key, quote_name
from mapspeak.memory.store.forgetting import Forgotten, forget_place, forget_views, view_of
from mapspeak.memory.things.labels import names_no_less
from mapspeak.places.naming import (
    ARTICLE,
    MOST_NAMED,
    AmbiguousPlaceError,
    Place,
    find_named,
    say_spot,
)
from mapspeak.places.standing import find_overlook_of, find_stand_off, stand_before
from mapspeak.spatial.rooms import Region
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace, RememberedThing

THING_ID = re.compile(r"[Tt]\d+")
IN_ROOM = re.compile(r"(?P<label>.+)\s+in\s+(?:the\s+)?(?P<room>.+)", re.IGNORECASE | re.DOTALL)
REPORTED = "not written down, the robot's detector reported it"
MOST_SHOWING = 3
BEST_OFF_M = 2.5
"""A picture from so far shows a thing and what is around it."""
AROUND_M = 5.0
"""Largest distance from the robot to a thing that a person says is gone."""


def find_thing(world: WorldModel, words: str) -> Place | None:
    """Find the thing that is called so: "fire extinguisher", "ladder in R2".

    Only its name counts, never its meaning: the robot never drives to a guess.

    Raises:
        AmbiguousPlaceError: Several things are called so.
    """
    called = _follow_all(world, find_things_seen(world, words))
    if not called:
        return None
    if len(called) == 1:
        return place_of(world, called[0], name=words.strip())
    bare = ARTICLE.sub("", words.strip(), count=1)[:80]
    is_reported = called[0].is_reported
    what = "things that pictures show" if is_reported else "remembered things"
    raise AmbiguousPlaceError(
        f"{len(called)} {what} are called {bare!r}.",
        hint=f"They are {say_candidates(world, called)}. "
        f"Give the {'x, y' if is_reported else 'id'} of the one that is meant, or "
        f"say 'nearest {bare}'.",
        words=words,
        meanings=[each.id for each in called],
    )


def _follow_all(world: WorldModel, called: Sequence[RememberedThing]) -> list[RememberedThing]:
    """Return things as they are by now, each once; many as they are remembered."""
    few = len(called) <= MOST_NAMED
    return list(dict.fromkeys(map(world.follow, called))) if few else list(called)


def list_alike(world: WorldModel, words: str) -> list[RememberedThing]:
    """Return all things that words may name, numbered ones among them: "ladder", "ladder in R2"."""
    label, room_id = split_room(world, words)
    called = world.recollection.find_called(label)
    alike = (
        each for each in world.things if each in called or names_no_less(each.thing.label, label)
    )
    found = _follow_all(world, _in_room(world, alike, room_id))
    return found or _find_reported(world, label, room_id)


def find_things(world: WorldModel, words: str) -> list[RememberedThing]:
    """Return all things that are called so: "T3", "ladder", or "ladder in R2"."""
    if THING_ID.fullmatch(words.strip()):
        found = world.recollection.find_thing(words.strip().upper())
        return [] if found is None else [found]
    label, room_id = split_room(world, words)
    return _in_room(world, world.recollection.find_called(label), room_id)


def find_things_seen(world: WorldModel, words: str) -> list[RememberedThing]:
    """Return all things that are called so, else what the detector alone reported as such."""
    label, room_id = split_room(world, words)
    return find_things(world, words) or _find_reported(world, label, room_id)


def _find_reported(world: WorldModel, label: str, room_id: str | None) -> list[RememberedThing]:
    return _in_room(world, world.find_reported(label), room_id)


def _in_room(
    world: WorldModel, things: Iterable[RememberedThing], room_id: str | None
) -> list[RememberedThing]:
    return [each for each in things if room_id is None or room_id in world.rooms_before(each)]


def place_of(world: WorldModel, remembered: RememberedThing, *, name: str | None = None) -> Place:
    """Return a thing as a place, with where it is known to be and how well.

    Args:
        name: The words that were used for it; its id where None.
    """
    thing = remembered.thing
    said = [f"the {quote_name(thing.label)}"]
    if not remembered.is_reported:
        said[0] += f" {remembered.id}"
    if thing.position is None:
        said.append("nobody noted where it is, so the goal is where it was seen from")
    else:
        said[0] += f" at {say_spot(thing.position)}, good to {thing.uncertainty_m:.1f} m"
        overlook = find_overlook_of(world, remembered)
        if overlook is not None:
            off_m = overlook.point.distance_to(thing.position)
            said.append(f"looked for from {off_m:.1f} m off, where most of that is in view")
        elif world.find_approach(remembered) is None:
            said.append(
                f"no floor near it can be reached, so the goal is {_say_goal(world, remembered)}"
            )
    if remembered.is_reported:
        said.append(f"{REPORTED} in {list_pictures(remembered)}")
    else:
        said.append(f"seen from {' '.join(find_place_ids(world, thing.waypoints))}")
    if thing.conflicting:
        said.append(f"{len(thing.conflicting)} of the places in sight of it say otherwise")
    return Place(name or remembered.id, remembered, "; ".join(said))


def list_pictures(remembered: RememberedThing, *, most: int = MOST_SHOWING) -> str:
    """Name the pictures that show best what was reported in them: from near and ahead."""
    views = sorted(
        remembered.thing.supporting,
        key=lambda each: (
            abs((each.far_m or 0.0) - BEST_OFF_M) * (1 + abs(each.landmark.bearing_rad or 0))
        ),
    )
    ids = list(dict.fromkeys(each.waypoint for each in views))
    n_more = len(ids) - most
    return " ".join(ids[:most]) + (f" and {n_more} more" if n_more > 0 else "")


def _say_goal(world: WorldModel, remembered: RememberedThing) -> str:
    if find_stand_off(world, remembered) is None:
        return "where it was seen from"
    return "the nearest place in sight of it"


def find_place_ids(world: WorldModel, names: Iterable[str]) -> list[str]:
    """Return the ids of the remembered places of some names, each once."""
    found = map(world.recollection.find_place, names)
    return list(dict.fromkeys(place.id for place in found if place is not None))


def split_room(world: WorldModel, words: str) -> tuple[str, str | None]:
    """Divide "ladder in R2" into the name and the room's id; None where no room is named so."""
    match = IN_ROOM.fullmatch(words)
    room = None if match is None else find_named(world, match["room"])
    if match is None or room is None or not isinstance(room.thing, Region):
        return words, None
    return match["label"], room.thing.id


def say_candidates(world: WorldModel, called: Sequence[RememberedThing]) -> str:
    """Say where some things are, how far, and how far by path to where each is seen."""
    told = []
    is_alike = len({name_key(each.thing.label) for each in called}) == 1
    for each in called[:MOST_NAMED]:
        rooms = " or ".join(world.rooms_before(each)) or "no room"
        path_m = world.path_m(stand_before(world, each).point)
        at = each.thing.position
        off = "" if at is None else f"{world.robot.point.distance_to(at):.1f} m off, "
        way = "no way" if path_m is None else f"{path_m:.1f} m by path"
        named = "" if is_alike else f" {quote_name(each.thing.label)}"
        told.append(f"{each.id}{named} in {rooms}, {off}{way}")
    n_more = len(called) - len(told)
    return ", ".join(told) + (f" and {n_more} more" if n_more else "")


def forget(world: WorldModel, store: MemoryStore, words: str) -> Forgotten:
    """Forget a place, or a thing in all records that name it.

    Args:
        words: An id, the name of a place, or the label of a thing.

    Raises:
        SemanticMapError: Nothing is called so, or it cannot be written.
        AmbiguousPlaceError: Several things are.
    """
    named = find_named(world, words)
    if named is not None and isinstance(named.thing, RememberedPlace):
        return forget_place(store, named.thing.waypoint.name)
    called = find_things(world, words)
    if not called:
        raise SemanticMapError(
            f"Nothing is remembered as {words[:80]!r}.", hint="Give its id, such as T4 or W2."
        )
    if len(called) > 1:
        ids = [each.id for each in called]
        raise AmbiguousPlaceError(
            f"{len(called)} remembered things are called {words[:80]!r}: {', '.join(ids)}.",
            hint="Give the id of the one that is meant.",
            words=words,
            meanings=ids,
        )
    return forget_thing(store, called[0])


def find_gone(world: WorldModel, words: str, here: Point) -> list[RememberedThing]:
    """Return the things that a person may mean who looks from a point and says: it is gone."""
    called = find_things(world, words)
    if THING_ID.fullmatch(words.strip()):
        return called
    return [
        each
        for each in called
        if each.thing.position is not None and each.thing.position.distance_to(here) <= AROUND_M
    ]


def forget_thing(store: MemoryStore, remembered: RememberedThing) -> Forgotten:
    """Forget a thing, whatever records name it."""
    views = {view_of(each.waypoint, each.landmark) for each in remembered.thing.supporting}
    return forget_views(store, views)
