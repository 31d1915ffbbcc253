"""Places next to a thing, half way between two, and the nearest of a kind."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mapspeak.errors import GoalError, NextStep
from mapspeak.geometry import Point
from mapspeak.places.naming import Place
from mapspeak.places.relations.directions import front_of_region
from mapspeak.places.relations.grammar import Kind
from mapspeak.places.relations.placement import (
    Footing,
    Stand,
    extent_away_m,
    find_footing,
    is_in_sight,
    refuse,
    tolerance_m,
)
from mapspeak.places.relations.referents import Referent, find_normal
from mapspeak.spatial.paths import DistanceField, Path
from mapspeak.spatial.rooms import Region, RoomClass
from mapspeak.worldmodel.model import WorldModel

NEAR_M = (0.15, 0.7)
"""What is next to a thing leaves so much room between it and the robot's own circle."""
NEARLY_M = 1.5
LEAST_SIGHT_M, SIGHT_M = 0.3, 3.0
"""Who faces a thing leaves so much room before the robot, and is at most so far away."""
NEAR_DOOR_M = 1.5


def stand_away(world: WorldModel, thing: Referent, away_m: float) -> Stand:
    """Find the place nearest to the robot that is so far from a thing.

    Raises:
        GoalError: There is none; the hint names the distances between which there are some.
    """
    footing, from_edge_m = _find_around(world, thing, away_m)
    at_home = _is_at_home(footing, thing)
    is_right = np.abs(from_edge_m - away_m) <= tolerance_m(world.grid.resolution_m)
    costs = footing.paths_m + 10 * np.abs(from_edge_m - away_m)
    sees = _find_sight(world, thing)
    point = footing.choose(world, at_home & is_right, costs, in_sight_of=sees)
    if point is None:
        off_m = np.abs(from_edge_m - away_m)
        other = footing.choose(world, at_home, off_m, in_sight_of=sees)
        works = [] if other is None else [f"{_at(footing, from_edge_m, other):.1f} m from it"]
        raise refuse(f"The robot can stand nowhere {away_m:g} m from {thing.name}.", works)
    return _facing(thing, point, f"{_at(footing, from_edge_m, point):.1f} m from {thing.name}")


def stand_next_to(world: WorldModel, thing: Referent) -> Stand:
    """Find a place beside a thing; beside a door, not before it; of a room, outside at its door.

    Raises:
        GoalError: There is none.
    """
    footing, from_edge_m = _find_around(world, thing, NEARLY_M)
    at_home = _is_at_home(footing, thing)
    low_m, high_m = (world.radius_m + gap_m for gap_m in NEAR_M)
    is_near = (from_edge_m >= low_m) & (from_edge_m <= high_m)
    sees = _find_sight(world, thing)
    is_there = at_home & _is_out_of_the_way(world, footing, thing)
    for allowed, costs in (
        (is_there & is_near, footing.paths_m),
        (is_there & (from_edge_m <= NEARLY_M), from_edge_m),
    ):
        point = footing.choose(world, allowed, costs, in_sight_of=sees)
        if point is not None:
            away_m = _at(footing, from_edge_m, point)
            return _facing(thing, point, f"next to {thing.name}, {away_m:.1f} m from it")
    nowhere = f"The robot can stand nowhere within {NEARLY_M:.1f} m of {thing.name}"
    if thing.door is not None:
        works = [f"in front of {thing.name}", f"behind {thing.name}"]
        raise refuse(f"{nowhere} beside its opening.", works)
    raise GoalError(
        f"{nowhere}.",
        hint="Choose another place.",
        step=NextStep.LOOK_AROUND,
        about=thing.name,
    )


def stand_facing(world: WorldModel, thing: Referent) -> Stand:
    """Find the place nearest to the robot from which it looks at a thing near by.

    Raises:
        GoalError: The robot is the thing, or there is no such place.
    """
    if thing.is_robot:
        raise refuse("The robot cannot face itself.", ["2 m in front of the robot"])
    if thing.region is not None:
        thing = front_of_region(world, thing.region)
    footing, from_edge_m = _find_around(world, thing, SIGHT_M)
    allowed = _is_at_home(footing, thing) & (from_edge_m <= SIGHT_M)
    allowed &= footing.away_m(thing.anchor) >= world.radius_m + LEAST_SIGHT_M
    point = footing.choose(world, allowed, footing.paths_m, in_sight_of=_find_sight(world, thing))
    if point is None:
        raise refuse(
            f"From nowhere within {SIGHT_M:.0f} m does the robot see {thing.name} freely.",
            [f"next to {thing.name}"],
        )
    away_m = point.distance_to(thing.anchor)
    return _facing(thing, point, f"{away_m:.1f} m from {thing.name}, in sight of it")


def _find_around(world: WorldModel, thing: Referent, away_m: float) -> tuple[Footing, np.ndarray]:
    offsets = thing.extent - np.array([thing.anchor.x, thing.anchor.y])
    reach_m = float(np.hypot(offsets[:, 0], offsets[:, 1]).max()) + away_m + 1.0
    footing = find_footing(world, thing.anchor, reach_m)
    return footing, extent_away_m(footing, thing.extent)


