"""Places next to a thing, at a distance from it, in sight of it, and half way between two."""

import math

import numpy as np

from mapspeak.errors import GoalError, NextStep
from mapspeak.geometry import Point
from mapspeak.places.doorways import find_normal, point_before
from mapspeak.places.naming import Place
from mapspeak.places.relations.directions import front_of_region
from mapspeak.places.relations.placement import (
    ReachableCells,
    find_reachable_cells,
    is_in_sight,
    refuse,
    stand,
    tolerance_m,
)
from mapspeak.places.relations.referents import (
    ROBOT,
    Referent,
    refer_to_door,
)
from mapspeak.places.standing import point_along, reach_doors
from mapspeak.spatial.rooms import Door, Region
from mapspeak.worldmodel.model import WorldModel

NEAR_M = (0.15, 0.7)
"""The least and most room between a thing and the circle of a robot next to it."""
NEARLY_M = 1.5
LEAST_SIGHT_M, SIGHT_M = 0.3, 3.0
"""The least room before a robot that faces a thing, and the farthest it stands away."""
NEAR_DOOR_M = 1.5
THROUGH_DOOR_M = 2.0
"""From nearer a picture shows one post; from farther little of what lies behind the door."""


def stand_away(world: WorldModel, thing: Referent, away_m: float) -> Place:
    """Find the place nearest to the robot at a given distance from a thing.

    Raises:
        GoalError: There is none; the hint names the distances between which there are some.
    """
    floor, from_edge_m = _find_around(world, thing, away_m)
    at_home = floor.is_beside(thing.home, thing.region)
    is_right = np.abs(from_edge_m - away_m) <= tolerance_m(world.grid.resolution_m)
    costs = floor.paths_m + 10 * np.abs(from_edge_m - away_m)
    sees = _find_sight(world, thing)
    point = floor.choose(world, at_home & is_right, costs, in_sight_of=sees)
    if point is None:
        off_m = np.abs(from_edge_m - away_m)
        other = floor.choose(world, at_home, off_m, in_sight_of=sees)
        works = [] if other is None else [f"{floor.at(from_edge_m, other):.1f} m from it"]
        raise refuse(f"The robot can stand nowhere {away_m:g} m from {thing.name}.", works)
    return _facing(thing, point, f"{floor.at(from_edge_m, point):.1f} m from {thing.name}")


def stand_next_to(world: WorldModel, thing: Referent) -> Place:
    """Find a place beside a thing; beside a door, not before it; of a room, outside at its door.

    Raises:
        GoalError: There is none.
    """
    floor, from_edge_m = _find_around(world, thing, NEARLY_M)
    low_m, high_m = (world.radius_m + gap_m for gap_m in NEAR_M)
    is_near = (from_edge_m >= low_m) & (from_edge_m <= high_m)
    sees = _find_sight(world, thing)
    at_home = floor.is_beside(thing.home, thing.region)
    is_there = at_home & _is_out_of_the_way(world, floor, thing)
    for allowed, costs in (
        (is_there & is_near, floor.paths_m),
        (is_there & (from_edge_m <= NEARLY_M), from_edge_m),
    ):
        point = floor.choose(world, allowed, costs, in_sight_of=sees)
        if point is not None:
            away_m = floor.at(from_edge_m, point)
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


def stand_facing(world: WorldModel, thing: Referent) -> Place:
    """Find the place nearest to the robot from which it looks at a thing near by.

    Raises:
        GoalError: The robot is the thing, or there is no such place.
    """
    if thing.name == ROBOT:
        raise refuse("The robot cannot face itself.", ["2 m in front of the robot"])
    if thing.region is not None:
        thing = front_of_region(world, thing.region)
    floor, from_edge_m = _find_around(world, thing, SIGHT_M)
    allowed = floor.is_beside(thing.home, thing.region) & (from_edge_m <= SIGHT_M)
    allowed &= floor.away_m(thing.anchor) >= world.radius_m + LEAST_SIGHT_M
    point = floor.choose(world, allowed, floor.paths_m, in_sight_of=_find_sight(world, thing))
    if point is None:
        raise refuse(
            f"From nowhere within {SIGHT_M:.0f} m does the robot see {thing.name} freely.",
            [f"next to {thing.name}"],
        )
    away_m = point.distance_to(thing.anchor)
    return _facing(thing, point, f"{away_m:.1f} m from {thing.name}, in sight of it")


def find_spot_before_door(world: WorldModel, door: Door, room: Region) -> Point | None:
    """Find where in a room one stands straight before a door, about 2 m off, and sees through it.

    None where the robot stands nowhere between its posts' lines.
    """
    thing, into_rad = refer_to_door(world, door, room), find_normal(world, door, room)
    floor, _ = _find_around(world, thing, SIGHT_M)
    off_m = floor.along_m(door.place, into_rad)
    aside_m = np.abs(floor.along_m(door.place, into_rad + math.pi / 2))
    allowed = floor.is_beside(room, None) & (aside_m <= door.width_m / 2)
    allowed &= off_m >= world.radius_m + LEAST_SIGHT_M
    worse_m = np.abs(off_m - THROUGH_DOOR_M) + aside_m
    return floor.choose(world, allowed, worse_m, in_sight_of=_find_sight(world, thing))


