"""The outline of a room as straight walls and the corners between them."""

import itertools
import math
from dataclasses import dataclass

import cv2
import numpy as np

from mapspeak.geometry import Point, wrap_angle
from mapspeak.spatial.grid import Mask
from mapspeak.spatial.rooms import Region
from mapspeak.worldmodel.model import WorldModel

ROUGHNESS_M = 0.25
"""An outline is straight where it bends by no more than this."""
LEAST_WALL_M = 0.6
"""Shorter ones are the sides of pillars, niches and door frames."""
CORNER_RAD = (math.radians(50), math.radians(130))
BEHIND_M = 0.35
"""A wall stands at most so far behind the last floor."""
RECTANGLE_RATIO = 0.75
LEAST_WALL_RATIO = 0.5
"""So much of a side must be wall; the rest may be doors and openings."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wall:
    """A straight side of a region.

    Attributes:
        start: One end, on the floor.
        end: The other end, counter-clockwise around the region.
    """

    start: Point
    end: Point

    @property
    def length_m(self) -> float:
        """From end to end."""
        return self.start.distance_to(self.end)

    @property
    def middle(self) -> Point:
        """Half way along."""
        return Point((self.start.x + self.end.x) / 2, (self.start.y + self.end.y) / 2)

    @property
    def heading_rad(self) -> float:
        """Along it, the room to the left."""
        return self.start.bearing_to(self.end)

    @property
    def outward_rad(self) -> float:
        """Out of the room."""
        return wrap_angle(self.heading_rad - math.pi / 2)


@dataclass(frozen=True, slots=True)
class BareCorner:
    """Where two walls meet.

    Attributes:
        point: On the floor.
        outward_rad: Out of the room, half way between the walls' directions.
    """

    point: Point
    outward_rad: float


@dataclass(frozen=True, slots=True)
class Outline:
    """A region's corners that point outwards, and its walls.

    Attributes:
        corners: Where two walls meet.
        walls: The straight ones.
        middle: Of the rectangle that it fills, or the mean of the floor.
    """

    corners: tuple[BareCorner, ...]
    walls: tuple[Wall, ...]
    middle: Point


def find_outline(world: WorldModel, region: Region) -> Outline:
    """Find the walls and corners of a region's floor.

    A room that nearly fills a rectangle has its four corners, whatever furniture stands in them.
    """
    window = world.rooms.window_of(region)
    inside = world.rooms.labels[window] == region.index
    cells = _trace_rectangle(inside)
    corner = window[0].start, window[1].start
    points = None if cells is None else [_point_at(world, corner, *cell) for cell in cells]
    if points is None or not _is_own(world, region, points):
        points = [_point_at(world, corner, *cell) for cell in _trace(world, inside)]
        middle = _mean_of(world, inside, corner)
    else:
        middle = Point(sum(p.x for p in points) / 4, sum(p.y for p in points) / 4)
    sides = [
        Wall(start=one, end=other)
        for one, other in zip(points, points[1:] + points[:1], strict=True)
    ]
    return Outline(
        corners=tuple(
            BareCorner(one.end, _between(one.outward_rad, other.outward_rad))
            for one, other in itertools.pairwise([*sides, *sides[:1]])
            if _is_corner(one, other)
        ),
        walls=tuple(side for side in sides if _is_wall(world, side)),
        middle=middle,
    )


def _between(one_rad: float, other_rad: float) -> float:
    return wrap_angle(one_rad + wrap_angle(other_rad - one_rad) / 2)


def _mean_of(world: WorldModel, inside: Mask, corner: tuple[int, int]) -> Point:
    rows, cols = np.nonzero(inside)
    x, y = world.grid.points_at(rows + corner[0], cols + corner[1]).mean(axis=0).tolist()
    return Point(x, y)


def _trace_rectangle(inside: Mask) -> list[tuple[int, int]] | None:
    """Return the corners of the rectangle that a region nearly fills; None where it does not."""
    found, _ = cv2.findContours(inside.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    rectangle = cv2.minAreaRect(np.concatenate(found))
    (_, (one, other), _) = rectangle
    if float(inside.sum()) < RECTANGLE_RATIO * (one + 1) * (other + 1):
        return None
    return _ordered(np.rint(cv2.boxPoints(rectangle)))


def _is_own(world: WorldModel, region: Region, corners: list[Point]) -> bool:
    """Return True where no corner lies in another region."""
    middle = Point(sum(p.x for p in corners) / 4, sum(p.y for p in corners) / 4)
    inner = (Point(p.x + 0.05 * (middle.x - p.x), p.y + 0.05 * (middle.y - p.y)) for p in corners)
    return all(world.find_room_id(point) in (region.id, None) for point in inner)


def _trace(world: WorldModel, inside: Mask) -> list[tuple[int, int]]:
    """Return the corners of the outline as (col, row), counter-clockwise on the map."""
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
    return _ordered(cv2.approxPolyDP(longest, rough, closed=True)[:, 0, :] - n)


def _ordered(polygon: np.ndarray) -> list[tuple[int, int]]:
    """Return the corners of a polygon counter-clockwise; rows grow upwards on the map."""
    area = cv2.contourArea(polygon.astype(np.float32).reshape(-1, 1, 2), oriented=True)
    return [(int(col), int(row)) for col, row in (polygon[::-1] if area < 0 else polygon)]


def _point_at(world: WorldModel, corner: tuple[int, int], col: int, row: int) -> Point:
    x, y = world.grid.points_at(np.array([row + corner[0]]), np.array([col + corner[1]]))[
        0
    ].tolist()
    return Point(x, y)


def _is_corner(one: Wall, other: Wall) -> bool:
    turn_rad = wrap_angle(other.heading_rad - one.heading_rad)
    is_long = min(one.length_m, other.length_m) >= LEAST_WALL_M
    return is_long and CORNER_RAD[0] <= turn_rad <= CORNER_RAD[1]


def _is_wall(world: WorldModel, side: Wall) -> bool:
    """Return True where most of what lies behind a long side is no floor."""
    if side.length_m < LEAST_WALL_M:
        return False
    grid = world.grid
    shares = np.linspace(0.05, 0.95, max(math.ceil(side.length_m / grid.resolution_m), 2))
    along = np.stack(
        [
            side.start.x + shares * (side.end.x - side.start.x),
            side.start.y + shares * (side.end.y - side.start.y),
        ],
        axis=1,
    )
    out = np.array([math.cos(side.outward_rad), math.sin(side.outward_rad)])
    is_solid = np.zeros(shares.size, dtype=np.bool_)
    reach_m = max(BEHIND_M, 2 * grid.resolution_m)
    # The floor of a doorway may reach a little into the wall, and the side with it.
    for step_m in np.arange(-1.0, reach_m / grid.resolution_m + 0.5) * grid.resolution_m:
        rows, cols = grid.cells_at(along + step_m * out)
        rows, cols = rows.clip(0, grid.n_rows - 1), cols.clip(0, grid.n_cols - 1)
        is_solid |= grid.occupied[rows, cols]
    return bool(is_solid.mean() >= LEAST_WALL_RATIO)
