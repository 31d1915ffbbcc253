"""The records that a person means by what is to be forgotten, or is gone."""

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point
from mapspeak.memory import MemoryStore
from mapspeak.memory.store.forgetting import Forgotten, forget_place, forget_views, view_of
from mapspeak.places.naming import AmbiguousPlaceError
from mapspeak.places.things import THING_ID, find_things
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace, RememberedThing

AROUND_M = 5.0
"""Largest distance from the robot to a thing that a person says is gone."""


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