def _find_around(
    world: WorldModel, thing: Referent, away_m: float
) -> tuple[ReachableCells, np.ndarray]:
    offsets = thing.extent - np.array([thing.anchor.x, thing.anchor.y])
    reach_m = float(np.hypot(offsets[:, 0], offsets[:, 1]).max()) + away_m + 1.0
    floor = find_reachable_cells(world, thing.anchor, reach_m)
    return floor, floor.extent_away_m(thing.extent)


def _is_out_of_the_way(world: WorldModel, floor: ReachableCells, thing: Referent) -> np.ndarray:
    """Return True beside a door's opening and not before it; at a room's doors; anywhere else."""
    if thing.door is not None and thing.home is not None:
        along_rad = find_normal(world, thing.door, thing.home) + math.pi / 2
        aside_m = np.abs(floor.along_m(thing.door.place, along_rad))
        return np.asarray(aside_m >= thing.door.width_m / 2)
    if thing.region is None:
        return np.ones(len(floor.points), dtype=np.bool_)
    is_near = np.zeros(len(floor.points), dtype=np.bool_)
    for door in world.rooms.doors_of(thing.region):
        if world.find_crossing(door) is not None:
            is_near |= floor.away_m(door.place) <= NEAR_DOOR_M + door.width_m / 2
    return is_near if is_near.any() else ~is_near


def _find_sight(world: WorldModel, thing: Referent) -> Point | None:
    """Return the point that must be in sight; of a door one before it, of what is large none."""
    if thing.is_point:
        return thing.anchor
    if thing.door is None or thing.home is None:
        return None
    return point_before(world, thing.door, thing.home)


def _facing(thing: Referent, point: Point, reason: str) -> Place:
    return stand(point, f"{reason}, facing it", point.bearing_to(thing.anchor))


LEAST_GAP_M = 0.5
SHARE = (0.3, 0.7)
"""What is between two things is in this part of the way from one to the other."""
ASIDE_RATIO = 0.25
STEP_OFF_M = 1.0
"""Largest distance from a thing, or from the middle of a path, at which the robot may stand."""


def stand_between(world: WorldModel, one: Referent, other: Referent) -> Place:
    """Find where to stand half way between two things.

    Raises:
        GoalError: They are one, too near to each other, or no way leads from one to the other.
    """
    if one.region is not None and other.region is not None:
        place = _stand_in_door(world, one.region, other.region)
        if place is not None:
            return place
    both, gap_m = f"{one.name} and {other.name}", one.anchor.distance_to(other.anchor)
    if gap_m < LEAST_GAP_M:
        raise refuse(
            f"{both} are only {gap_m:.1f} m apart: nothing is between them.",
            [f"next to {one.name}"],
        )
    start = np.array([[one.anchor.x, one.anchor.y]])
    sees = bool(is_in_sight(world, start, other.anchor)[0])
    find = _stand_straight if sees else _stand_on_way
    place = find(world, one.anchor, other.anchor, both)
    if place is None:
        raise refuse(
            f"The robot can stand nowhere half way between {both}.",
            [f"next to {one.name}", f"next to {other.name}"],
        )
    return place


def _stand_in_door(world: WorldModel, one: Region, other: Region) -> Place | None:
    """Return the nearest door that joins two regions; two that are one have none."""
    reached = reach_doors(world, world.rooms.doors_between(one.id, other.id))
    if not reached:
        return None
    _, door, point = reached[0]
    return stand(point, f"in {door.id}, the door between {one.id} and {other.id}")


def _stand_straight(world: WorldModel, one: Point, other: Point, both: str) -> Place | None:
    gap_m, heading_rad = one.distance_to(other), one.bearing_to(other)
    middle = Point((one.x + other.x) / 2, (one.y + other.y) / 2)
    floor = find_reachable_cells(world, middle, gap_m / 2)
    share = floor.along_m(one, heading_rad) / gap_m
    aside_m = np.abs(floor.along_m(one, heading_rad + math.pi / 2))
    allowed = (share >= SHARE[0]) & (share <= SHARE[1]) & (aside_m <= ASIDE_RATIO * gap_m)
    point = floor.choose(world, allowed, floor.away_m(middle), in_sight_of=one)
    if point is None:
        return None
    one_m, other_m = point.distance_to(one), point.distance_to(other)
    reason = f"between {both}, {one_m:.1f} m from one and {other_m:.1f} m from the other"
    return stand(point, reason)


def _stand_on_way(world: WorldModel, one: Point, other: Point, both: str) -> Place | None:
    begin, end = _step_off(world, one), _step_off(world, other)
    path = None
    if begin is not None and end is not None:
        path = world.map.distances_from(begin).path_to(end)
    if path is None:
        return None
    middle = point_along(path.points, path.length_m / 2)
    floor = find_reachable_cells(world, middle, STEP_OFF_M)
    away_m = floor.away_m(middle)
    allowed = away_m <= min(STEP_OFF_M, ASIDE_RATIO * path.length_m)
    point = floor.choose(world, allowed, away_m, in_sight_of=middle)
    if point is None:
        return None
    return stand(point, f"half way between {both}, on the way of {path.length_m:.1f} m")


def _step_off(world: WorldModel, point: Point) -> Point | None:
    """Return the nearest place to a thing where the robot can be."""
    floor = find_reachable_cells(world, point, STEP_OFF_M)
    away_m = floor.away_m(point)
    if not away_m.size or float(away_m.min()) > STEP_OFF_M:
        return None
    return Point(*floor.points[int(np.argmin(away_m))].tolist())
