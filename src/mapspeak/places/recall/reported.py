"""What the robot's detector reported of a request and nobody wrote down: where it is."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from mapspeak.memory import TakenPicture
from mapspeak.memory.things.labels import name_the_same
from mapspeak.places.asking import RecallQuery
from mapspeak.spatial.rooms import Region
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import SAME_THING_M, RememberedThing
from mapspeak.worldmodel.reported import list_reported


@dataclass(frozen=True, slots=True, kw_only=True)
class Reported:
    """What was reported under one name.

    Attributes:
        pictures: That show it, the oldest first.
        things: The nearest to the robot first.
    """

    label: str
    pictures: tuple[TakenPicture, ...]
    things: tuple[RememberedThing, ...]


def find_reported(
    world: WorldModel, query: RecallQuery, labels: Sequence[str]
) -> tuple[Reported, ...]:
    """Return what was reported of some labels and passes the filters, a name after the other."""
    left = [each for each in world.join_reported(labels) if _passes(world, each, query)]
    found: list[Reported] = []
    for label in labels:
        if named := [each for each in left if name_the_same(each.thing.label, label)]:
            left = [each for each in left if each not in named]
            found.append(_describe(world, named))
    return tuple(found)


def _describe(world: WorldModel, named: Sequence[RememberedThing]) -> Reported:
    views = [view for each in named for view in each.thing.supporting]
    ids, here = {view.waypoint for view in views}, world.robot.point
    return Reported(
        label=Counter(view.landmark.label for view in views).most_common(1)[0][0],
        pictures=tuple(each for each in world.pictures if each.id in ids),
        things=tuple(sorted(named, key=lambda each: here.distance_to(each.point))),
    )


def _passes(world: WorldModel, each: RememberedThing, query: RecallQuery) -> bool:
    first, last = each.thing.first_seen, each.thing.last_seen
    if _is_written_down(world, each):
        return False
    if query.near is not None and each.point.distance_to(query.near) > query.near_m:
        return False
    if query.since is not None and (last is None or last < query.since):
        return False
    if query.until is not None and (first is None or first >= query.until):
        return False
    return query.room_id is None or query.room_id in world.rooms_before(each)


def _is_written_down(world: WorldModel, reported: RememberedThing) -> bool:
    return any(
        each.point.distance_to(reported.point) < SAME_THING_M
        and name_the_same(each.thing.label, reported.thing.label)
        for each in world.things
    )


def count_in_region(world: WorldModel, region: Region) -> Counter[str]:
    """Return at how many places in a room or corridor things of which label were reported."""
    reported = world.join_reported(list_reported(world.pictures))
    return Counter(
        each.thing.label
        for each in reported
        if not each.thing.is_guessed and region.id in world.rooms_before(each)
    )
