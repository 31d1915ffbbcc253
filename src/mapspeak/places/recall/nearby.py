"""What is remembered nearest to a thing: by where things are, not where they were seen from."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime

from mapspeak.memory.episodes.observation import EpisodeMatch
from mapspeak.places.relations.unknown import no_such_place
from mapspeak.places.things import THING_ID, find_things_seen
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedThing
from mapspeak.worldmodel.reported import list_reported

NEVER = datetime.min.replace(tzinfo=UTC)


@dataclass(frozen=True, slots=True, kw_only=True)
class Nearby:
    """A thing and what is near to it.

    Attributes:
        thing: The thing; of several of one name the one that was seen last.
        others: The others of that name, those seen last first.
        nearest: All other things whose position is known, each with its metres from there, the
            nearest first.
    """

    thing: RememberedThing
    others: tuple[RememberedThing, ...]
    nearest: tuple[tuple[RememberedThing, float], ...]


def find_nearby(
    world: WorldModel, words: str, *, radius_m: float | None = None, room_id: str | None = None
) -> Nearby | None:
    """Find the thing that is called so, and what is near to it; None where nothing is.

    Args:
        words: "T3", "potted plant", or "potted plant in R3".

    Raises:
        GoalError: The words are the id of no thing.
    """
    called = _find_called(world, words.strip())
    if not called:
        return None
    first, *others = called
    known = world.things
    if first.is_reported:
        known += world.join_reported(list_reported(world.pictures))
    away = [
        (each, each.thing.position.distance_to(first.point))
        for each in known
        if each is not first and each.thing.position is not None
    ]
    nearest = tuple(
        (each, away_m)
        for each, away_m in sorted(away, key=lambda pair: pair[1])
        if (radius_m is None or away_m <= radius_m)
        and (room_id is None or room_id in world.rooms_before(each))
    )
    return Nearby(thing=first, others=tuple(others), nearest=nearest)


def _find_called(world: WorldModel, words: str) -> list[RememberedThing]:
    """Return the things of a name or an id, those seen last first."""
    called = find_things_seen(world, words)
    if not called and THING_ID.fullmatch(words):
        raise no_such_place(world, words)
    return sorted(called, key=lambda each: each.thing.last_seen or NEVER, reverse=True)


def in_rooms_of(world: WorldModel, matches: Iterable[EpisodeMatch]) -> Iterator[EpisodeMatch]:
    """Yield observations with the room that their place is in now: ids change as a map grows."""
    for match in matches:
        if match.is_elsewhere:
            yield match
            continue
        room_id = world.find_room_id(match.observation.pose.point)
        yield replace(match, observation=replace(match.observation, room_id=room_id))
