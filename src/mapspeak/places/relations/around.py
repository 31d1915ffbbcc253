"""Next to a thing, so far from it, facing it: places anywhere around it."""

import math

import numpy as np

from mapspeak.geometry import Point
from mapspeak.places.relations.directions import front_of_region
from mapspeak.places.relations.footing import Footing, find_footing
from mapspeak.places.relations.referent import Referent, find_normal
from mapspeak.places.relations.stand import Stand, extent_away_m, refuse, tolerance_m
from mapspeak.worldmodel.model import Atlas

__all__ = ["stand_away", "stand_facing", "stand_next_to"]

NEAR_M = (0.15, 0.7)
"""What is next to a thing leaves so much room between it and the robot's own circle."""
NEARLY_M = 1.5
LEAST_SIGHT_M, SIGHT_M = 0.3, 3.0
"""Who faces a thing leaves so much room before the robot, and is at most so far away."""
NEAR_DOOR_M = 1.5


def stand_away(atlas: Atlas, thing: Referent, away_m: float) -> Stand:
    """Finds the place nearest to the robot that is so far from a thing.

    Raises:
        GoalError: There is none; the hint names the distances between which there are some.
    """
    footing, from_edge_m = _find_around(atlas, thing, away_m)
    at_home = _is_at_home(footing, thing)
    is_right = np.abs(from_edge_m - away_m) <= tolerance_m(atlas.grid.resolution_m)
    costs = footing.paths_m + 10 * np.abs(from_edge_m - away_m)
    sees = _find_sight(atlas, thing)
    point = footing.choose(atlas, at_home & is_right, costs, in_sight_of=sees)
    if point is None:
        off_m = np.abs(from_edge_m - away_m)
        other = footing.choose(atlas, at_home, off_m, in_sight_of=sees)
        works = [] if other is None else [f"{_at(footing, from_edge_m, other):.1f} m from it"]
        raise refuse(f"The robot can stand nowhere {away_m:g} m from {thing.name}.", works)
    return _facing(thing, point, f"{_at(footing, from_edge_m, point):.1f} m from {thing.name}")


def stand_next_to(atlas: Atlas, thing: Referent) -> Stand:
    """Finds a place beside a thing; beside a door, not before it; of a room, outside at its door.

    Raises:
        GoalError: There is none.
    """
    footing, from_edge_m = _find_around(atlas, thing, NEARLY_M)
    at_home = _is_at_home(footing, thing)
    low_m, high_m = (atlas.radius_m + gap_m for gap_m in NEAR_M)
    is_near = (from_edge_m >= low_m) & (from_edge_m <= high_m)
    sees = _find_sight(atlas, thing)
    is_there = at_home & _is_out_of_the_way(atlas, footing, thing)
    for allowed, costs in (
        (is_there & is_near, footing.paths_m),
        (is_there & (from_edge_m <= NEARLY_M), from_edge_m),
    ):
        point = footing.choose(atlas, allowed, costs, in_sight_of=sees)
        if point is not None:
            away_m = _at(footing, from_edge_m, point)
            return _facing(thing, point, f"next to {thing.name}, {away_m:.1f} m from it")
    aside = "" if thing.door is None else " beside its opening"
    raise refuse(
        f"The robot can stand nowhere within {NEARLY_M:.1f} m of {thing.name}{aside}.",
        [] if thing.door is None else [f"in front of {thing.name}", f"behind {thing.name}"],
        else_hint=f"Call describe_place with {thing.name}, then choose another place.",
    )


def stand_facing(atlas: Atlas, thing: Referent) -> Stand:
    """Finds the place nearest to the robot from which it looks at a thing near by.

    Raises:
        GoalError: The robot is the thing, or there is no such place.
    """
    if thing.is_robot:
        raise refuse("The robot cannot face itself.", ["2 m in front of the robot"])
    if thing.region is not None:
        thing = front_of_region(atlas, thing.region)
    footing, from_edge_m = _find_around(atlas, thing, SIGHT_M)
    allowed = _is_at_home(footing, thing) & (from_edge_m <= SIGHT_M)
    allowed &= footing.away_m(thing.anchor) >= atlas.radius_m + LEAST_SIGHT_M
    point = footing.choose(atlas, allowed, footing.paths_m, in_sight_of=_find_sight(atlas, thing))
    if point is None:
        raise refuse(
            f"From nowhere within {SIGHT_M:.0f} m does the robot see {thing.name} freely.",
            [f"next to {thing.name}"],
        )
    away_m = point.distance_to(thing.anchor)
    return _facing(thing, point, f"{away_m:.1f} m from {thing.name}, in sight of it")


def _find_around(atlas: Atlas, thing: Referent, away_m: float) -> tuple[Footing, np.ndarray]:
    offsets = thing.extent - np.array([thing.anchor.x, thing.anchor.y])
    reach_m = float(np.hypot(offsets[:, 0], offsets[:, 1]).max()) + away_m + 1.0
    footing = find_footing(atlas, thing.anchor, reach_m)
    return footing, extent_away_m(footing, thing.extent)


def _is_at_home(footing: Footing, thing: Referent) -> np.ndarray:
    if thing.region is not None:
        return np.asarray(footing.regions != thing.region.index)
    if thing.home is not None:
        return np.asarray(footing.regions == thing.home.index)
    return np.ones(len(footing.points), dtype=np.bool_)


def _is_out_of_the_way(atlas: Atlas, footing: Footing, thing: Referent) -> np.ndarray:
    """True beside a door's opening and not before it; at a room's doors; anywhere else."""
    if thing.door is not None and thing.home is not None:
        along_rad = find_normal(atlas, thing.door, thing.home) + math.pi / 2
        aside_m = np.abs(footing.along_m(thing.door.place, along_rad))
        return np.asarray(aside_m >= thing.door.width_m / 2)
    if thing.region is None:
        return np.ones(len(footing.points), dtype=np.bool_)
    is_near = np.zeros(len(footing.points), dtype=np.bool_)
    for door in atlas.rooms.doors_of(thing.region):
        if atlas.find_crossing(door) is not None:
            is_near |= footing.away_m(door.place) <= NEAR_DOOR_M + door.width_m / 2
    return is_near if is_near.any() else ~is_near


def _find_sight(atlas: Atlas, thing: Referent) -> Point | None:
    """Gives the point that must be in sight; of a door one before it, of what is large none."""
    if thing.is_point:
        return thing.anchor
    if thing.door is None or thing.home is None:
        return None
    heading_rad = find_normal(atlas, thing.door, thing.home)
    return Point(
        thing.door.place.x + atlas.radius_m * math.cos(heading_rad),
        thing.door.place.y + atlas.radius_m * math.sin(heading_rad),
    )


def _at(footing: Footing, values: np.ndarray, point: Point) -> float:
    return float(values[int(np.argmin(footing.away_m(point)))])


def _facing(thing: Referent, point: Point, reason: str) -> Stand:
    return Stand(point=point, yaw_rad=point.bearing_to(thing.anchor), reason=f"{reason}, facing it")
