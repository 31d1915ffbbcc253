"""What somebody means who names a place: what is called so, or words that relate it to others."""

from mapspeak.places.naming import (
    Place,
    Spot,
    Thing,
    find_named,
    is_taken_name,
    no_such_place,
    say_spot,
)
from mapspeak.places.relations import find_related
from mapspeak.places.thingnames import find_thing, place_of
from mapspeak.worldmodel.model import Atlas, RememberedThing

__all__ = ["Place", "Spot", "Thing", "find_place", "is_taken_name", "say_spot"]


def find_place(atlas: Atlas, words: str) -> Place:
    """Finds what is meant by an id, a remembered name, coordinates, "robot", a relation or a thing.

    A relation is such as "left of W3" or "between D1 and D2"; `mapspeak.places.relations`. A
    thing is meant by its label, such as "fire extinguisher", where nothing else is called so.

    Raises:
        GoalError: There is no such place, or there are several; the hint says what became of it
            and what there is.
    """
    place = find_named(atlas, words) or find_related(atlas, words) or find_thing(atlas, words)
    if place is None:
        raise no_such_place(atlas, words)
    if isinstance(place.thing, RememberedThing) and not place.reason:
        return place_of(atlas, place.thing, name=place.name)
    return place
