"""The world cut flat: the outlines of everything solid within a band of heights.

LiDAR hits, collisions and free floor are all computed from slices.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point, Pose
from mapspeak.simulator.worlds.models import Mesh, base_height_m, build_parts, find_kind
from mapspeak.simulator.worlds.world import World, WorldObject, WorldWall

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
Contour = NDArray[np.float32]

SUBCELL_BITS = 6
"""Binary places of a pixel that OpenCV keeps when it fills an outline."""
_FINER = 4
"""Supersampling of filled outlines: OpenCV fills each pixel that an outline touches."""
_CELL_BITS = SUBCELL_BITS + 2
"""Binary places of a cell: those of a pixel, and two for the `_FINER` pixels."""
_SMALLEST_AREA_M2 = 1e-5
_ROUNDING_M = 0.003
"""Of the outlines of an object's parts."""


@dataclass(frozen=True, slots=True, eq=False)
class Slice:
    """The outlines of everything solid within a band of heights, in the world frame.

    Attributes:
        outlines: One array of shape (n, 2) for each solid part, its corners in order.
        edges: Shape (m, 4): the sides of all outlines as x, y of one end and x, y of the other.
    """

    outlines: tuple[FloatArray, ...]
    edges: FloatArray = field(init=False)
    _along: FloatArray = field(init=False)
    _squared: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        edges = _sides_of(self.outlines)
        edges.setflags(write=False)
        object.__setattr__(self, "edges", edges)
        # A driving robot asks at every step how near it has come.
        along = edges[:, 2:] - edges[:, :2]
        object.__setattr__(self, "_along", along)
        squared = np.maximum(np.einsum("ij,ij->i", along, along), 1e-12)
        object.__setattr__(self, "_squared", squared)

    def distance_to(self, point: Point) -> float:
        """Return how far a point is from the nearest side; infinite where nothing is solid."""
        return float(np.sqrt(self._squared_gaps(point).min(initial=math.inf)))

    def near(self, point: Point, *, reach_m: float) -> "Slice":
        """Return the solid parts within reach of a point, each part whole."""
        if not self.outlines:
            return self
        sizes = [len(outline) for outline in self.outlines]
        gaps = np.minimum.reduceat(self._squared_gaps(point), np.cumsum([0, *sizes[:-1]]))
        return Slice(
            tuple(
                outline
                for outline, gap in zip(self.outlines, gaps.tolist(), strict=True)
                if gap <= reach_m**2
            )
        )

    def _squared_gaps(self, point: Point) -> FloatArray:
        """Return the square of how far a point is from each side."""
        to_point = np.array([point.x, point.y]) - self.edges[:, :2]
        share = np.einsum("ij,ij->i", to_point, self._along)
        share /= self._squared
        np.clip(share, 0.0, 1.0, out=share)
        gap = to_point - share[:, None] * self._along
        return np.asarray(np.einsum("ij,ij->i", gap, gap))

    def is_solid_at(self, point: Point) -> bool:
        """Return True when a point lies inside a solid part."""
        place = (float(point.x), float(point.y))
        return any(
            cv2.pointPolygonTest(corners.astype(np.float32), place, measureDist=False) > 0
            for corners in self.outlines
        )

    def has_room_at(self, point: Point, *, radius_m: float) -> bool:
        """Return True when a round body fits at a point."""
        return self.distance_to(point) >= radius_m and not self.is_solid_at(point)


def slice_world(world: World, *, low_m: float, high_m: float) -> Slice:
    """Return the parts of a world that are solid anywhere between two heights above the floor."""
    leaves = [door.leaf for door in world.doors if door.is_shut]
    upright = (*world.walls, *leaves)
    outlines = [_outline_wall(wall) for wall in upright if low_m < wall.height_m]
    for thing in world.objects:
        outlines.extend(_outline_object(thing, low_m, high_m))
    return Slice(tuple(outlines))


def fill_outlines(
    outlines: Sequence[FloatArray],
    *,
    shape: tuple[int, int],
    origin: Point,
    cell_size_m: float,
    least_ratio: float = 0.5,
) -> NDArray[np.bool_]:
    """Return a mask of cells, True where enough of a cell lies inside an outline.

    Args:
        outlines: As in `Slice.outlines`, in the frame of the grid.
        shape: Rows and columns of the mask.
        origin: The outer corner of its row 0 and column 0.
        cell_size_m: The side of a cell.
        least_ratio: How much of a cell is enough.
    """
    scale = _FINER * (1 << SUBCELL_BITS) / cell_size_m
    half = (1 << SUBCELL_BITS) / 2
    # OpenCV puts whole numbers at the middle of a pixel, we at its corner.
    placed = [
        np.round((corners - (origin.x, origin.y)) * scale - half).astype(np.int32)
        for corners in outlines
    ]
    mask = np.zeros(shape, dtype=bool)
    rows, cols = _cells_around(placed, shape)
    if rows.start < rows.stop and cols.start < cols.stop:
        mask[rows, cols] = _shares_inside(placed, rows, cols) >= least_ratio * _FINER**2
    return mask


