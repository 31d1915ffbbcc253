"""Areas that are closed to the robot, and a map without their floor."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.memory.quoting import quote_name
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray, Mask
from mapspeak.spatial.paths.lattice import measure_away
from mapspeak.spatial.rooms import Door, Region, RoomMap

CLOSED = 100
"""A closed cell is as little floor to drive on as one with a wall."""
MARGIN_M = 0.15
"""Distance that paths and goals keep between the robot's edge and a closed area.

A pose is off by some centimetres, and no navigation follows a way exactly.
"""


Outline = tuple[Point, ...]
"""Corners in order; the last one is joined to the first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedArea:
    """A part of the floor that no part of the robot may be over.

    Attributes:
        outline: Its corners in order, in the map frame.
        further_outlines: Of its other parts and of the holes in them: what lies within an even
            number of all outlines is outside.
        until: When it opens again, as people read it; empty where it never does.
        reason: Why it is closed, in the operator's words; may be empty.
        event_id: Of the event that closes it; empty where the policy does.
    """

    name: str
    outline: Outline
    further_outlines: tuple[Outline, ...] = ()
    until: str = ""
    reason: str = ""
    event_id: str = ""
    _sides: FloatArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # A mask has thousands of sides, and distances are asked for many times a second.
        outlines = [np.array([[at.x, at.y] for at in outline]) for outline in self.outlines]
        # Rows of x, y, x, y.
        sides = np.concatenate([np.hstack([each, np.roll(each, -1, axis=0)]) for each in outlines])
        sides.setflags(write=False)
        object.__setattr__(self, "_sides", sides)

    def __hash__(self) -> int:
        """Return the same for equal areas without looking at all corners of a mask."""
        return hash((self.name, self.until, self.outline[0], len(self.outline)))

    @property
    def outlines(self) -> tuple[Outline, ...]:
        """All outlines, of parts and of holes."""
        return (self.outline, *self.further_outlines)

    @property
    def title(self) -> str:
        """The area in words."""
        if self.until or self.event_id:
            # An id is told as it is; words of an event are not the operator's.
            is_quoted = bool(self.event_id) and not self.name.isalnum()
            name = quote_name(self.name) if is_quoted else repr(self.name)
            return f"area {name}, {self.closing}"
        return f"keep-out area {self.name!r}"

    @property
    def closing(self) -> str:
        """What closes it and until when: "closed by event E2 until 05:30"."""
        by = f" by event {self.event_id}" if self.event_id else ""
        return f"closed{by} until {self.until}" if self.until else f"closed{by}"

    @property
    def bounds(self) -> tuple[Point, Point]:
        """The corners with the least and the greatest x and y."""
        low, high = self._sides[:, :2].min(axis=0), self._sides[:, :2].max(axis=0)
        return Point(*low.tolist()), Point(*high.tolist())

    def contains(self, point: Point) -> bool:
        """Return True when a point lies inside."""
        x0, y0, x1, y1 = self._sides.T
        is_crossed = (y0 > point.y) != (y1 > point.y)
        x0, y0, x1, y1 = self._sides[is_crossed].T
        crossed_x = x0 + (point.y - y0) / (y1 - y0) * (x1 - x0)
        return int(np.count_nonzero(crossed_x > point.x)) % 2 == 1

    def distance_to(self, point: Point) -> float:
        """Return the metres from a point to the area; 0 inside it."""
        return max(self.distance_to_border(point), 0.0)

    def distance_to_border(self, point: Point) -> float:
        """Return the metres from a point to the nearest outline; negative inside the area."""
        away_m = distance_to_sides(point, self._sides)
        return -away_m if self.contains(point) else away_m


def distance_to_sides(point: Point, sides: FloatArray) -> float:
    """Return the metres from a point to the nearest of straight lines, rows of x, y, x, y."""
    x0, y0, x1, y1 = sides.T
    along_x, along_y = x1 - x0, y1 - y0
    squared = along_x**2 + along_y**2
    share = (point.x - x0) * along_x + (point.y - y0) * along_y
    share = np.clip(share / np.where(squared > 0.0, squared, 1.0), 0.0, 1.0)
    off_x, off_y = x0 + share * along_x - point.x, y0 + share * along_y - point.y
    return float(np.sqrt((off_x**2 + off_y**2).min()))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ClosedFloor(OccupancyGrid):
    """A map on which closed areas are no floor; for planning, not for showing."""

    areas: tuple[ClosedArea, ...]

    def find_barred(self, start: Point) -> Mask | None:
        """Find the cells of the areas that a place is not in: one may only leave an area."""
        others = [area for area in self.areas if not area.contains(start)]
        return mask_areas(self, others) if others else None

    def find_areas_along(self, points: Sequence[Point], *, within_m: float) -> list[ClosedArea]:
        """Find the closed areas that reach nearer than that to a way, in the order of the way."""
        found = (self.find_area(point, within_m=within_m) for point in points)
        return list(dict.fromkeys(area for area in found if area is not None))

    def find_area(self, point: Point, *, within_m: float) -> ClosedArea | None:
        """Find the nearest closed area that reaches nearer to a point than that."""
        near = [(area.distance_to(point), area) for area in self.areas]
        distance_m, area = min(near, key=lambda each: each[0], default=(math.inf, None))
        return area if distance_m < within_m or distance_m == 0.0 else None


