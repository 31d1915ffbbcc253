"""Walls, corners and the middle of a room, and where to stand at them."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from mapspeak.geometry import Point, wrap_angle
from mapspeak.places.naming import Place, say_spot
from mapspeak.places.relations.grammar import End
from mapspeak.places.relations.placement import find_reachable_cells, join_or, refuse, stand
from mapspeak.places.relations.vocabulary import Compass, read_heading
from mapspeak.places.standing import cells_of, facing_in
from mapspeak.spatial import Cell
from mapspeak.spatial.grid import Mask
from mapspeak.spatial.rooms import Region, RoomClass
from mapspeak.worldmodel.model import WorldModel

ROUGHNESS_M = 0.25
"""An outline is straight where it bends by no more than this."""
LEAST_WALL_M = 0.6
"""Shorter ones are the sides of pillars, niches and door frames."""
CORNER_RAD = (math.radians(50), math.radians(130))
BEHIND_M = 0.35
"""Largest distance from the last floor to the wall behind it."""
RECTANGLE_RATIO = 0.75
LEAST_WALL_RATIO = 0.5
"""Least share of a side that must be wall; the rest may be doors and openings."""
AT_CORNER_M = 1.5
AT_WALL_M = 0.8
"""The most room between a wall and the circle of a robot that stands at it."""
MIDDLE_M = 2.0
SAME_SIDE_RAD = math.radians(46)
LONG_RATIO = 0.3


@dataclass(frozen=True, slots=True)
class Wall:
    """A straight side of a region, between two points on its floor, counter-clockwise around it."""

    region: Region
    start: Point
    end: Point

    @property
    def name(self) -> str:
        """Such as "the north wall of R2"."""
        return f"the {read_heading(self.outward_rad)} wall of {self.region.id}"

    @property
    def length_m(self) -> float:
        """From end to end."""
        return self.start.distance_to(self.end)

    @property
    def middle(self) -> Point:
        """Half way along."""
        return _mean((self.start, self.end))

    @property
    def heading_rad(self) -> float:
        """Along it, the room to the left."""
        return self.start.bearing_to(self.end)

    @property
    def outward_rad(self) -> float:
        """Out of the room."""
        return wrap_angle(self.heading_rad - math.pi / 2)


@dataclass(frozen=True, slots=True)
class RoomCorner:
    """A point of a region's floor where two walls meet, and where in the region that is."""

    region: Region
    point: Point
    compass: Compass

    @property
    def name(self) -> str:
        """Such as "the north-east corner of R2"."""
        return f"the {self.compass} corner of {self.region.id}"


def find_corners(
    world: WorldModel, region: Region, compass: Compass | None = None
) -> tuple[RoomCorner, ...]:
    """Find the corners of a region that point outwards, or the one in a direction.

    Raises:
        GoalError: There is none, or there are several.
    """
    sides, _ = find_sides(world, region)
    found = [
        RoomCorner(region, one.end, read_heading(_between(one.outward_rad, other.outward_rad)))
        for one, other in itertools.pairwise([*sides, *sides[:1]])
        if _is_corner(one, other)
    ]
    if not found:
        raise refuse(f"{region.id} has no clear corners.", [f"the middle of {region.id}"])
    there = [each for each in found if compass in (None, each.compass)]
    if not there:
        raise refuse(f"{region.id} has no corner in the {compass}.", _names(found))
    if compass is not None and len(there) > 1:
        at = join_or([say_spot(each.point) for each in there])
        raise refuse(
            f"{region.id} has {len(there)} {compass} corners.",
            else_hint=f"Say which by x, y: {at}.",
        )
    return tuple(there)


def find_walls(
    world: WorldModel, region: Region, compass: Compass | None = None
) -> tuple[Wall, ...]:
    """Find the walls of a region, or the outermost long one on a side.

    Raises:
        GoalError: There is none.
    """
    found = [side for side in find_sides(world, region)[0] if _is_wall(world, side)]
    if not found:
        raise refuse(f"{region.id} has no straight walls.", [f"the middle of {region.id}"])
    if compass is None:
        return tuple(found)
    north_rad = compass.heading_rad
    there = [
        each for each in found if abs(wrap_angle(each.outward_rad - north_rad)) <= SAME_SIDE_RAD
    ]
    if not there:
        raise refuse(f"{region.id} has no straight wall in the {compass}.", _names(found))

    def ahead_m(wall: Wall) -> float:
        return wall.middle.x * math.cos(north_rad) + wall.middle.y * math.sin(north_rad)

    longest_m = max(each.length_m for each in there)
    return (max((w for w in there if w.length_m >= LONG_RATIO * longest_m), key=ahead_m),)


def _names(found: Sequence[RoomCorner] | Sequence[Wall]) -> list[str]:
    return list(dict.fromkeys(each.name for each in found))


def find_middle(world: WorldModel, region: Region) -> Point:
    """Return the middle of a room's floor, and of a corridor half the way along it."""
    walk = world.map.walk_along(region) if region.room_class is RoomClass.CORRIDOR else None
    return find_sides(world, region)[1] if walk is None else walk.middle