def _cells_around(placed: Sequence[IntArray], shape: tuple[int, int]) -> tuple[slice, slice]:
    """Return the rows and columns of the cells that outlines on finer pixels may touch."""
    if not placed:
        return slice(0, 0), slice(0, 0)
    low = np.min([corners.min(axis=0) for corners in placed], axis=0) >> _CELL_BITS
    high = (np.max([corners.max(axis=0) for corners in placed], axis=0) >> _CELL_BITS) + 2
    (first_col, first_row), (end_col, end_row) = (low - 1).tolist(), high.tolist()
    return (
        slice(max(first_row, 0), min(end_row, shape[0])),
        slice(max(first_col, 0), min(end_col, shape[1])),
    )


def _shares_inside(placed: Sequence[IntArray], rows: slice, cols: slice) -> NDArray[np.uint8]:
    """Return how many of the finer pixels of some cells lie inside outlines."""
    n_rows, n_cols = rows.stop - rows.start, cols.stop - cols.start
    picture = np.zeros((n_rows * _FINER, n_cols * _FINER), dtype=np.uint8)
    corner = np.array([cols.start, rows.start], dtype=np.int32) << _CELL_BITS
    for corners in placed:
        cv2.fillPoly(picture, [corners - corner], 1, shift=SUBCELL_BITS)
    down = picture.reshape(n_rows, _FINER, -1).sum(axis=1, dtype=np.uint8)
    return np.asarray(down.reshape(n_rows, n_cols, _FINER).sum(axis=2, dtype=np.uint8))


def _sides_of(outlines: Sequence[FloatArray]) -> FloatArray:
    """Return the sides of all outlines, as `Slice.edges` holds them."""
    if not outlines:
        return np.empty((0, 4))
    corners = np.concatenate(outlines)
    ends = np.cumsum([len(outline) for outline in outlines])
    following = np.arange(1, len(corners) + 1)
    following[ends - 1] = np.concatenate([[0], ends[:-1]])
    return np.hstack([corners, corners[following]])


def _outline_wall(wall: WorldWall) -> FloatArray:
    half, length = wall.thickness_m / 2, wall.length_m
    corners = (Point(0, -half), Point(length, -half), Point(length, half), Point(0, half))
    return _place(corners, wall.pose)


def _outline_object(thing: WorldObject, low_m: float, high_m: float) -> Iterator[FloatArray]:
    lifted_m = base_height_m(thing) - find_kind(thing.kind).base_height_m
    for corners in footprint(thing.kind, low_m - lifted_m, high_m - lifted_m):
        yield _place(corners, thing.pose)


def _place(corners: Sequence[Point], world_from_part: Pose) -> FloatArray:
    placed = [world_from_part.transform(corner) for corner in corners]
    return np.array([(point.x, point.y) for point in placed])


@lru_cache(maxsize=1024)
def footprint(kind: str, low_m: float, high_m: float) -> tuple[tuple[Point, ...], ...]:
    """Return the convex outlines of a kind's solid parts between two heights above the floor.

    They are counter-clockwise in the object's own frame (x to its front), for an object at its
    kind's usual base height. For one that hangs d metres higher, ask for the band d metres lower.
    An outline that lies within another one is left out.

    Raises:
        ConfigError: There is no kind of that name.
    """
    base_m = find_kind(kind).base_height_m
    return tuple(
        tuple(Point(float(x), float(y)) for x, y in hull)
        for hull in _find_hulls(build_parts(kind), low_m - base_m, high_m - base_m)
    )


def _find_hulls(parts: Iterable[Mesh], low_m: float, high_m: float) -> list[Contour]:
    """Return the convex hulls of the solid parts between two heights of their frame."""
    slices = (_points_between(part.corners, low_m, high_m) for part in parts if part.is_solid)
    hulls = [_hull(points) for points in slices if len(points) >= 3]
    large = [hull for hull in hulls if cv2.contourArea(hull) > _SMALLEST_AREA_M2]
    large.sort(key=cv2.contourArea, reverse=True)
    kept: list[Contour] = []
    for hull in large:
        if not any(_holds(other, hull) for other in kept):
            kept.append(hull)
    return kept


def _points_between(corners: FloatArray, low_m: float, high_m: float) -> FloatArray:
    """Return (x, y) of points that span the part of the triangles between two heights."""
    points = corners.reshape(-1, 3)
    found = [points[(points[:, 2] >= low_m) & (points[:, 2] <= high_m)]]
    start = points
    end = np.roll(corners, -1, axis=1).reshape(-1, 3)
    for height in (low_m, high_m):
        crosses = (start[:, 2] < height) != (end[:, 2] < height)
        a, b = start[crosses], end[crosses]
        share = (height - a[:, 2:]) / (b[:, 2:] - a[:, 2:])
        found.append(a + share * (b - a))
    return np.concatenate(found)[:, :2]


def _hull(points: FloatArray) -> Contour:
    hull = cv2.convexHull(points.astype(np.float32), clockwise=False)
    return np.asarray(cv2.approxPolyDP(hull, _ROUNDING_M, closed=True))[:, 0, :].astype(np.float32)


def _holds(outer: Contour, inner: Contour) -> bool:
    return all(
        cv2.pointPolygonTest(outer, (float(x), float(y)), measureDist=True) > -_ROUNDING_M
        for x, y in inner
    )
