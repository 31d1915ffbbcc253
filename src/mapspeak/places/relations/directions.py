"""Left, right, in front, behind, north: places in some direction from a thing."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mapspeak.errors import GoalError
from mapspeak.geometry import Point
from mapspeak.places.doorways import find_near_side, find_normal, other_side, point_before
from mapspeak.places.naming import Place
from mapspeak.places.relations.grammar import Towards
from mapspeak.places.relations.placement import find_reachable_cells, refuse, stand, tolerance_m
from mapspeak.places.relations.referents import (
    ROBOT,
    Referent,
    refer_to_door,
)
from mapspeak.places.relations.vocabulary import Compass, Side, read_heading
from mapspeak.places.standing import reach_doors
from mapspeak.spatial.rooms import Door, Region
from mapspeak.worldmodel.model import WorldModel

SECTOR_RAD = math.radians(40)
"""Largest angle off a direction at which a place still lies in it."""
AWAY_M = 1.0
FARTHEST_M = 2.5
"""A place on a side of a thing is at most this far from it."""
BESIDE_DOOR_M = 0.6
BEYOND_RAD = math.radians(60)
"""Largest angle off the direction through a door that still leads through it."""
HERE_M = 0.3
"""From nearer than this, a thing has no sides."""
TURNS = {Side.FRONT: 0.0, Side.LEFT: math.pi / 2, Side.BEHIND: math.pi, Side.RIGHT: -math.pi / 2}
"""Turns from a thing's own front to its sides; for a viewer left and right are swapped."""


@dataclass(frozen=True, slots=True)
class Aim:
    """Where to look for a place.

    Attributes:
        heading_rad: The direction from the thing.
        away_m: How far from its edge it should be.
        home: The region it has to lie in; None for any.
        sees: The point that must be in sight; None for none.
        how: What to say of the point of view.
    """

    heading_rad: float
    away_m: float = AWAY_M
    home: Region | None = None
    sees: Point | None = None
    how: str = ""


def stand_towards(
    world: WorldModel, thing: Referent, wanted: Towards, seen_from: Referent | None
) -> Place:
    """Find where to stand in some direction from a thing.

    Raises:
        GoalError: Nothing fits, or the direction has no meaning there; the hint says what would do.
    """
    if wanted.direction is Side.FRONT and thing.region is not None and seen_from is None:
        thing = front_of_region(world, thing.region)
    aim = _aim_at(world, thing, wanted, seen_from)
    found = _search(world, thing, aim, is_asked=wanted.away_m is not None)
    if found is None:
        far = "" if wanted.away_m is None else f" {wanted.away_m:g} m"
        raise refuse(
            f"The robot can stand nowhere{far} {_say(wanted)} {thing.name}{aim.how}.",
            list(_what_works(world, thing, wanted, seen_from)),
        )
    point, away_m = found
    edge = "" if thing.is_point else ", measured from its edge"
    reason = f"{away_m:.1f} m {_say(wanted)} {thing.name}{aim.how}{edge}"
    if thing.name == ROBOT:
        # It cannot face itself: it comes straight on.
        return stand(point, reason)
    return stand(point, f"{reason}, facing it", point.bearing_to(thing.anchor))


def front_of_region(world: WorldModel, region: Region) -> Referent:
    """Return the door of a region that the robot comes to first, as seen from outside.

    Raises:
        GoalError: No door of it can be reached.
    """
    reached = reach_doors(world, world.rooms.doors_of(region))
    if not reached:
        raise refuse(
            f"{region.id} has no door that the robot can get to, so it has no front.",
            [f"north of {region.id}", f"next to {region.id}"],
        )
    _, door, _ = reached[0]
    name = f"{region.id} (its door {door.id})"
    return refer_to_door(world, door, other_side(world, door, region), name=name)


def _say(wanted: Towards) -> str:
    return f"{wanted.direction} of" if isinstance(wanted.direction, Compass) else wanted.direction


def _aim_at(world: WorldModel, thing: Referent, wanted: Towards, seen_from: Referent | None) -> Aim:
    door, direction = thing.door, wanted.direction
    if isinstance(direction, Compass) and door is not None:
        aim = _aim_past_door(world, thing, door, direction)
    elif isinstance(direction, Compass):
        aim = Aim(direction.heading_rad, home=thing.home if thing.is_point else None)
    elif door is not None:
        aim = _aim_at_door(world, thing, door, direction, seen_from)
    else:
        aim = _aim_at_thing(world, thing, direction, seen_from)
    sees = thing.anchor if thing.is_point else aim.sees
    return replace(aim, sees=sees, away_m=wanted.away_m or aim.away_m)


