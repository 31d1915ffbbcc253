"""Corners, walls and the middle of a room."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Point, wrap_angle
from mapspeak.places.naming import say_spot
from mapspeak.places.relations.grammar import Compass, read_heading, say_heading
from mapspeak.places.relations.outlines import Wall, find_outline
from mapspeak.places.relations.placement import Stand, find_footing, join_or, refuse
from mapspeak.places.relations.referents import Referent
from mapspeak.places.standing import facing_in
from mapspeak.spatial.rooms import Region, RoomClass
from mapspeak.worldmodel.model import WorldModel

CORNER_M = 1.5
WALL_M = 0.8
"""Who stands at a wall has at most so much room between it and the robot's own circle."""
MIDDLE_M = 2.0
SAME_SIDE_RAD = math.radians(46)
LONG_RATIO = 0.3


@dataclass(frozen=True, slots=True)
class FoundCorner:
    """A corner of a region with the name of where it is."""

    region: Region
    compass: Compass
    point: Point

    @property
    def name(self) -> str:
        """Such as "the north-east corner of R2"."""
        return f"the {self.compass} corner of {self.region.id}"


@dataclass(frozen=True, slots=True)
class FoundWall:
    """A wall of a region with the name of where it is."""

    region: Region
    wall: Wall

    @property
    def name(self) -> str:
        """Such as "the north wall of R2"."""
        return f"the {say_heading(self.wall.outward_rad)} wall of {self.region.id}"


def find_corners(
    world: WorldModel, region: Region, compass: Compass | None = None
) -> tuple[FoundCorner, ...]:
    """Find the corners of a region, or the one that points in a direction.

    Raises:
        GoalError: There is none, or there are several.
    """
    named = [
        FoundCorner(region, read_heading(each.outward_rad), each.point)
        for each in find_outline(world, region).corners
    ]
    if not named:
        raise refuse(f"{region.id} has no clear corners.", [f"the middle of {region.id}"])
    if compass is None:
        return tuple(named)
    there = [each for each in named if each.compass is compass]
    if len(there) == 1:
        return (there[0],)
    if there:
        at = join_or([say_spot(each.point) for each in there])
        raise refuse(
            f"{region.id} has {len(there)} {compass} corners.",
            else_hint=f"Say which by x, y: {at}.",
        )
    raise refuse(f"{region.id} has no corner in the {compass}.", _names(named))


def _names(found: Sequence[FoundCorner] | Sequence[FoundWall]) -> list[str]:
    return list(dict.fromkeys(each.name for each in found))


def find_walls(
    world: WorldModel, region: Region, compass: Compass | None = None
) -> tuple[FoundWall, ...]:
    """Find the walls of a region, or the outermost long one on a side.

    Raises:
        GoalError: There is none.
    """
    found = [FoundWall(region, wall) for wall in find_outline(world, region).walls]
    if not found:
        raise refuse(f"{region.id} has no straight walls.", [f"the middle of {region.id}"])
    if compass is None:
        return tuple(found)

    def off_rad(each: FoundWall) -> float:
        return abs(wrap_angle(each.wall.outward_rad - compass.heading_rad))

    there = [each for each in found if off_rad(each) <= SAME_SIDE_RAD]
    if not there:
        raise refuse(f"{region.id} has no straight wall in the {compass}.", _names(found))
    longest_m = max(each.wall.length_m for each in there)
    long = [each for each in there if each.wall.length_m >= LONG_RATIO * longest_m]
    return (max(long, key=lambda each: _ahead(each.wall.middle, compass)),)


def _ahead(point: Point, compass: Compass) -> float:
    return point.x * math.cos(compass.heading_rad) + point.y * math.sin(compass.heading_rad)


def find_middle(world: WorldModel, region: Region) -> Point:
    """Return the middle of a room's floor, and of a corridor half the way along it."""
    walk = world.map.walk_along(region) if region.room_class is RoomClass.CORRIDOR else None
    return find_outline(world, region).middle if walk is None else walk.middle