def _is_at_home(footing: Footing, thing: Referent) -> np.ndarray:
    if thing.region is not None:
        return np.asarray(footing.regions != thing.region.index)
    if thing.home is not None:
        return np.asarray(footing.regions == thing.home.index)
    return np.ones(len(footing.points), dtype=np.bool_)


def _is_out_of_the_way(world: WorldModel, footing: Footing, thing: Referent) -> np.ndarray:
    """Return True beside a door's opening and not before it; at a room's doors; anywhere else."""
    if thing.door is not None and thing.home is not None:
        along_rad = find_normal(world, thing.door, thing.home) + math.pi / 2
        aside_m = np.abs(footing.along_m(thing.door.place, along_rad))
        return np.asarray(aside_m >= thing.door.width_m / 2)
    if thing.region is None:
        return np.ones(len(footing.points), dtype=np.bool_)
    is_near = np.zeros(len(footing.points), dtype=np.bool_)
    for door in world.rooms.doors_of(thing.region):
        if world.find_crossing(door) is not None:
            is_near |= footing.away_m(door.place) <= NEAR_DOOR_M + door.width_m / 2
    return is_near if is_near.any() else ~is_near


def _find_sight(world: WorldModel, thing: Referent) -> Point | None:
    """Return the point that must be in sight; of a door one before it, of what is large none."""
    if thing.is_point:
        return thing.anchor
    if thing.door is None or thing.home is None:
        return None
    heading_rad = find_normal(world, thing.door, thing.home)
    return Point(
        thing.door.place.x + world.radius_m * math.cos(heading_rad),
        thing.door.place.y + world.radius_m * math.sin(heading_rad),
    )


def _at(footing: Footing, values: np.ndarray, point: Point) -> float:
    return float(values[int(np.argmin(footing.away_m(point)))])


def _facing(thing: Referent, point: Point, reason: str) -> Stand:
    return Stand(point=point, yaw_rad=point.bearing_to(thing.anchor), reason=f"{reason}, facing it")


LEAST_GAP_M = 0.5
SHARE = (0.3, 0.7)
"""What is between two things is in this part of the way from one to the other."""
ASIDE_RATIO = 0.25
STEP_OFF_M = 1.0
"""So far off a thing itself, or off the middle of a way, the robot may have to stand."""


@dataclass(frozen=True, slots=True)
class Span:
    """Two things and the line between them."""

    one: Referent
    other: Referent

    @property
    def length_m(self) -> float:
        """From middle to middle."""
        return self.one.anchor.distance_to(self.other.anchor)

    @property
    def middle(self) -> Point:
        """Half way as the crow flies."""
        one, other = self.one.anchor, self.other.anchor
        return Point((one.x + other.x) / 2, (one.y + other.y) / 2)

    @property
    def name(self) -> str:
        """Such as "D1 and D2"."""
        return f"{self.one.name} and {self.other.name}"


def stand_between(world: WorldModel, one: Referent, other: Referent) -> Stand:
    """Find where to stand half way between two things.

    Raises:
        GoalError: They are one, too near to each other, or no way leads from one to the other.
    """
    span = Span(one, other)
    if one.region is not None and other.region is not None:
        stand = _stand_in_door(world, one.region, other.region)
        if stand is not None:
            return stand
    if span.length_m < LEAST_GAP_M:
        raise refuse(
            f"{span.name} are only {span.length_m:.1f} m apart: nothing is between them.",
            [f"next to {one.name}"],
        )
    point = one.anchor
    sees = bool(is_in_sight(world, np.array([[point.x, point.y]]), other.anchor)[0])
    stand = _stand_straight(world, span) if sees else _stand_on_way(world, span)
    if stand is None:
        raise refuse(
            f"The robot can stand nowhere half way between {span.name}.",
            [f"next to {one.name}", f"next to {other.name}"],
        )
    return stand


def _stand_in_door(world: WorldModel, one: Region, other: Region) -> Stand | None:
    """Return the nearest door that joins two regions; two that are one have none."""
    crossings = [
        (world.path_m(crossing) or 0.0, door.id, crossing)
        for door in world.rooms.doors_between(one.id, other.id)
        if (crossing := world.find_crossing(door)) is not None
    ]
    if not crossings:
        return None
    _, door_id, point = min(crossings, key=lambda each: each[:2])
    return Stand(point=point, reason=f"in {door_id}, the door between {one.id} and {other.id}")


def _stand_straight(world: WorldModel, span: Span) -> Stand | None:
    footing = find_footing(world, span.middle, span.length_m / 2)
    heading_rad = span.one.anchor.bearing_to(span.other.anchor)
    share = footing.along_m(span.one.anchor, heading_rad) / span.length_m
    aside_m = np.abs(footing.along_m(span.one.anchor, heading_rad + math.pi / 2))
    allowed = (share >= SHARE[0]) & (share <= SHARE[1])
    allowed &= aside_m <= ASIDE_RATIO * span.length_m
    costs = footing.away_m(span.middle)
    point = footing.choose(world, allowed, costs, in_sight_of=span.one.anchor)
    if point is None:
        return None
    one_m, other_m = (point.distance_to(end.anchor) for end in (span.one, span.other))
    reason = f"between {span.name}, {one_m:.1f} m from one and {other_m:.1f} m from the other"
    return Stand(point=point, reason=reason)


