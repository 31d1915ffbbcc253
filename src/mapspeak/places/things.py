"""Remembered things by what they are called: one, the nearest, all, and those to be forgotten."""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace

from mapspeak.errors import GoalError, SemanticMapError
from mapspeak.geometry import Point
from mapspeak.memory import MemoryStore
from mapspeak.memory.quoting import quote_name
from mapspeak.memory.store.forgetting import Forgotten, forget_place, forget_views, view_of
from mapspeak.memory.things.labels import name_the_same
from mapspeak.places.naming import (
    MOST_NAMED,
    AmbiguousPlaceError,
    Place,
    find_named,
    say_spot,
)
from mapspeak.places.standing import find_stand_off, stand_before
from mapspeak.spatial.rooms import Region
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace, RememberedThing

RANKS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth")
ORDERED = re.compile(
    rf"\s*(?:(?:to|at|by)\s+)?(?:the\s+)?(?:(?P<rank>{'|'.join(RANKS)})[-\s]+)?"
    r"(?:nearest|closest|(?P<far>farthest|furthest|most distant))\s+(?P<label>.+?)"
    r"(?:\s+(?:to|from)\s+(?P<to>.+))?\s*",
    re.IGNORECASE | re.DOTALL,
)
THING_ID = re.compile(r"[Tt]\d+")
ARTICLE = re.compile(r"(?:the|an?|any|some)\s+", re.IGNORECASE)
IN_ROOM = re.compile(r"(?P<label>.+)\s+in\s+(?:the\s+)?(?P<room>.+)", re.IGNORECASE | re.DOTALL)
AROUND_M = 5.0
"""Largest distance from the robot to a thing that a person says is gone."""


def find_thing(world: WorldModel, words: str) -> Place | None:
    """Find the thing that is called so: "fire extinguisher", "nearest sink", "ladder in R2".

    Only its name counts, never its meaning: the robot never drives to a guess. In an order, as in
    "second-nearest charger", numbered ones such as "charger 2" count too.

    Raises:
        AmbiguousPlaceError: Several things are called so.
        GoalError: There are too few of them.
    """
    ordered = ORDERED.fullmatch(words)
    if ordered is None:
        wanted, called = words, find_things(world, words)
    else:
        wanted = ordered["label"]
        called = list_alike(world, wanted)
    if not called:
        return None
    if len(called) <= MOST_NAMED:
        called = list(dict.fromkeys(map(world.follow, called)))
    if ordered is not None:
        start = find_named(world, ordered["to"]) if ordered["to"] else None
        if start is not None or not ordered["to"]:
            return _take_in_order(world, ordered, called, start)
    if len(called) == 1:
        return place_of(world, called[0], name=words.strip())
    bare = ARTICLE.sub("", wanted.strip(), count=1)[:80]
    unknown = "" if ordered is None else f", and no place is called {ordered['to'].strip()[:80]!r}"
    raise AmbiguousPlaceError(
        f"{len(called)} remembered things are called {bare!r}{unknown}.",
        hint=f"They are {_say_candidates(world, called)}. Give the id of the one that is meant, or "
        f"say 'nearest {bare}'.",
        words=words,
        meanings=[each.id for each in called],
    )


def _take_in_order(
    world: WorldModel,
    ordered: re.Match[str],
    called: Sequence[RememberedThing],
    start: Place | None,
) -> Place:
    """Return the nearest of some things, the second-farthest, and so on, with how far it is.

    Raises:
        GoalError: There are too few that can be reached.
    """
    name, bare = ordered.string.strip(), ordered["label"].strip()[:80]
    away = [(_away_m(world, each, start), int(each.id[1:]), each) for each in called]
    reached = [each for each in away if math.isfinite(each[0])]
    if len(called) == 1:
        return place_of(world, called[0], name=name)
    rank = 1 + RANKS.index(ordered["rank"].casefold()) if ordered["rank"] else 1
    if rank > len(reached):
        raise GoalError(
            f"Only {len(reached)} of the {len(called)} remembered things called {bare!r} can be "
            "reached.",
            hint=f"They are {_say_candidates(world, called)}.",
        )
    in_order = sorted(reached, key=lambda each: (-each[0] if ordered["far"] else each[0], each[1]))
    far_m, _, best = in_order[rank - 1]
    place = place_of(world, best, name=name)
    how = "by path" if start is None else f"from {start.name}"
    return replace(place, reason=f"{place.reason}; {far_m:.1f} m {how}, of {len(called)}")


def list_alike(world: WorldModel, words: str) -> list[RememberedThing]:
    """Return all things that words may name, numbered ones among them: "ladder", "ladder in R2"."""
    label, room_id = split_room(world, words)
    called = world.recollection.find_called(label)
    return [
        each
        for each in world.things
        if each in called or name_the_same(label, each.thing.label)
        if room_id is None or room_id in world.rooms_before(each)
    ]


def find_things(world: WorldModel, words: str) -> list[RememberedThing]:
    """Return all things that are called so: "T3", "ladder", or "ladder in R2"."""
    if THING_ID.fullmatch(words.strip()):
        found = world.recollection.find_thing(words.strip().upper())
        return [] if found is None else [found]
    label, room_id = split_room(world, words)
    return [
        each
        for each in world.recollection.find_called(label)
        if room_id is None or room_id in world.rooms_before(each)
    ]


def place_of(world: WorldModel, remembered: RememberedThing, *, name: str | None = None) -> Place:
    """Return a thing as a place, with where it is known to be and how well.

    Args:
        name: The words that were used for it; its id where None.
    """
    thing = remembered.thing
    said = [f"the {quote_name(thing.label)} {remembered.id}"]
    if thing.position is None:
        said.append("nobody noted where it is, so the goal is where it was seen from")
    else:
        said[0] += f" at {say_spot(thing.position)}, good to {thing.uncertainty_m:.1f} m"
        if world.find_approach(remembered) is None:
            said.append(
                f"no floor near it can be reached, so the goal is {_say_goal(world, remembered)}"
            )
    said.append(f"seen from {' '.join(find_place_ids(world, thing.waypoints))}")
    if thing.conflicting:
        said.append(f"{len(thing.conflicting)} of the places in sight of it say otherwise")
    return Place(name or remembered.id, remembered, "; ".join(said))


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


def _away_m(world: WorldModel, remembered: RememberedThing, start: Place | None) -> float:
    """Return the metres to a thing: by path from the robot, straight from another place."""
    if start is not None:
        return start.point.distance_to(remembered.point)
    path_m = _path_m(world, remembered)
    return math.inf if path_m is None else path_m


def _path_m(world: WorldModel, remembered: RememberedThing) -> float | None:
    return world.path_m(stand_before(world, remembered).point)


def _say_candidates(world: WorldModel, called: Sequence[RememberedThing]) -> str:
    told = []
    for each in called[:MOST_NAMED]:
        rooms, path_m = " or ".join(world.rooms_before(each)) or "no room", _path_m(world, each)
        told.append(f"{each.id} in {rooms}, {'no way' if path_m is None else f'{path_m:.1f} m'}")
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
    place = _find_place(world, words)
    if place is not None:
        return forget_place(store, place.waypoint.name)
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


def _find_place(world: WorldModel, words: str) -> RememberedPlace | None:
    wanted = words.strip().casefold()
    return next(
        (
            each
            for each in world.places
            if wanted in (each.id.casefold(), each.waypoint.name.casefold())
        ),
        None,
    )
