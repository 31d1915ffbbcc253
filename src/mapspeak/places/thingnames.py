"""A remembered thing as a place: by its id, its label, the nearest of its name, or by its room."""

import math
import re
from collections.abc import Sequence

from mapspeak.geometry import Point
from mapspeak.places.naming import (
    MOST_NAMED,
    AmbiguousPlaceError,
    Place,
    find_named,
    say_spot,
)
from mapspeak.places.standing import stand_before
from mapspeak.semantic.quoting import quote_name
from mapspeak.spatial.rooms import Region
from mapspeak.worldmodel.model import Atlas, RememberedThing

__all__ = ["find_thing", "place_of", "split_room"]

NEAREST = re.compile(
    r"\s*(?:(?:to|at|by)\s+)?(?:the\s+)?(?:nearest|closest)\s+(?P<label>.+?)"
    r"(?:\s+(?:to|from)\s+(?P<to>.+))?\s*",
    re.IGNORECASE | re.DOTALL,
)
ARTICLE = re.compile(r"(?:the|an?|any|some)\s+", re.IGNORECASE)
IN_ROOM = re.compile(r"(?P<label>.+)\s+in\s+(?:the\s+)?(?P<room>.+)", re.IGNORECASE | re.DOTALL)


def find_thing(atlas: Atlas, words: str) -> Place | None:
    """Finds the thing that is called so: "fire extinguisher", "nearest sink", "ladder in R2".

    Only its name counts, never what it means: nobody is driven to a guess.

    Raises:
        AmbiguousPlaceError: Several things are called so.
    """
    nearest = NEAREST.fullmatch(words)
    wanted = words if nearest is None else nearest["label"]
    label, room_id = split_room(atlas, wanted)
    called = [
        each
        for each in atlas.recollection.find_called(label)
        if room_id is None or room_id in atlas.rooms_before(each)
    ]
    if not called:
        return None
    if len(called) == 1:
        return place_of(atlas, called[0], name=words.strip())
    if nearest is not None:
        start = find_named(atlas, nearest["to"]) if nearest["to"] else None
        if start is not None or not nearest["to"]:
            best = min(called, key=lambda each: (_away_m(atlas, each, start), int(each.id[1:])))
            return place_of(atlas, best, name=words.strip())
    bare = ARTICLE.sub("", wanted.strip(), count=1)[:80]
    unknown = "" if nearest is None else f", and no place is called {nearest['to'].strip()[:80]!r}"
    raise AmbiguousPlaceError(
        f"{len(called)} remembered things are called {bare!r}{unknown}.",
        hint=f"They are {_say_candidates(atlas, called)}. Give the id of the one that is meant, or "
        f"say 'nearest {bare}'.",
        words=words,
        meanings=[each.id for each in called],
    )


def place_of(atlas: Atlas, remembered: RememberedThing, *, name: str | None = None) -> Place:
    """Gives a thing as a place, with where it is known to be and how well.

    Args:
        atlas: The map.
        remembered: The thing.
        name: The words that were used for it; its id where None.
    """
    thing = remembered.thing
    seen_from = " ".join(
        dict.fromkeys(
            place.id for each in thing.waypoints if (place := atlas.recollection.find_place(each))
        )
    )
    said = [f"the {quote_name(thing.label)} {remembered.id}"]
    if thing.position is None:
        said.append("nobody noted where it is, so the goal is where it was seen from")
    else:
        said[0] += f" at {say_spot(thing.position)}, good to {thing.uncertainty_m:.1f} m"
        if atlas.find_approach(remembered) is None:
            said.append("no floor near it can be reached, so the goal is where it was seen from")
    said.append(f"seen from {seen_from}")
    if thing.conflicting:
        said.append(f"{len(thing.conflicting)} of the places in sight of it say otherwise")
    return Place(name or remembered.id, remembered, "; ".join(said))


def split_room(atlas: Atlas, words: str) -> tuple[str, str | None]:
    """Divides "ladder in R2" into the name and the room's id; None where no room is named so."""
    match = IN_ROOM.fullmatch(words)
    room = None if match is None else find_named(atlas, match["room"])
    if match is None or room is None or not isinstance(room.thing, Region):
        return words, None
    return match["label"], room.thing.id


def _away_m(atlas: Atlas, remembered: RememberedThing, start: Place | None) -> float:
    """Gives the metres to a thing: by path from the robot, straight from another place."""
    if start is not None:
        return start.point.distance_to(remembered.point)
    path_m = _path_m(atlas, remembered)
    return math.inf if path_m is None else path_m


def _path_m(atlas: Atlas, remembered: RememberedThing) -> float | None:
    stand: Point = stand_before(atlas, remembered).point
    return atlas.path_m(stand)


def _say_candidates(atlas: Atlas, called: Sequence[RememberedThing]) -> str:
    told = [_say_candidate(atlas, each) for each in called[:MOST_NAMED]]
    n_more = len(called) - len(told)
    return ", ".join(told) + (f" and {n_more} more" if n_more else "")


def _say_candidate(atlas: Atlas, remembered: RememberedThing) -> str:
    rooms = " or ".join(atlas.rooms_before(remembered)) or "no room"
    path_m = _path_m(atlas, remembered)
    return f"{remembered.id} in {rooms}, {'no way' if path_m is None else f'{path_m:.1f} m'}"