def stand_in_middle(world: WorldModel, region: Region) -> Place:
    """Find the place nearest to the middle of a region.

    Raises:
        GoalError: The robot gets nowhere near it.
    """
    middle = find_middle(world, region)
    floor = find_reachable_cells(world, middle, MIDDLE_M)
    away_m = floor.away_m(middle)
    is_here = (floor.regions == region.index) & (away_m <= MIDDLE_M)
    point = floor.choose(world, is_here, away_m)
    if point is None:
        raise refuse(
            f"The robot can stand nowhere within {MIDDLE_M:.0f} m of the middle of {region.id}."
        )
    off_m = point.distance_to(middle)
    reason = f"{off_m:.1f} m from the middle of {region.id}, looking where most of it lies"
    return stand(point, reason, facing_in(world, region, point))


def stand_at_end(world: WorldModel, region: Region, wanted: End) -> Place:
    """Find where to stand at an end of a corridor, coming straight on.

    Raises:
        GoalError: It is no corridor, or the robot gets to no such end.
    """
    is_corridor = region.room_class is RoomClass.CORRIDOR
    walk = world.map.walk_along(region) if is_corridor else None
    if walk is None:
        middle = f"the middle of {region.id}"
        raise refuse(f"{region.id} is not a corridor with doors: it has no ends.", [middle])
    ends: list[tuple[float, Point, str]] = []
    for end, other in ((walk.start, walk.end), (walk.end, walk.start)):
        floor = find_reachable_cells(world, end, MIDDLE_M)
        is_here = (floor.regions == region.index) & (floor.away_m(end) <= MIDDLE_M)
        point = floor.choose(world, is_here, floor.away_m(end))
        if point is not None:
            name = f"the {read_heading(other.bearing_to(end))} end of {region.id}"
            ends.append((floor.at(floor.paths_m, point), point, name))
    if not ends:
        raise refuse(f"The robot gets to no end of {region.id}.")
    if wanted.compass is None:
        _, point, name = min(ends) if wanted.is_near else max(ends)
        which = "nearer" if wanted.is_near else "farther"
        return stand(point, f"{name}, the {which} one by path from the robot")
    heading_rad = wanted.compass.heading_rad
    _, point, name = max(
        ends, key=lambda end: math.cos(walk.middle.bearing_to(end[1]) - heading_rad)
    )
    return stand(point, name)


def stand_in_corner(world: WorldModel, corners: Sequence[RoomCorner]) -> Place:
    """Find where to stand in the first of some corners in which the robot can.

    Raises:
        GoalError: It can in none.
    """
    for corner in corners:
        floor = find_reachable_cells(world, corner.point, AT_CORNER_M + 1.0)
        away_m = floor.away_m(corner.point)
        is_here = (floor.regions == corner.region.index) & (away_m <= AT_CORNER_M)
        point = floor.choose(world, is_here, away_m, in_sight_of=corner.point)
        if point is not None:
            off_m = point.distance_to(corner.point)
            reason = f"{off_m:.1f} m from {corner.name}, facing it"
            return stand(point, reason, point.bearing_to(corner.point))
    raise refuse(
        f"The robot can stand nowhere within {AT_CORNER_M:.1f} m of {corners[0].name}.",
        list(_corners_that_work(world, corners)),
    )


def _corners_that_work(world: WorldModel, tried: Sequence[RoomCorner]) -> Iterator[str]:
    for corner in find_corners(world, tried[0].region):
        floor = find_reachable_cells(world, corner.point, AT_CORNER_M)
        is_here = floor.regions == corner.region.index
        is_near = floor.away_m(corner.point) <= AT_CORNER_M
        if corner not in tried and (is_here & is_near).any():
            yield corner.name


def stand_at_wall(world: WorldModel, walls: Sequence[Wall], *, is_along: bool) -> Place:
    """Find where to stand at the first of some walls at which the robot can.

    Raises:
        GoalError: It can at none.
    """
    found = (_stand_at(world, wall, is_along=is_along) for wall in walls)
    place = next(filter(None, found), None)
    if place is None:
        raise refuse(f"The robot can stand nowhere at {walls[0].name}.")
    return place


def _stand_at(world: WorldModel, wall: Wall, *, is_along: bool) -> Place | None:
    floor = find_reachable_cells(world, wall.middle, wall.length_m / 2 + world.radius_m + AT_WALL_M)
    off_m = -floor.along_m(wall.start, wall.outward_rad)
    aside_m = np.abs(floor.along_m(wall.middle, wall.heading_rad))
    allowed = (floor.regions == wall.region.index) & (aside_m <= wall.length_m / 2)
    least_m = world.radius_m - world.grid.resolution_m
    allowed &= (off_m >= least_m) & (off_m <= world.radius_m + AT_WALL_M)
    point = floor.choose(world, allowed, off_m + 0.5 * aside_m)
    if point is None:
        return None
    beside = f"{floor.at(off_m, point):.1f} m from {wall.name}"
    if not is_along:
        return stand(point, f"{beside}, facing it", wall.outward_rad)
    yaw_rad = wall.heading_rad
    if math.cos(world.robot.point.bearing_to(point) - yaw_rad) < 0:
        yaw_rad = wrap_angle(yaw_rad + math.pi)
    return stand(point, f"{beside}, heading {read_heading(yaw_rad)} along it", yaw_rad)