def stand_in_middle(world: WorldModel, thing: Referent) -> Stand:
    """Find the place nearest to the middle of a region.

    Raises:
        GoalError: The thing has no middle, or the robot gets nowhere near it.
    """
    region = thing.region
    if region is None:
        raise refuse(
            f"{thing.name} is no room or corridor, so it has no middle.",
            [thing.name, f"next to {thing.name}"],
        )
    middle = find_middle(world, region)
    footing = find_footing(world, middle, MIDDLE_M)
    away_m = footing.away_m(middle)
    is_here = (footing.regions == region.index) & (away_m <= MIDDLE_M)
    point = footing.choose(world, is_here, away_m)
    if point is None:
        raise refuse(
            f"The robot can stand nowhere within {MIDDLE_M:.0f} m of the middle of {region.id}."
        )
    off_m = point.distance_to(middle)
    reason = f"{off_m:.1f} m from the middle of {region.id}, looking where most of it lies"
    return Stand(point=point, yaw_rad=facing_in(world, region, point), reason=reason)


def stand_in_corner(world: WorldModel, corners: Sequence[FoundCorner]) -> Stand:
    """Find where to stand in the first of some corners in which the robot can.

    Raises:
        GoalError: It can in none.
    """
    for corner in corners:
        footing = find_footing(world, corner.point, CORNER_M + 1.0)
        away_m = footing.away_m(corner.point)
        is_here = (footing.regions == corner.region.index) & (away_m <= CORNER_M)
        point = footing.choose(world, is_here, away_m, in_sight_of=corner.point)
        if point is not None:
            off_m = point.distance_to(corner.point)
            reason = f"{off_m:.1f} m from {corner.name}, facing it"
            return Stand(point=point, yaw_rad=point.bearing_to(corner.point), reason=reason)
    raise refuse(
        f"The robot can stand nowhere within {CORNER_M:.1f} m of {corners[0].name}.",
        list(_corners_that_work(world, corners)),
    )


def _corners_that_work(world: WorldModel, tried: Sequence[FoundCorner]) -> Iterator[str]:
    points = [corner.point for corner in tried]
    for corner in find_corners(world, tried[0].region):
        if corner.point in points:
            continue
        footing = find_footing(world, corner.point, CORNER_M)
        is_here = footing.regions == corner.region.index
        if (is_here & (footing.away_m(corner.point) <= CORNER_M)).any():
            yield corner.name


def stand_at_wall(world: WorldModel, walls: Sequence[FoundWall], *, is_along: bool) -> Stand:
    """Find where to stand at the first of some walls at which the robot can.

    Raises:
        GoalError: It can at none.
    """
    for found in walls:
        stand = _stand_at(world, found, is_along=is_along)
        if stand is not None:
            return stand
    raise refuse(f"The robot can stand nowhere at {walls[0].name}: something is in the way.")


def _stand_at(world: WorldModel, found: FoundWall, *, is_along: bool) -> Stand | None:
    wall = found.wall
    reach_m = wall.length_m / 2 + world.radius_m + WALL_M
    footing = find_footing(world, wall.middle, reach_m)
    off_m = -footing.along_m(wall.start, wall.outward_rad)
    aside_m = np.abs(footing.along_m(wall.middle, wall.heading_rad))
    allowed = (footing.regions == found.region.index) & (aside_m <= wall.length_m / 2)
    least_m = world.radius_m - world.grid.resolution_m
    allowed &= (off_m >= least_m) & (off_m <= world.radius_m + WALL_M)
    point = footing.choose(world, allowed, off_m + 0.5 * aside_m)
    if point is None:
        return None
    beside = float(off_m[int(np.argmin(footing.away_m(point)))])
    if not is_along:
        reason = f"{beside:.1f} m from {found.name}, facing it"
        return Stand(point=point, yaw_rad=wall.outward_rad, reason=reason)
    yaw_rad = wall.heading_rad
    came_rad = world.robot.point.bearing_to(point)
    if math.cos(came_rad - yaw_rad) < 0:
        yaw_rad = wrap_angle(yaw_rad + math.pi)
    reason = f"{beside:.1f} m from {found.name}, heading {say_heading(yaw_rad)} along it"
    return Stand(point=point, yaw_rad=yaw_rad, reason=reason)