def _aim_at_thing(
    world: WorldModel, thing: Referent, side: Side, seen_from: Referent | None
) -> Aim:
    if seen_from is None and thing.front_rad is not None:
        heading_rad = thing.front_rad + TURNS[side]
        return Aim(heading_rad, home=thing.home, how=" by its own heading")
    viewer = world.robot.point if seen_from is None else seen_from.anchor
    who = ROBOT if seen_from is None else seen_from.name
    if thing.region is not None and world.rooms.find_region_at(viewer) is thing.region:
        raise refuse(
            f"{side.capitalize()} {thing.name} means nothing from inside it, where {who} is.",
            [f"north of {thing.name}", f"the north wall of {thing.name}", f"next to {thing.name}"],
        )
    if viewer.distance_to(thing.anchor) < HERE_M:
        if seen_from is not None:
            raise refuse(f"{who} is too near to {thing.name} to see it from a side.")
        how = " by the heading of the robot, which is there"
        return Aim(world.robot.yaw_rad + TURNS[side], home=thing.home, how=how)
    look_rad = viewer.bearing_to(thing.anchor)
    turn_rad = math.pi - TURNS[side] if side in (Side.FRONT, Side.BEHIND) else TURNS[side]
    how = f" as seen from {who}, looking {read_heading(look_rad)}"
    return Aim(look_rad + turn_rad, home=thing.home, how=how)


def _aim_at_door(
    world: WorldModel, thing: Referent, door: Door, side: Side, seen_from: Referent | None
) -> Aim:
    near, who = thing.home or find_near_side(world, door), ROBOT
    if seen_from is not None:
        near, who = _side_seen_from(world, door, seen_from), seen_from.name
    home = other_side(world, door, near) if side is Side.BEHIND else near
    is_beside = side in (Side.LEFT, Side.RIGHT)
    return Aim(
        find_normal(world, door, near) + (-TURNS[side] if is_beside else TURNS[side]),
        away_m=BESIDE_DOOR_M if is_beside else AWAY_M,
        home=home,
        sees=point_before(world, door, home),
        how=f" as seen from {who} in {near.id}" if side is not Side.FRONT else f" in {home.id}",
    )


def _aim_past_door(world: WorldModel, thing: Referent, door: Door, compass: Compass) -> Aim:
    """Aim into the region that lies that way; along the wall, on the robot's side of it."""
    home = thing.home or find_near_side(world, door)
    off_rad = find_normal(world, door, home) - compass.heading_rad
    if math.cos(off_rad) < -math.cos(BEYOND_RAD):
        home = other_side(world, door, home)
    sees = point_before(world, door, home)
    return Aim(compass.heading_rad, home=home, sees=sees, how=f" in {home.id}")


def _side_seen_from(world: WorldModel, door: Door, viewer: Referent) -> Region:
    """Return the region of a door on whose side a viewer is."""
    sides = [world.rooms.region(region_id) for region_id in door.region_ids]
    standing = viewer.region or viewer.home
    for side in sides:
        if standing is not None and side.id == standing.id:
            return side

    def ahead(side: Region) -> float:
        return math.cos(find_normal(world, door, side) - door.place.bearing_to(viewer.anchor))

    return max(sides, key=ahead)


def _search(
    world: WorldModel, thing: Referent, aim: Aim, *, is_asked: bool
) -> tuple[Point, float] | None:
    """Find the place nearest to what is aimed at, and how far from the thing it is.

    Args:
        is_asked: The words say how far.
    """
    along = np.array([math.cos(aim.heading_rad), math.sin(aim.heading_rad)])
    offsets = thing.extent - np.array([thing.anchor.x, thing.anchor.y])
    edge_m = float((offsets @ along).max())
    sideways = offsets @ np.array([-along[1], along[0]])
    reach_m = edge_m + float(np.abs(sideways).max()) + max(aim.away_m, FARTHEST_M) + 1.0
    floor = find_reachable_cells(world, thing.anchor, reach_m)
    forward_m = floor.along_m(thing.anchor, aim.heading_rad) - edge_m
    lateral_m = floor.along_m(thing.anchor, aim.heading_rad + math.pi / 2)
    outside_m = np.maximum(
        np.maximum(float(sideways.min()) - lateral_m, lateral_m - float(sideways.max())), 0.0
    )
    away_m = np.hypot(forward_m, outside_m)
    allowed = (forward_m > 0) & (outside_m <= math.tan(SECTOR_RAD) * forward_m)
    allowed &= floor.is_beside(aim.home, thing.region)
    if is_asked:
        allowed &= np.abs(away_m - aim.away_m) <= tolerance_m(world.grid.resolution_m)
    else:
        allowed &= (away_m >= 0.4 * aim.away_m) & (away_m <= FARTHEST_M)
    costs = np.hypot(forward_m - aim.away_m, outside_m) + 0.1 * np.abs(lateral_m)
    point = floor.choose(world, allowed, costs, in_sight_of=aim.sees)
    return None if point is None else (point, floor.at(away_m, point))


def _what_works(
    world: WorldModel, thing: Referent, wanted: Towards, seen_from: Referent | None
) -> Iterator[str]:
    """Return the phrases of the same kind in which the robot could stand."""
    around: tuple[Side | Compass, ...] = tuple(Side)
    if isinstance(wanted.direction, Compass):
        around = (Compass.NORTH, Compass.EAST, Compass.SOUTH, Compass.WEST)
    for direction in (wanted.direction, *(each for each in around if each != wanted.direction)):
        other = replace(wanted, direction=direction, away_m=None)
        try:
            aim = _aim_at(world, thing, other, seen_from)
        except GoalError:
            continue
        found = _search(world, thing, aim, is_asked=False)
        if found is not None:
            yield f"{found[1]:.1f} m {_say(other)} {thing.name}"
