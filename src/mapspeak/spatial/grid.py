"""The occupancy grid and its cells: the one conversion between the world and the grid.

A grid is what ROS publishes as `nav_msgs/OccupancyGrid`: row 0 lies at the origin, rows grow along
the grid's own y axis, columns along its x axis, and the origin pose is that of the outer corner of
cell (0, 0) in the map frame. The origin may be turned.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose

UNKNOWN = -1
FREE_MAX = 49
"""The highest occupancy that counts as free: Cartographer publishes free cells as 0 to 49."""

LEAST_RESOLUTION_M, LARGEST_RESOLUTION_M = 0.0005, 100.0
FARTHEST_ORIGIN_M = 1e8

_Scalar = TypeVar("_Scalar", bound=np.generic)
Mask = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
Window = tuple[slice, slice]
"""Rows and columns of a part of an array."""


@dataclass(frozen=True, slots=True, order=True)
class Cell:
    """One cell of a grid. Row 0 is at the grid's origin, not at the top of a picture."""

    row: int
    col: int


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class OccupancyGrid:
    """An occupancy grid; compared by identity.

    Attributes:
        cells: int8, shape (rows, cols): -1 unknown, 0..100 the probability of being occupied.
        origin: The pose of the outer corner of cell (0, 0).
        stamp_s: Robot time at which the map was made.

    Raises:
        MapError: The array is not two-dimensional, holds other values, or resolution or origin
            are out of range.
    """

    cells: NDArray[np.int8]
    resolution_m: float
    origin: Pose = field(default=Pose(0.0, 0.0, 0.0))
    stamp_s: float = 0.0
    _masks: dict[str, Mask] = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self) -> None:
        _check(np.asarray(self.cells), self.resolution_m, self.origin)
        if not _is_immutable(self.cells):
            cells = np.array(self.cells, dtype=np.int8, order="C")
            cells.setflags(write=False)
            object.__setattr__(self, "cells", cells)

    @property
    def n_rows(self) -> int:
        """Cells along the grid's y axis."""
        return int(self.cells.shape[0])

    @property
    def n_cols(self) -> int:
        """Cells along the grid's x axis."""
        return int(self.cells.shape[1])

    @property
    def width_m(self) -> float:
        """The length of the grid's x side (paper eq. 2)."""
        return self.n_cols * self.resolution_m

    @property
    def height_m(self) -> float:
        """The length of the grid's y side (paper eq. 2)."""
        return self.n_rows * self.resolution_m

    @property
    def free(self) -> Mask:
        """True where a robot can be: occupancy 0 to 49. Built once and locked, as the next two."""
        # As an unsigned byte, unknown is 255.
        return self._mask("free", lambda: self.cells.view(np.uint8) <= FREE_MAX)

    @property
    def occupied(self) -> Mask:
        """True where an obstacle is: occupancy 50 to 100."""
        return self._mask("occupied", lambda: self.cells > FREE_MAX)

    @property
    def unknown(self) -> Mask:
        """True where nothing has been seen yet."""
        return self._mask("unknown", lambda: self.cells < 0)

    def _mask(self, name: str, build: Callable[[], Mask]) -> Mask:
        if name not in self._masks:
            mask = build()
            mask.setflags(write=False)
            self._masks[name] = mask
        return self._masks[name]

    def is_free(self, cell: Cell) -> bool:
        """Return True where a robot can be; never outside the array."""
        return self.contains(cell) and 0 <= int(self.cells[cell.row, cell.col]) <= FREE_MAX

    def is_occupied(self, cell: Cell) -> bool:
        """Return True where an obstacle is; never outside the array."""
        return self.contains(cell) and int(self.cells[cell.row, cell.col]) > FREE_MAX

    def is_unknown(self, cell: Cell) -> bool:
        """Return True where nothing has been seen yet, as everywhere outside the array."""
        return not self.contains(cell) or int(self.cells[cell.row, cell.col]) < 0

    def find_barred(self, start: Point) -> Mask | None:  # noqa: ARG002 - of the map itself, none
        """Find the cells that no way from a place may pass; None if there are none.

        Walls are excluded: with an error of pose or map, a robot may seem to stand in a wall. Areas
        that people closed are included, whatever the error of the pose.
        """
        return None

    def bounds(self) -> tuple[Point, Point]:
        """Return the least and the greatest x and y of the map, as two points."""
        corners = [
            self.origin.transform(Point(x, y))
            for x in (0.0, self.width_m)
            for y in (0.0, self.height_m)
        ]
        xs, ys = [corner.x for corner in corners], [corner.y for corner in corners]
        return Point(min(xs), min(ys)), Point(max(xs), max(ys))

    def contains(self, cell: Cell) -> bool:
        """Return True when the cell lies inside the array."""
        return 0 <= cell.row < self.n_rows and 0 <= cell.col < self.n_cols

    def contains_cells(self, rows: IntArray, cols: IntArray) -> Mask:
        """Return True for rows and columns, of one shape, of cells that lie inside the array."""
        return np.asarray((rows >= 0) & (rows < self.n_rows) & (cols >= 0) & (cols < self.n_cols))

    def window(self, rows: IntArray | int, cols: IntArray | int, *, margin: int) -> Window:
        """Return the part of the array around some cells, with a margin in cells."""
        return _span(rows, margin, self.n_rows), _span(cols, margin, self.n_cols)

    def window_around(self, point: Point, reach_m: float) -> Window:
        """Return the part of the array that holds all cells within a distance of a point."""
        cell = self.cell_at(point)
        return self.window(cell.row, cell.col, margin=math.ceil(reach_m / self.resolution_m))

    def look_up(
        self, values: NDArray[_Scalar], points: FloatArray, *, outside: float
    ) -> NDArray[_Scalar]:
        """Return the values of the cells that points fall in, and a default outside the array.

        Args:
            values: One for each cell of the grid.
            points: In metres, shape (..., 2).
        """
        rows, cols = self.cells_at(points.reshape(-1, 2))
        is_inside = self.contains_cells(rows, cols)
        found = np.full(rows.size, outside, dtype=values.dtype)
        found[is_inside] = values[rows[is_inside], cols[is_inside]]
        return found.reshape(points.shape[:-1])

    def crop(self, rows: slice, cols: slice) -> "OccupancyGrid":
        """Return a part of the map, at its own place in the world; slices begin on the array."""
        corner = Pose(cols.start * self.resolution_m, rows.start * self.resolution_m)
        return OccupancyGrid(
            cells=self.cells[rows, cols],
            resolution_m=self.resolution_m,
            origin=self.origin @ corner,
            stamp_s=self.stamp_s,
        )

    def cell_at(self, point: Point) -> Cell:
        """Return the cell a point falls in, which may lie outside the array (see `contains`)."""
        row, col = self._in_cells(point.x, point.y)
        return Cell(math.floor(row), math.floor(col))

    def point_at(self, cell: Cell) -> Point:
        """Return the centre of a cell."""
        x, y = self._in_metres(cell.row, cell.col)
        return Point(float(x), float(y))

    def cells_at(self, points: FloatArray) -> tuple[IntArray, IntArray]:
        """Return rows and columns for points of shape (n, 2); they may lie outside the array."""
        in_grid = self.fractional_cells_at(points)
        floored = np.floor(in_grid).astype(np.intp)
        return floored[:, 0], floored[:, 1]

    def fractional_cells_at(self, points: FloatArray) -> FloatArray:
        """Return (row, col) of shape (n, 2) as real numbers; a cell's centre is at +0.5, +0.5."""
        return np.stack(self._in_cells(points[:, 0], points[:, 1]), axis=1)

    def points_at(self, rows: IntArray, cols: IntArray) -> FloatArray:
        """Return the centres of cells in metres, shape (n, 2)."""
        return np.stack(self._in_metres(rows, cols), axis=1)

    def _in_cells(self, x: Any, y: Any) -> tuple[Any, Any]:  # noqa: ANN401 - numbers or arrays
        """Return row and column, as real numbers, of one point or of many."""
        cos, sin = np.cos(self.origin.yaw_rad), np.sin(self.origin.yaw_rad)
        dx, dy = x - self.origin.x, y - self.origin.y
        row, col = -sin * dx + cos * dy, cos * dx + sin * dy
        return row / self.resolution_m, col / self.resolution_m

    def _in_metres(self, rows: Any, cols: Any) -> tuple[Any, Any]:  # noqa: ANN401 - see above
        """Return x and y of the centres of one cell or of many."""
        cos, sin = np.cos(self.origin.yaw_rad), np.sin(self.origin.yaw_rad)
        along_x = (cols + 0.5) * self.resolution_m
        along_y = (rows + 0.5) * self.resolution_m
        x = self.origin.x + cos * along_x - sin * along_y
        y = self.origin.y + sin * along_x + cos * along_y
        return x, y