def find_sides(world: WorldModel, region: Region) -> tuple[list[Wall], Point]:
    """Find the sides of a region's floor, counter-clockwise, and its middle.

    A room that nearly fills a rectangle has its four sides, whatever furniture stands at them.
    """
    window = world.rooms.window_of(region)
    inside = world.rooms.labels[window] == region.index

    def points_of(polygon: np.ndarray) -> list[Point]:
        # Rows grow upwards on the map, so that what is positive there runs counter-clockwise.
        area = cv2.contourArea(polygon.astype(np.float32).reshape(-1, 1, 2), oriented=True)
        cells = polygon[::-1] if area < 0 else polygon
        low_row, low_col = window[0].start, window[1].start
        return [world.grid.point_at(Cell(int(y) + low_row, int(x) + low_col)) for x, y in cells]

    rectangle = _trace_rectangle(inside)
    points = None if rectangle is None else points_of(rectangle)
    if points is not None and _is_own(world, region, points):
        middle = _mean(points)
    else:
        points = points_of(_trace(world, inside))
        floor = world.grid.points_at(*cells_of(world.rooms, region))
        # The mean of a floor that bends may lie in another room.
        away_m = np.hypot(*(floor - floor.mean(axis=0)).T)
        middle = Point(*floor[int(np.argmin(away_m))].tolist())
    ends = [*points[1:], *points[:1]]
    return [Wall(region, *pair) for pair in zip(points, ends, strict=True)], middle


def _mean(points: Sequence[Point]) -> Point:
    return Point(sum(p.x for p in points) / len(points), sum(p.y for p in points) / len(points))


def _between(one_rad: float, other_rad: float) -> float:
    return wrap_angle(one_rad + wrap_angle(other_rad - one_rad) / 2)


def _trace_rectangle(inside: Mask) -> np.ndarray | None:
    """Return the corners of the rectangle that a region nearly fills; None where it does not."""
    found, _ = cv2.findContours(inside.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    rectangle = cv2.minAreaRect(np.concatenate(found))
    (_, (one, other), _) = rectangle
    if float(inside.sum()) < RECTANGLE_RATIO * (one + 1) * (other + 1):
        return None
    return np.rint(cv2.boxPoints(rectangle))


def _is_own(world: WorldModel, region: Region, corners: list[Point]) -> bool:
    """Return True where no corner lies in another region."""
    middle = _mean(corners)
    inner = (Point(p.x + 0.05 * (middle.x - p.x), p.y + 0.05 * (middle.y - p.y)) for p in corners)
    return all(world.find_room_id(point) in (region.id, None) for point in inner)


def _trace(world: WorldModel, inside: Mask) -> np.ndarray:
    """Return the corners of the outline as (col, row)."""
    n = 2 * max(round(ROUGHNESS_M / world.grid.resolution_m / 2), 0) + 1
    framed = np.pad(inside.astype(np.uint8), n)
    kernel = cv2.getStructuringElement(cv2.MORPH_RECT, (n, n))
    closed = cv2.morphologyEx(framed, cv2.MORPH_CLOSE, kernel)
    opened = cv2.morphologyEx(closed, cv2.MORPH_OPEN, kernel)
    found, _ = cv2.findContours(
        opened if opened.any() else framed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    longest = max(found, key=cv2.contourArea)
    rough = max(ROUGHNESS_M / world.grid.resolution_m, 1.5)
    return np.asarray(cv2.approxPolyDP(longest, rough, closed=True)[:, 0, :] - n)


def _is_corner(one: Wall, other: Wall) -> bool:
    turn_rad = wrap_angle(other.heading_rad - one.heading_rad)
    is_long = min(one.length_m, other.length_m) >= LEAST_WALL_M
    return is_long and CORNER_RAD[0] <= turn_rad <= CORNER_RAD[1]


def _is_wall(world: WorldModel, side: Wall) -> bool:
    """Return True if most of what lies behind a long side is not floor."""
    if side.length_m < LEAST_WALL_M:
        return False
    grid = world.grid
    shares = np.linspace(0.05, 0.95, max(math.ceil(side.length_m / grid.resolution_m), 2))
    start = np.array([side.start.x, side.start.y])
    along = start + shares[:, None] * (np.array([side.end.x, side.end.y]) - start)
    out = np.array([math.cos(side.outward_rad), math.sin(side.outward_rad)])
    is_solid = np.zeros(shares.size, dtype=np.bool_)
    reach_m = max(BEHIND_M, 2 * grid.resolution_m)
    # The floor of a doorway may reach a little into the wall, and the side with it.
    for step_m in np.arange(-1.0, reach_m / grid.resolution_m + 0.5) * grid.resolution_m:
        rows, cols = grid.cells_at(along + step_m * out)
        rows, cols = rows.clip(0, grid.n_rows - 1), cols.clip(0, grid.n_cols - 1)
        is_solid |= grid.occupied[rows, cols]
    return bool(is_solid.mean() >= LEAST_WALL_RATIO)