def _stand_on_way(world: WorldModel, span: Span) -> Stand | None:
    begin, end = (_step_off(world, thing.anchor) for thing in (span.one, span.other))
    if begin is None or end is None:
        return None
    path = world.map.distances_from(begin).path_to(end)
    if path is None:
        return None
    middle = _half_of(path)
    footing = find_footing(world, middle, STEP_OFF_M)
    away_m = footing.away_m(middle)
    allowed = away_m <= min(STEP_OFF_M, ASIDE_RATIO * path.length_m)
    point = footing.choose(world, allowed, away_m, in_sight_of=middle)
    if point is None:
        return None
    reason = f"half way between {span.name}, on the way of {path.length_m:.1f} m"
    return Stand(point=point, reason=reason)


def _step_off(world: WorldModel, point: Point) -> Point | None:
    """Return the nearest place to a thing where the robot can be."""
    footing = find_footing(world, point, STEP_OFF_M)
    away_m = footing.away_m(point)
    if not away_m.size or float(away_m.min()) > STEP_OFF_M:
        return None
    x, y = footing.points[int(np.argmin(away_m))].tolist()
    return Point(x, y)


def _half_of(path: Path) -> Point:
    left_m = path.length_m / 2
    for start, end in itertools.pairwise(path.points):
        leg_m = start.distance_to(end)
        if leg_m >= left_m > 0:
            share = left_m / leg_m
            return Point(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))
        left_m -= leg_m
    return path.points[-1]


CLASSES = {
    Kind.CORRIDOR: RoomClass.CORRIDOR,
    Kind.ROOM: RoomClass.ROOM,
    Kind.OPEN_SPACE: RoomClass.OPEN_SPACE,
}


def find_nearest(world: WorldModel, kind: Kind, start: Referent | None) -> Place:
    """Find the thing of a kind that is nearest to the robot or to a place, by path.

    Raises:
        GoalError: None can be reached.
    """
    distances = world.distances if start is None else world.map.distances_from(start.anchor)
    own = None if start is None else (start.region or start.door)
    found = [each for each in _sort(world, kind, distances) if each[1].thing is not own]
    if not found:
        raise refuse(_say_none(world, kind))
    away_m, place = found[0]
    who = "the robot" if start is None else start.name
    is_in = place.name == world.find_room_id(distances.start)
    where = f"{who} is in it" if is_in else f"{away_m:.1f} m by path from {who}"
    return Place(place.name, place.thing, f"the nearest {kind}, {where}")


def find_all_near(world: WorldModel, kind: Kind) -> tuple[Place, ...]:
    """Find all things of a kind that the robot can get to, nearest first."""
    return tuple(place for _, place in _sort(world, kind, world.distances))


def _sort(world: WorldModel, kind: Kind, distances: DistanceField) -> list[tuple[float, Place]]:
    found = (each for each in _all_of(world, kind, distances) if math.isfinite(each[0]))
    return sorted(found, key=lambda each: each[0])


def _all_of(
    world: WorldModel, kind: Kind, distances: DistanceField
) -> Iterator[tuple[float, Place]]:
    match kind:
        case Kind.FRONTIER:
            for frontier in world.frontiers.frontiers:
                away_m = distances.distance_to(frontier.pose.point)
                yield math.inf if away_m is None else away_m, Place(frontier.id, frontier)
        case Kind.DOOR:
            for door in world.rooms.doors:
                crossing = world.find_crossing(door)
                away_m = None if crossing is None else distances.distance_to(crossing)
                yield math.inf if away_m is None else away_m, Place(door.id, door)
        case Kind.REMEMBERED:
            for remembered in world.places:
                away_m = distances.distance_to(remembered.waypoint.pose.point)
                yield math.inf if away_m is None else away_m, Place(remembered.id, remembered)
        case _:
            for region in world.rooms.regions:
                if region.room_class is CLASSES[kind]:
                    yield _least_m(world, region, distances), Place(region.id, region)


def _least_m(world: WorldModel, region: Region, distances: DistanceField) -> float:
    """Return the metres by path to the nearest floor of a region."""
    window = world.rooms.window_of(region)
    rows, cols = np.nonzero(world.rooms.labels[window] == region.index)
    reached_m = distances.distances_at(rows + window[0].start, cols + window[1].start)
    return float(reached_m.min(initial=np.inf))


def _say_none(world: WorldModel, kind: Kind) -> str:
    if kind is Kind.FRONTIER:
        return f"There is no frontier to go to: {str(world.frontiers.verdict).replace('_', ' ')}."
    return f"There is no {kind} that the robot can get to."