def _span(places: IntArray | int, margin: int, size: int) -> slice:
    first, last = int(np.min(places)) - margin, int(np.max(places)) + margin
    return slice(min(max(first, 0), size), min(max(last + 1, 0), size))


def _is_immutable(cells: NDArray[np.integer[Any]]) -> bool:
    """Return True for an array backed by `bytes`, as from a connection: it needs no copy."""
    owner: object = cells
    if not (isinstance(owner, np.ndarray) and owner.dtype == np.int8 and owner.flags.c_contiguous):
        return False
    while isinstance(owner, np.ndarray):
        if owner.flags.writeable:
            return False
        owner = owner.base
    return isinstance(owner, bytes)


def _check(cells: NDArray[np.integer[Any]], resolution_m: float, origin: Pose) -> None:
    if cells.ndim != 2:
        raise MapError(
            f"A map has two dimensions, this array has {cells.ndim}.",
            hint="Give an array of shape (rows, cols).",
        )
    if not LEAST_RESOLUTION_M <= resolution_m <= LARGEST_RESOLUTION_M:
        raise MapError(
            f"The map's resolution is {resolution_m} m per cell.",
            hint=f"It must be a positive number of metres, {LEAST_RESOLUTION_M} to "
            f"{LARGEST_RESOLUTION_M}, such as 0.05.",
        )
    if not (origin.is_finite() and max(abs(origin.x), abs(origin.y)) <= FARTHEST_ORIGIN_M):
        raise MapError(
            f"The map's origin is no place on Earth: {origin}.",
            hint="Give numbers of metres for x and y, and of radians for yaw.",
        )
    if cells.size and (int(cells.min()) < UNKNOWN or int(cells.max()) > 100):
        raise MapError(
            f"The map holds values from {cells.min()} to {cells.max()}.",
            hint="Occupancy is -1 (unknown) or 0 to 100.",
        )
