"""Things of a kind in an order: the nearest, the second-smallest, all of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mapspeak.places.naming import MOST_NAMED, AmbiguousPlaceError, Place
from mapspeak.places.relations.grammar import Several, Superlative
from mapspeak.places.relations.placement import refuse
from mapspeak.places.relations.referents import ROBOT, Referent
from mapspeak.places.relations.vocabulary import Kind, Order, say_order
from mapspeak.places.standing import cells_of, stand_before
from mapspeak.places.things import list_alike
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.paths import DistanceField
from mapspeak.spatial.rooms import Door, Region, RoomClass
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace

Sized = Region | Door | Frontier

CLASSES = {
    Kind.CORRIDOR: (RoomClass.CORRIDOR,),
    Kind.ROOM: (RoomClass.ROOM,),
    Kind.OPEN_SPACE: (RoomClass.OPEN_SPACE,),
}
SIZED_CLASSES = {**CLASSES, Kind.ROOM: (RoomClass.ROOM, RoomClass.OPEN_SPACE)}
"""A large room is an open space: it counts where all rooms are meant, or their sizes."""


@dataclass(frozen=True, slots=True)
class Ranked:
    """A thing of a kind, with what it is ordered by: metres by path, or its size."""

    value: float
    thing: Sized | RememberedPlace

    @property
    def place(self) -> Place:
        """The same as a place."""
        return Place(self.thing.id, self.thing)


def find_superlative(world: WorldModel, words: Superlative, start: Referent | None) -> Place:
    """Find the thing of a kind that is the nearest, the second-smallest and so on.

    Args:
        start: From where ways are measured; None for the robot.

    Raises:
        GoalError: There are too few of them.
    """
    order, rank = words.order, words.rank
    if order.is_of_size:
        ranked, unsure = _sort_by_size(world, words.kind, order)
    else:
        ranked, unsure = _sort_by_way(world, words.kind, order, start), ()
    if not ranked:
        raise refuse(_say_none(world, words.kind))
    title = say_order(order, rank)
    if rank > len(ranked):
        works = [f"{say_order(order, n + 1)} {words.kind}" for n in range(len(ranked))]
        only = "is only one" if len(ranked) == 1 else f"are only {len(ranked)}"
        raise refuse(f"There {only} {words.kind}, so none is the {title}.", works)
    found = ranked[rank - 1]
    if order.is_of_size:
        reason = _say_size(world, found, len(ranked), f"the {title}", words.kind, unsure)
    else:
        counted = f" of {len(ranked)} that can be reached" if order is Order.FARTHEST else ""
        reason = f"the {title} {words.kind}{counted}, {_say_way(world, found, start)}"
    return Place(found.thing.id, found.thing, reason)


def find_several(world: WorldModel, words: Several, at: Referent | None) -> tuple[Place, ...]:
    """Find all things of a kind or of a name, or the first in an order; () for an unused name.

    Args:
        at: The room they are of, or from where ways are measured.

    Raises:
        GoalError: There are too few, or it has no meaning where they are asked for.
    """
    if words.kind is None:
        return _find_called(world, words, at)
    if words.count is None:
        everything = _list(world, words.kind, SIZED_CLASSES)
        found = [each for each in everything if _is_at(world, each, at)]
        if not found:
            raise refuse(_say_none(world, words.kind))
        return tuple(Place(each.id, each) for each in found)
    if words.order.is_of_size:
        ranked, _ = _sort_by_size(world, words.kind, words.order)
    else:
        ranked = _sort_by_way(world, words.kind, words.order, at)
    if words.count > len(ranked):
        raise refuse(
            f"There are only {len(ranked)} of the kind {words.kind} that this can mean.",
            [each.thing.id for each in ranked[:MOST_NAMED]],
        )
    return tuple(each.place for each in ranked[: words.count])


def _find_called(world: WorldModel, words: Several, at: Referent | None) -> tuple[Place, ...]:
    """Find all things of a name, or the first of them by the way there; () for an unused name."""
    called = list_alike(world, words.label)
    if words.count is None or not called:
        return tuple(Place(each.id, each) for each in called)
    distances = world.distances if at is None else world.map.distances_from(at.anchor)
    ways = [(distances.distance_to(stand_before(world, each).point), each) for each in called]
    sign = -1 if words.order is Order.FARTHEST else 1
    reached = sorted(
        ((sign * way_m, each) for way_m, each in ways if way_m is not None),
        key=lambda found: found[0],
    )
    if words.count > len(reached):
        raise refuse(
            f"Only {len(reached)} things called {words.label!r} can be reached.",
            [each.id for _, each in reached[:MOST_NAMED]],
        )
    return tuple(Place(each.id, each) for _, each in reached[: words.count])


def require_one(words: str, found: Sequence[Place]) -> Place:
    """Return the place that words mean.

    Raises:
        AmbiguousPlaceError: They mean several.
    """
    if len(found) == 1:
        return found[0]
    ids = [each.name for each in found]
    shown = " ".join(ids[:MOST_NAMED]) + (" ..." if len(ids) > MOST_NAMED else "")
    raise AmbiguousPlaceError(
        f"{words[:80]!r} means {len(found)} places, and here one is wanted.",
        hint=f"They are {shown}. Give the id of one.",
        words=words,
        meanings=ids,
    )


def find_all_near(world: WorldModel, kind: Kind) -> tuple[Place, ...]:
    """Find all things of a kind that the robot can get to, nearest first."""
    return tuple(each.place for each in _sort_by_way(world, kind, Order.NEAREST, None))


def _sort_by_way(
    world: WorldModel, kind: Kind, order: Order, start: Referent | None
) -> list[Ranked]:
    """Return the things of a kind that can be reached, each with its metres by path."""
    distances = world.distances if start is None else world.map.distances_from(start.anchor)
    own = None if start is None else (start.region or start.door)
    ranked = []
    for each in _list(world, kind):
        far_m = _measure_way(world, each, distances)
        if each is not own and far_m is not None and np.isfinite(far_m):
            ranked.append(Ranked(far_m, each))
    sign = -1 if order is Order.FARTHEST else 1
    return sorted(ranked, key=lambda each: sign * each.value)


def _list(
    world: WorldModel, kind: Kind, classes: Mapping[Kind, tuple[RoomClass, ...]] = CLASSES
) -> Sequence[Sized | RememberedPlace]:
    """Return the things of a kind; regions by the classes that count as that kind."""
    match kind:
        case Kind.FRONTIER:
            return world.frontiers.frontiers
        case Kind.DOOR:
            return world.rooms.doors
        case Kind.REMEMBERED:
            return world.places
        case _:
            regions = world.rooms.regions
            return tuple(each for each in regions if each.room_class in classes[kind])


def _measure_way(
    world: WorldModel, thing: Sized | RememberedPlace, distances: DistanceField
) -> float | None:
    """Return the metres by path to a thing, of a region to its nearest floor."""
    match thing:
        case Region() as region:
            reached_m = distances.distances_at(*cells_of(world.rooms, region))
            return float(reached_m.min(initial=np.inf))
        case Door() as door:
            point = world.find_crossing(door)
            return None if point is None else distances.distance_to(point)
        case Frontier(pose=pose):
            return distances.distance_to(pose.point)
        case RememberedPlace(waypoint=waypoint):
            return distances.distance_to(waypoint.pose.point)


def _sort_by_size(
    world: WorldModel, kind: Kind, order: Order
) -> tuple[list[Ranked], tuple[Ranked, ...]]:
    """Return the things of a kind in the order of their size, and those left out.

    Rooms that may be parts of others are left out, unless all are such.

    Raises:
        GoalError: Things of the kind have no size.
    """
    if kind is Kind.REMEMBERED:
        raise refuse("A remembered place has no size.", ["nearest remembered place"])
    found = [
        (_size_of(each), each)
        for each in _list(world, kind, SIZED_CLASSES)
        if not isinstance(each, RememberedPlace)
    ]
    sign = -1 if order is Order.LARGEST else 1
    ranked = sorted(
        (Ranked(size, each) for size, each in found), key=lambda each: sign * each.value
    )
    sure = [each for each in ranked if not _is_unsure(world, each.thing)]
    unsure = tuple(each for each in ranked if _is_unsure(world, each.thing)) if sure else ()
    return sure or ranked, unsure


def _size_of(thing: Sized) -> float:
    match thing:
        case Region(floor_area_m2=size) | Frontier(gain_m2=size) | Door(width_m=size):
            return size


def _is_unsure(world: WorldModel, thing: Sized | RememberedPlace) -> bool:
    return isinstance(thing, Region) and world.rooms.find_doubtful_door(thing) is not None


def _is_at(world: WorldModel, thing: Sized | RememberedPlace, at: Referent | None) -> bool:
    """Return True for what belongs to a region: its doors, what was remembered or ends in it."""
    if at is None:
        return True
    if at.region is None:
        raise refuse(f"{at.name} is not a room or corridor.")
    match thing:
        case Door(region_ids=region_ids):
            return at.region.id in region_ids
        case Region(neighbour_ids=neighbour_ids):
            return at.region.id in neighbour_ids
        case Frontier(pose=pose):
            return world.find_room_id(pose.point) == at.region.id
        case RememberedPlace(waypoint=waypoint):
            return world.find_room_id(waypoint.pose.point) == at.region.id


def _say_size(
    world: WorldModel, found: Ranked, n_all: int, title: str, kind: Kind, unsure: Sequence[Ranked]
) -> str:
    thing = found.thing
    unit = "m wide" if isinstance(thing, Door) else "m2"
    digits = 2 if isinstance(thing, Door) else 1
    so_far = " so far" if isinstance(thing, Region) and world.may_hide_rooms else ""
    said = f"{title} of {n_all} {kind}s{so_far}, {found.value:.{digits}f} {unit}"
    if n_all == 1:
        said = f"the only {kind}{so_far}, {found.value:.{digits}f} {unit}"
    if isinstance(thing, Region) and thing.id in world.growth_m2:
        said += ", not all seen"
    if isinstance(thing, Region) and _is_unsure(world, thing):
        said += ", unsure"
    left = ", ".join(f"{each.thing.id} ({each.value:.{digits}f} {unit})" for each in unsure)
    return f"{said}; unsure ones are left out: {left}" if left else said


def _say_way(world: WorldModel, found: Ranked, start: Referent | None) -> str:
    who = ROBOT if start is None else start.name
    at = world.robot.point if start is None else start.anchor
    is_in = found.thing.id == world.find_room_id(at)
    return f"{who} is in it" if is_in else f"{found.value:.1f} m by path from {who}"


def _say_none(world: WorldModel, kind: Kind) -> str:
    if kind is Kind.FRONTIER:
        return f"There is no frontier to go to: {str(world.frontiers.verdict).replace('_', ' ')}."
    return f"There is no {kind} that the robot can get to."
