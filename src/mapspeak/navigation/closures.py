"""Areas that are closed to the robot, and a map's floor without them."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import IntArray, Mask

__all__ = ["MARGIN_M", "ClosedArea", "ClosedFloor", "close_floor", "distance_to_line", "mask_areas"]

CLOSED = 100
"""A closed cell is as little floor to drive on as one with a wall."""
MARGIN_M = 0.15
"""What ways and goals leave between the robot's edge and a closed area.

A pose is off by some centimetres, and no navigation follows a way exactly.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedArea:
    """A part of the floor that no part of the robot may be over.

    Attributes:
        name: What people call it.
        outline: Its corners in order, in the map frame.
        until: When it opens again, as people read it; empty where it never does.
    """

    name: str
    outline: tuple[Point, ...]
    until: str = ""

    @property
    def title(self) -> str:
        """The area in words."""
        kind = f"area {self.name!r}, closed until {self.until}"
        return kind if self.until else f"keep-out area {self.name!r}"

    def contains(self, point: Point) -> bool:
        """True when a point lies inside the outline."""
        n_crossings = 0
        for start, end in self._sides():
            if (start.y > point.y) != (end.y > point.y):
                share = (point.y - start.y) / (end.y - start.y)
                n_crossings += start.x + share * (end.x - start.x) > point.x
        return n_crossings % 2 == 1

    def distance_to(self, point: Point) -> float:
        """Gives the metres from a point to the area; 0 inside it."""
        return max(self.distance_to_border(point), 0.0)

    def distance_to_border(self, point: Point) -> float:
        """Gives the metres from a point to the outline; negative inside it."""
        away_m = min(distance_to_line(point, start, end) for start, end in self._sides())
        return -away_m if self.contains(point) else away_m

    def _sides(self) -> Iterator[tuple[Point, Point]]:
        return zip(self.outline, (*self.outline[1:], self.outline[0]), strict=True)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ClosedFloor(OccupancyGrid):
    """A map on which closed areas are no floor; for planning, not for showing.

    Attributes:
        areas: What is closed.
    """

    areas: tuple[ClosedArea, ...]

    def find_area(self, point: Point, *, within_m: float) -> ClosedArea | None:
        """Finds the nearest closed area that reaches nearer to a point than that."""
        near = [(area.distance_to(point), area) for area in self.areas]
        distance_m, area = min(near, key=lambda each: each[0], default=(math.inf, None))
        return area if distance_m < within_m or distance_m == 0.0 else None


def close_floor(grid: OccupancyGrid, areas: Sequence[ClosedArea]) -> OccupancyGrid:
    """Gives the map without the floor that is closed; the map itself where nothing is.

    What lies around an area within the margin is closed too. Distances run between the centres of
    cells, of which up to half a diagonal lies nearer: that of two cells is added.
    """
    if not areas:
        return grid
    untouched = np.logical_not(mask_areas(grid, areas)).astype(np.uint8)
    off_cells = cv2.distanceTransform(untouched, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    is_closed = off_cells * grid.resolution_m <= MARGIN_M + math.sqrt(2) * grid.resolution_m
    cells = np.where(is_closed & grid.free, CLOSED, grid.cells)
    return ClosedFloor(
        cells=cells.astype(np.int8),
        resolution_m=grid.resolution_m,
        origin=grid.origin,
        stamp_s=grid.stamp_s,
        areas=tuple(areas),
    )


def mask_areas(grid: OccupancyGrid, areas: Sequence[ClosedArea]) -> Mask:
    """True at the cells of a map that some area touches."""
    drawn = np.zeros(grid.cells.shape, dtype=np.uint8)
    for area in areas:
        corners = [_corners_in(grid, area)]
        cv2.fillPoly(drawn, corners, 1)
    return np.asarray(drawn > 0, dtype=np.bool_)


def _corners_in(grid: OccupancyGrid, area: ClosedArea) -> IntArray:
    """Gives the cells of an outline's corners as (col, row); a border belongs to its area."""
    points = np.array([[corner.x, corner.y] for corner in area.outline])
    rows, cols = grid.cells_at(points)
    return np.stack([cols, rows], axis=1).clip(-_FAR_CELLS, _FAR_CELLS).astype(np.int32)


_FAR_CELLS = 30_000
"""OpenCV draws with 16 bits before the point; no map has so many rows or columns."""


def distance_to_line(point: Point, start: Point, end: Point) -> float:
    """Gives the metres from a point to the straight line between two others."""
    along_x, along_y = end.x - start.x, end.y - start.y
    squared = along_x**2 + along_y**2
    if squared == 0.0:
        return point.distance_to(start)
    share = ((point.x - start.x) * along_x + (point.y - start.y) * along_y) / squared
    share = min(max(share, 0.0), 1.0)
    return point.distance_to(Point(start.x + share * along_x, start.y + share * along_y))
