"""Things of a kind in an order: the nearest, the second-smallest, all of them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mapspeak.errors import NextStep
from mapspeak.memory.quoting import quote_name
from mapspeak.places.goalcheck import judge_goal, say_check
from mapspeak.places.naming import MOST_NAMED, AmbiguousPlaceError, Place
from mapspeak.places.relations.grammar import Several, Superlative
from mapspeak.places.relations.placement import refuse
from mapspeak.places.relations.referents import ROBOT, Referent, stands_at
from mapspeak.places.relations.vocabulary import Kind, Order, say_order
from mapspeak.places.standing import cells_of, stand_before
from mapspeak.places.things import list_alike, place_of, say_candidates
from mapspeak.places.ways import stand_at
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.paths import DistanceField
from mapspeak.spatial.rooms import Door, Region, RoomClass
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace, RememberedThing

Ordered = Region | Door | Frontier | RememberedPlace | RememberedThing
Words = Superlative | Several

MOST_NAMED_IN = 2

CLASSES = {
    Kind.CORRIDOR: (RoomClass.CORRIDOR,),
    Kind.ROOM: (RoomClass.ROOM,),
    Kind.OPEN_SPACE: (RoomClass.OPEN_SPACE,),
}
SIZED_CLASSES = {**CLASSES, Kind.ROOM: (RoomClass.ROOM, RoomClass.OPEN_SPACE)}
"""A large room is an open space: it counts where all rooms are meant, or their sizes, or more than
there are others."""


@dataclass(frozen=True, slots=True)
class Ranked:
    """A thing of a kind, with what it is ordered by: metres by path, or its size."""

    value: float
    thing: Ordered

    @property
    def place(self) -> Place:
        """The same as a place."""
        return Place(self.thing.id, self.thing)


def find_superlative(world: WorldModel, words: Superlative, start: Referent | None) -> Place | None:
    """Find the thing of a kind or a name that is the nearest, the second-smallest and so on.

    Args:
        start: From where ways are measured; None for the robot.

    Returns:
        None for an unused name. What has a name and no id of the map comes without a name.

    Raises:
        GoalError: There are too few of them.
    """
    ranked, left_out = _rank(world, words, start, words.rank)
    if not ranked:
        return None
    found, title = ranked[words.rank - 1], f"the {say_order(words.order, words.rank)}"
    if isinstance(found.thing, RememberedThing):
        known = place_of(world, found.thing).reason
        counted = f", of {len(ranked) + len(left_out)}"
        return Place("", found.thing, f"{known}; {_say_way(world, found, start)}{counted}")
    if words.order.is_of_size:
        reason = _say_size(world, found, ranked, title, words.kind, left_out)
    else:
        is_counted = words.order is Order.FARTHEST
        counted = f" of {len(ranked)} that can be reached" if is_counted else ""
        reason = f"{title} {words.kind}{counted}, {_say_way(world, found, start)}"
    return Place(found.thing.id, found.thing, reason)


def find_several(world: WorldModel, words: Several, at: Referent | None) -> tuple[Place, ...]:
    """Find all things of a kind or of a name, or the first in an order; () for an unused name.

    Args:
        at: The room they are of, or from where ways are measured.

    Raises:
        GoalError: There are too few, or it has no meaning where they are asked for.
    """
    if words.count is not None:
        ranked, _ = _rank(world, words, at, words.count)
        return tuple(each.place for each in ranked[: words.count])
    everything = _list(world, words, SIZED_CLASSES)
    found = [each for each in everything if _is_at(world, each, at)]
    if words.n_doors is not None:
        regions = [each for each in found if isinstance(each, Region)]
        found = [each for each in regions if len(each.door_ids) == words.n_doors]
        if not found:
            raise refuse(f"No {words.kind} has {words.n_doors} doors.", [f"all {words.kind}s"])
    if not found and words.kind is not None:
        said = (
            f"{at.name} has no {words.kind}."
            if at and everything
            else _say_too_few(world, words, 0, 0)
        )
        raise refuse(said)
    return tuple(Place(each.id, each) for each in found)


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
        hint=f"They are {shown}. Give the id of one",
        words=words,
        meanings=ids,
        step=NextStep.TAKE_SEVERAL,
    )


def find_all_near(world: WorldModel, words: Words) -> tuple[Place, ...]:
    """Find all things of a kind or a name that the robot can get to, nearest first."""
    ranked, _ = _sort_by_way(world, words, None)
    return tuple(each.place for each in ranked)


def _rank(
    world: WorldModel, words: Words, start: Referent | None, n_wanted: int
) -> tuple[list[Ranked], list[Ranked]]:
    """Return at least so many things in an order, and those left out; none of an unused name.

    The only thing there is comes first though the robot cannot get to it: what is in its way is
    told of it.

    Raises:
        GoalError: There are too few, or they have no such order.
    """
    if words.order.is_of_size:
        ranked, left_out = _sort_by_size(world, words)
    else:
        ranked, left_out = _sort_by_way(world, words, start)
        if len(ranked) < n_wanted:
            ranked, left_out = _sort_by_way(world, words, start, SIZED_CLASSES)
    if not ranked and len(left_out) == 1:
        ranked, left_out = left_out, []
    n_all = len(ranked) + len(left_out)
    is_unused = words.kind is None and not _list(world, words)
    if n_wanted <= len(ranked) or is_unused:
        return ranked, left_out
    said = f"{_say_too_few(world, words, len(ranked), n_all)}{_say_closed(world, left_out)}"
    things = [
        each.thing for each in (*ranked, *left_out) if isinstance(each.thing, RememberedThing)
    ]
    if things:
        raise refuse(said, else_hint=f"They are {say_candidates(world, things)}.")
    if isinstance(words, Superlative):
        those = [f"{say_order(words.order, n + 1)} {words.kind}" for n in range(len(ranked))]
        raise refuse(said, those)
    raise refuse(said, [each.thing.id for each in ranked[:MOST_NAMED]])


def _say_closed(world: WorldModel, left_out: Sequence[Ranked]) -> str:
    """Say what is closed that keeps the robot from the first of some things; nothing for none."""
    if not world.map.areas:
        return ""
    opened = world.map.open.distances_from
    for each in left_out[:MOST_NAMED]:
        pose = stand_at(world, Place(each.thing.id, each.thing))
        check = judge_goal(world.grid, world.distances, pose, opened=opened)
        if check.areas:
            return f" {each.thing.id}: {say_check(check)}"
    return ""


def _say_too_few(world: WorldModel, words: Words, n_found: int, n_all: int) -> str:
    if words.kind is Kind.FRONTIER and not world.frontiers.frontiers:
        verdict = str(world.frontiers.verdict).replace("_", " ")
        return f"There is no frontier to go to: {verdict}."
    # What ways are measured from does not count.
    is_other = n_all < len(_list(world, words, SIZED_CLASSES))
    noun = f"{'other ' if is_other else ''}{words.kind or 'thing'}"
    called = "" if words.kind else f" called {words.label[:80]!r}"
    one, several = f"{noun}{called}", f"{noun}s{called}"
    if n_found < n_all:
        which = "are sure" if words.order.is_of_size else "can be reached"
        return f"Only {n_found} of the {n_all} {several} {which}."
    if n_all > 1:
        return f"There are only {n_all} {several}."
    return f"There is only one {one}." if n_all else f"There is no {one}."


def _sort_by_way(
    world: WorldModel,
    words: Words,
    start: Referent | None,
    classes: Mapping[Kind, tuple[RoomClass, ...]] = CLASSES,
) -> tuple[list[Ranked], list[Ranked]]:
    """Return things that can be reached by their metres by path, and those that cannot.

    What ways are measured from is not among them.
    """
    distances, own = world.distances, None
    if start is not None:
        distances = world.map.distances_from(stands_at(world, start))
        own = start.place and start.place.thing
    ranked, left_out = [], []
    for each in _list(world, words, classes):
        if each is own:
            continue
        way_m = _measure_way(world, each, distances)
        if way_m is None:
            left_out.append(Ranked(math.inf, each))
        else:
            ranked.append(Ranked(way_m, each))
    sign = -1 if words.order is Order.FARTHEST else 1
    return sorted(ranked, key=lambda each: sign * each.value), left_out


def _list(
    world: WorldModel, words: Words, classes: Mapping[Kind, tuple[RoomClass, ...]] = CLASSES
) -> Sequence[Ordered]:
    """Return the things of a kind or a name; regions by the classes that count as that kind."""
    match words.kind:
        case None:
            return list_alike(world, words.label)
        case Kind.FRONTIER:
            return world.frontiers.frontiers
        case Kind.DOOR:
            return world.rooms.doors
        case Kind.REMEMBERED:
            return world.places
        case kind:
            regions = world.rooms.regions
            return tuple(each for each in regions if each.room_class in classes[kind])


def _measure_way(world: WorldModel, thing: Ordered, distances: DistanceField) -> float | None:
    """Return the metres by path to a thing, of a region to its nearest floor; None without one."""
    match thing:
        case Region() as region:
            reached_m = distances.distances_at(*cells_of(world.rooms, region))
            least_m = float(reached_m.min(initial=np.inf))
            return least_m if math.isfinite(least_m) else None
        case Door() as door:
            point = world.find_crossing(door)
            return None if point is None else distances.distance_to(point)
        case Frontier(pose=pose):
            return distances.distance_to(pose.point)
        case RememberedPlace(waypoint=waypoint):
            return distances.distance_to(waypoint.pose.point)
        case RememberedThing() as remembered:
            return distances.distance_to(stand_before(world, remembered).point)


def _sort_by_size(world: WorldModel, words: Words) -> tuple[list[Ranked], list[Ranked]]:
    """Return the things of a kind in the order of their size, and those left out.

    Rooms that may be parts of others are left out, unless all are such.

    Raises:
        GoalError: Things of the kind have no size.
    """
    sized = [
        Ranked(_size_of(each), each)
        for each in _list(world, words, SIZED_CLASSES)
        if isinstance(each, (Region, Door, Frontier))
    ]
    if words.kind is Kind.REMEMBERED:
        raise refuse("A remembered place has no size.", ["nearest remembered place"])
    sign = -1 if words.order is Order.LARGEST else 1
    ranked = sorted(sized, key=lambda each: sign * each.value)
    sure = [each for each in ranked if not _is_unsure(world, each.thing)]
    unsure = [each for each in ranked if _is_unsure(world, each.thing)] if sure else []
    return sure or ranked, unsure


def _size_of(thing: Region | Door | Frontier) -> float:
    match thing:
        case Region(floor_area_m2=size) | Frontier(gain_m2=size) | Door(width_m=size):
            return size


def _is_unsure(world: WorldModel, thing: Ordered) -> bool:
    return isinstance(thing, Region) and world.rooms.find_doubtful_door(thing) is not None


def _is_at(world: WorldModel, thing: Ordered, at: Referent | None) -> bool:
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
        case RememberedThing() as remembered:
            return at.region.id in world.rooms_before(remembered)


def _say_size(
    world: WorldModel,
    found: Ranked,
    ranked: Sequence[Ranked],
    title: str,
    kind: Kind | None,
    unsure: Sequence[Ranked],
) -> str:
    thing = found.thing
    unit = "m wide" if isinstance(thing, Door) else "m2"
    digits = 2 if isinstance(thing, Door) else 1
    so_far = " so far" if isinstance(thing, Region) and world.may_hide_rooms else ""
    said = f"{title} of {len(ranked)} {kind}s{so_far}, {found.value:.{digits}f} {unit}"
    if len(ranked) == 1:
        said = f"the only {kind}{so_far}, {found.value:.{digits}f} {unit}"
    if isinstance(thing, Region) and thing.id in world.growth_m2:
        said += ", not all seen"
    if isinstance(thing, Region) and _is_unsure(world, thing):
        said += ", unsure"
    if isinstance(thing, Region) and (holds := _say_remembered_in(world, thing)):
        said += f", with {holds}"
    larger = [each for each in ranked if _may_be_larger(world, each, found)]
    for each in larger:
        said += f"; {each.thing.id} ({each.value:.1f} m2) is not all seen and may be larger"
    for behind in ranked[ranked.index(found) + 1 :][:1]:
        if behind not in larger:
            said += f"; then {behind.thing.id}, {behind.value:.{digits}f} {unit}"
    left = ", ".join(f"{each.thing.id} ({each.value:.{digits}f} {unit})" for each in unsure)
    return f"{said}; unsure ones are left out: {left}" if left else said


def _may_be_larger(world: WorldModel, one: Ranked, found: Ranked) -> bool:
    """Return True for a region that is smaller than another as far as it has been seen."""
    most_m2 = one.value + world.growth_m2.get(one.thing.id, 0.0)
    return isinstance(one.thing, Region) and one.value < found.value <= most_m2


def _say_remembered_in(world: WorldModel, region: Region) -> str:
    """Name the first places that were remembered in a region; nothing for none."""
    named = [
        f"{each.id} {quote_name(each.waypoint.name)}"
        for each in world.places
        if world.find_room_id(each.waypoint.pose.point) == region.id
    ]
    return " and ".join(named[:MOST_NAMED_IN])


def _say_way(world: WorldModel, found: Ranked, start: Referent | None) -> str:
    who = ROBOT if start is None else start.name
    at = world.robot.point if start is None else stands_at(world, start)
    if found.thing.id == world.find_room_id(at):
        return f"{who} is in it"
    if math.isinf(found.value):
        return f"no way leads to it from {who}"
    path = "path" if world.map.weights is None else "the shortest path"
    way = f"{found.value:.1f} m by {path} from {who}"
    if isinstance(found.thing, RememberedThing) and found.thing.thing.position is not None:
        return f"{at.distance_to(found.thing.thing.position):.1f} m straight, {way}"
    return way
