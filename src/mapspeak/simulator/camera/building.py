"""Floor, ceiling, walls with their skirting, door frames and lamps, as flat panels."""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point, Pose
from mapspeak.simulator.worlds.models import Surface
from mapspeak.simulator.worlds.world import World, WorldDoor, WorldWall

FloatArray = NDArray[np.float64]
Colour = tuple[int, int, int]

PAINT: Colour = (255, 255, 255)
SKIRTING: Colour = (112, 118, 124)
FRAME: Colour = (104, 116, 128)
LAMP: Colour = (255, 255, 252)
TILE_M = {Surface.FLOOR: 4.0, Surface.WALL: 2.0, Surface.CEILING: 1.2}
"""Metres covered by one tile of a repeated surface."""

LOWEST_CEILING_M = 2.5
SKIRTING_M = 0.09
DOOR_M = 2.1
_WIDEST_DOOR_M = 3.0
_CASING_M = 0.07
_CASING_DEPTH_M = 0.02
_MARGIN_M = 1.0
_LAMP_SIZE_M = (1.2, 0.3)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Panel:
    """A flat rectangle that is seen from the side where `right` points right and `up` up.

    Attributes:
        corner: Its lower left corner.
        right: From there to the lower right one.
        up: From there to the upper left one.
        surface: The repeated drawing on it.
    """

    corner: FloatArray
    right: FloatArray
    up: FloatArray
    colour: Colour = PAINT
    surface: Surface = Surface.WALL
    glows: bool = False

    @property
    def normal(self) -> FloatArray:
        """The direction it faces."""
        ax, ay, az = self.right.tolist()
        bx, by, bz = self.up.tolist()
        across = (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
        return np.array(across) / math.hypot(*across)

    @property
    def size_m(self) -> tuple[float, float]:
        """Its width and its height."""
        return math.hypot(*self.right.tolist()), math.hypot(*self.up.tolist())


def find_ceiling(world: World) -> float:
    """Return the height of the ceiling: that of the highest wall, and at least a usual one."""
    return max([LOWEST_CEILING_M, *(wall.height_m for wall in world.walls)])


def find_bounds(world: World) -> tuple[Point, Point]:
    """Return two opposite corners of the plan, with a margin."""
    points = [point for wall in world.walls for point in (wall.start, wall.end)]
    points += [thing.pose.point for thing in world.objects] + [world.start.point]
    points += [corner for room in world.rooms for corner in room.outline]
    xs, ys = [point.x for point in points], [point.y for point in points]
    return (
        Point(min(xs) - _MARGIN_M, min(ys) - _MARGIN_M),
        Point(max(xs) + _MARGIN_M, max(ys) + _MARGIN_M),
    )


def build_panels(world: World, lamps: FloatArray, ceiling_m: float) -> tuple[Panel, ...]:
    """Return all panels; `lamps` are the places of lamps, shape (n, 3)."""
    return (
        *_floor_and_ceiling(world, ceiling_m),
        *(panel for wall in _fill_corners(world.walls) for panel in _wall(wall, ceiling_m)),
        *(panel for door in world.doors for panel in _door(door, world)),
        *(panel for door in world.doors if door.is_shut for panel in _wall(door.leaf, ceiling_m)),
        *(_lamp(place) for place in lamps),
    )


def _floor_and_ceiling(world: World, ceiling_m: float) -> Iterator[Panel]:
    low, high = find_bounds(world)
    along, across = np.array([high.x - low.x, 0, 0]), np.array([0, high.y - low.y, 0])
    yield Panel(corner=np.array([low.x, low.y, 0.0]), right=along, up=across, surface=Surface.FLOOR)
    yield Panel(
        corner=np.array([low.x, low.y, ceiling_m]),
        right=across,
        up=along,
        surface=Surface.CEILING,
    )


def _fill_corners(walls: Sequence[WorldWall]) -> Iterator[WorldWall]:
    """Return walls extended where others meet their ends, so that corners are closed."""
    meeting: dict[tuple[int, int], list[WorldWall]] = defaultdict(list)
    for wall in walls:
        for end in (wall.start, wall.end):
            meeting[_place_in_cm(end)].append(wall)
    for wall in walls:
        bearing = wall.pose.yaw_rad
        before_m, behind_m = (
            max(
                (other.thickness_m / 2 for other in others if _is_across(other, bearing)), default=0
            )
            for others in (meeting[_place_in_cm(wall.start)], meeting[_place_in_cm(wall.end)])
        )
        yield replace(
            wall, start=wall.point_at(-before_m), end=wall.point_at(wall.length_m + behind_m)
        )


def _place_in_cm(point: Point) -> tuple[int, int]:
    return round(point.x * 100), round(point.y * 100)


def _is_across(wall: WorldWall, bearing_rad: float) -> bool:
    return abs(math.sin(wall.pose.yaw_rad - bearing_rad)) > 0.1


def _wall(wall: WorldWall, ceiling_m: float) -> Iterator[Panel]:
    pose, height = wall.pose, wall.height_m
    length, half = wall.length_m, wall.thickness_m / 2
    right_side = (Point(0, -half), Point(length, -half))
    left_side = (Point(length, half), Point(0, half))
    far_end = (Point(length, -half), Point(length, half))
    near_end = (Point(0, half), Point(0, -half))
    for left, right in (right_side, left_side, far_end, near_end):
        yield _upright(pose, left, right, (0.0, SKIRTING_M), SKIRTING)
        yield _upright(pose, left, right, (SKIRTING_M, height), PAINT)
    if height < ceiling_m - 0.01:
        yield _level(pose, (Point(0, -half), Point(length, half)), height, PAINT)


def _door(door: WorldDoor, world: World) -> Iterator[Panel]:
    """Return the piece of wall above a door, and a frame around it on both sides."""
    wall = _find_wall_beside(door, world)
    if wall is None or door.width_m > _WIDEST_DOOR_M:
        return
    half_width, half = door.width_m / 2, wall.thickness_m / 2
    head = min(DOOR_M, wall.height_m)
    if wall.height_m > DOOR_M + _CASING_M:
        for side in (0.0, math.pi):
            pose = door.pose @ Pose(0, 0, side)
            ends = Point(-half_width, -half), Point(half_width, -half)
            yield _upright(pose, *ends, (DOOR_M, wall.height_m), PAINT)
        yield _underside(door.pose, (half_width, half), DOOR_M)
    for side in (0.0, math.pi):
        yield from _casing(door.pose @ Pose(0, 0, side), half_width, half, head)


def _casing(pose: Pose, half_width: float, half: float, head: float) -> Iterator[Panel]:
    """Return a frame on the side that faces along -y of the door's own frame."""
    y = -half - _CASING_DEPTH_M
    outer = half_width + _CASING_M
    for x in (-outer, half_width):
        beam = (Point(x, y), Point(x + _CASING_M, y))
        yield _upright(pose, *beam, (0.0, head + _CASING_M), FRAME)
        yield _upright(pose, Point(x, -half), Point(x, y), (0.0, head + _CASING_M), FRAME)
        far = x + _CASING_M
        yield _upright(pose, Point(far, y), Point(far, -half), (0.0, head + _CASING_M), FRAME)
    ends = Point(-half_width, y), Point(half_width, y)
    yield _upright(pose, *ends, (head, head + _CASING_M), FRAME)


def _find_wall_beside(door: WorldDoor, world: World) -> WorldWall | None:
    """Return the wall that ends where the door begins."""
    jambs = [door.pose.transform(Point(side * door.width_m / 2, 0.0)) for side in (-1, 1)]
    for wall in world.walls:
        for end in (wall.start, wall.end):
            if min(end.distance_to(jamb) for jamb in jambs) < 0.1:
                return wall
    return None


def _upright(
    pose: Pose, left: Point, right: Point, heights_m: tuple[float, float], colour: Colour
) -> Panel:
    a, b = pose.transform(left), pose.transform(right)
    low, high = heights_m
    return Panel(
        corner=np.array([a.x, a.y, low]),
        right=np.array([b.x - a.x, b.y - a.y, 0.0]),
        up=np.array([0.0, 0.0, high - low]),
        colour=colour,
    )


def _level(pose: Pose, corners: tuple[Point, Point], height_m: float, colour: Colour) -> Panel:
    low, high = corners
    a = pose.transform(low)
    b, c = pose.transform(Point(high.x, low.y)), pose.transform(Point(low.x, high.y))
    return Panel(
        corner=np.array([a.x, a.y, height_m]),
        right=np.array([b.x - a.x, b.y - a.y, 0.0]),
        up=np.array([c.x - a.x, c.y - a.y, 0.0]),
        colour=colour,
    )


def _underside(pose: Pose, half_size: tuple[float, float], height_m: float) -> Panel:
    seen_from_above = _level(
        pose,
        (Point(-half_size[0], -half_size[1]), Point(half_size[0], half_size[1])),
        height_m,
        PAINT,
    )
    return Panel(corner=seen_from_above.corner, right=seen_from_above.up, up=seen_from_above.right)


def _lamp(place: FloatArray) -> Panel:
    length, width = _LAMP_SIZE_M
    return Panel(
        corner=place - (length / 2, width / 2, 0.0),
        right=np.array([0.0, width, 0.0]),
        up=np.array([length, 0.0, 0.0]),
        colour=LAMP,
        glows=True,
    )