def close_floor(grid: OccupancyGrid, areas: Sequence[ClosedArea]) -> OccupancyGrid:
    """Return the map without the floor that is closed; the map itself where nothing is.

    What lies around an area within the margin is closed too. Distances run between the centres of
    cells, of which up to half a diagonal lies nearer: that of two cells is added.
    """
    if not areas:
        return grid
    is_closed = (
        measure_away(mask_areas(grid, areas)) * grid.resolution_m
        <= MARGIN_M + math.sqrt(2) * grid.resolution_m
    )
    cells = np.where(is_closed & grid.free, CLOSED, grid.cells)
    return ClosedFloor(
        cells=cells.astype(np.int8),
        resolution_m=grid.resolution_m,
        origin=grid.origin,
        stamp_s=grid.stamp_s,
        areas=tuple(areas),
    )


def mask_areas(grid: OccupancyGrid, areas: Sequence[ClosedArea]) -> Mask:
    """Return True at the cells of a map that some area touches."""
    drawn = np.zeros(grid.cells.shape, dtype=np.uint8)
    for area in areas:
        # Several outlines are filled as `contains` counts them; a border belongs to its area.
        polygons = []
        for outline in area.outlines:
            rows, cols = grid.cells_at(np.array([[corner.x, corner.y] for corner in outline]))
            corners = np.stack([cols, rows], axis=1).clip(-_FAR_CELLS, _FAR_CELLS)
            polygons.append(corners.astype(np.int32))
        cv2.fillPoly(drawn, polygons, 1)
    return np.asarray(drawn > 0, dtype=np.bool_)


_FAR_CELLS = 30_000
"""OpenCV draws with 16 bits before the point; no map has that many rows or columns."""


SILL_M = 0.3
"""Depth of the floor, along the way through, that belongs to a door."""
POST_M = 0.15
"""Length by which a door's outline reaches into the walls beside it."""
N_CORNERS = 8


def outlines_of_region(rooms: RoomMap, region: Region) -> tuple[Outline, ...]:
    """Return the borders of a region's parts, through the centres of its border cells.

    The outer ones come first, then those around other regions: a corridor closes no room inside it.
    """
    inside = (rooms.labels == region.index).astype(np.uint8)
    contours, tree = cv2.findContours(inside, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    holes = [each for each, (*_, parent) in zip(contours, tree[0], strict=True) if parent >= 0]
    outer = [each for each, (*_, parent) in zip(contours, tree[0], strict=True) if parent < 0]
    outlines = []
    for contour in (*outer, *(each for each in holes if _holds_regions(rooms, region, each))):
        cols, rows = contour[:, 0, 0].astype(np.intp), contour[:, 0, 1].astype(np.intp)
        points = rooms.grid.points_at(rows, cols).tolist()
        outlines.append(tuple(Point(x, y) for x, y in points))
    return tuple(outlines)


def _holds_regions(rooms: RoomMap, region: Region, hole: np.ndarray) -> bool:
    """Return True where a border, as (col, row), runs round floor of other regions."""
    left, low, width, height = cv2.boundingRect(hole)
    labels = rooms.labels[low : low + height, left : left + width]
    within = np.zeros(labels.shape, dtype=np.uint8)
    cv2.fillPoly(within, [hole - (left, low)], 1)
    return bool(((within > 0) & (labels > 0) & (labels != region.index)).any())


def outline_of_door(rooms: RoomMap, door: Door) -> Outline:
    """Return a narrow rectangle from post to post of a door."""
    along_rad = _direction_of(rooms, door)
    half_m = door.width_m / 2 + POST_M
    ahead = np.array([math.cos(along_rad), math.sin(along_rad)])
    aside = np.array([-ahead[1], ahead[0]])
    middle = np.array([door.place.x, door.place.y])
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    corners = (middle + a * half_m * ahead + b * SILL_M / 2 * aside for a, b in signs)
    return tuple(Point(*corner.tolist()) for corner in corners)


def outline_around(point: Point, *, radius_m: float) -> Outline:
    """Return a round outline."""
    angles = (math.tau * (n + 0.5) / N_CORNERS for n in range(N_CORNERS))
    reach_m = radius_m / math.cos(math.pi / N_CORNERS)
    return tuple(
        Point(point.x + reach_m * math.cos(each), point.y + reach_m * math.sin(each))
        for each in angles
    )


def _direction_of(rooms: RoomMap, door: Door) -> float:
    """Return the direction from post to post: that of the border between the two regions."""
    own, beside = (rooms.region(each).index for each in door.region_ids)
    touching = cv2.dilate((rooms.labels == beside).astype(np.uint8), np.ones((3, 3), np.uint8))
    points = rooms.grid.points_at(*np.nonzero((rooms.labels == own) & (touching > 0)))
    off_m = np.hypot(points[:, 0] - door.place.x, points[:, 1] - door.place.y)
    border = points[off_m <= door.width_m / 2 + POST_M]
    if len(border) < 2:
        one, other = (rooms.region(each).widest for each in door.region_ids)
        return one.bearing_to(other) + math.pi / 2
    centred = border - border.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    return math.atan2(axes[0, 1], axes[0, 0])
