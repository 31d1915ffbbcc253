"""The occupancy grid and its cells: the one conversion between the world and the grid.

A grid is what ROS publishes as `nav_msgs/OccupancyGrid`: row 0 lies at the origin, rows grow along
the grid's own y axis, columns along its x axis, and the origin pose is that of the outer corner of
cell (0, 0) in the map frame. The origin may be turned.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose

UNKNOWN = -1
FREE_MAX = 49
"""The highest occupancy that counts as free: Cartographer publishes free cells as 0 to 49."""

LEAST_RESOLUTION_M, LARGEST_RESOLUTION_M = 0.0005, 100.0
FARTHEST_ORIGIN_M = 1e8

Mask = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


@dataclass(frozen=True, slots=True, order=True)
class Cell:
    """One cell of a grid. Row 0 is at the grid's origin, not at the top of a picture."""

    row: int
    col: int


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class OccupancyGrid:
    """What the robot knows about which places are free; compared by identity.

    Attributes:
        cells: int8, shape (rows, cols): -1 unknown, 0..100 the probability of being occupied.
        resolution_m: The side of one cell.
        origin: The pose of the outer corner of cell (0, 0).
        stamp_s: Robot time at which the map was made.

    Raises:
        MapError: The array is not two-dimensional, holds other values, or resolution or origin are
            none that a map can have.
    """

    cells: NDArray[np.int8]
    resolution_m: float
    origin: Pose = field(default=Pose(0.0, 0.0, 0.0))
    stamp_s: float = 0.0

    def __post_init__(self) -> None:
        _check(np.asarray(self.cells), self.resolution_m, self.origin)
        if not _nobody_can_write(self.cells):
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
        """True where a robot can be: occupancy 0 to 49."""
        return (self.cells >= 0) & (self.cells <= FREE_MAX)

    @property
    def occupied(self) -> Mask:
        """True where something stands: occupancy 50 to 100."""
        return self.cells > FREE_MAX

    @property
    def unknown(self) -> Mask:
        """True where nothing has been seen yet."""
        return self.cells < 0

    def find_barred(self, start: Point) -> Mask | None:  # noqa: ARG002 - of the map itself, none
        """Finds the cells that nothing from a place may pass, however wrong its pose may be.

        A wall may stand where a robot seems to be because a pose or a map is off; what somebody
        has closed is another thing. None where nothing is.
        """
        return None

    def bounds(self) -> tuple[Point, Point]:
        """Gives the least and the greatest x and y of the map, as two points."""
        corners = [
            self.origin.transform(Point(x, y))
            for x in (0.0, self.width_m)
            for y in (0.0, self.height_m)
        ]
        xs, ys = [corner.x for corner in corners], [corner.y for corner in corners]
        return Point(min(xs), min(ys)), Point(max(xs), max(ys))

    def contains(self, cell: Cell) -> bool:
        """True when the cell lies inside the array."""
        return 0 <= cell.row < self.n_rows and 0 <= cell.col < self.n_cols

    def contains_cells(self, rows: IntArray, cols: IntArray) -> Mask:
        """True where the cell of that row and column lies inside the array; arrays of one shape."""
        return np.asarray((rows >= 0) & (rows < self.n_rows) & (cols >= 0) & (cols < self.n_cols))

    def crop(self, rows: slice, cols: slice) -> "OccupancyGrid":
        """Gives a part of the map, at its own place in the world; slices begin on the array."""
        corner = Pose(cols.start * self.resolution_m, rows.start * self.resolution_m)
        return OccupancyGrid(
            cells=self.cells[rows, cols],
            resolution_m=self.resolution_m,
            origin=self.origin @ corner,
            stamp_s=self.stamp_s,
        )

    def cell_at(self, point: Point) -> Cell:
        """Gives the cell a point falls in, which may lie outside the array (see `contains`)."""
        rows, cols = self.cells_at(np.array([[point.x, point.y]]))
        return Cell(int(rows[0]), int(cols[0]))

    def point_at(self, cell: Cell) -> Point:
        """Gives the centre of a cell."""
        xy = self.points_at(np.array([cell.row]), np.array([cell.col]))
        return Point(float(xy[0, 0]), float(xy[0, 1]))

    def cells_at(self, points: FloatArray) -> tuple[IntArray, IntArray]:
        """Gives rows and columns for points of shape (n, 2); they may lie outside the array."""
        in_grid = self.fractional_cells_at(points)
        floored = np.floor(in_grid).astype(np.intp)
        return floored[:, 0], floored[:, 1]

    def fractional_cells_at(self, points: FloatArray) -> FloatArray:
        """Gives (row, col) of shape (n, 2) as real numbers; a cell's centre is at +0.5, +0.5."""
        cos, sin = np.cos(self.origin.yaw_rad), np.sin(self.origin.yaw_rad)
        dx = points[:, 0] - self.origin.x
        dy = points[:, 1] - self.origin.y
        col = (cos * dx + sin * dy) / self.resolution_m
        row = (-sin * dx + cos * dy) / self.resolution_m
        return np.stack([row, col], axis=1)

    def points_at(self, rows: IntArray, cols: IntArray) -> FloatArray:
        """Gives the centres of cells in metres, shape (n, 2)."""
        cos, sin = np.cos(self.origin.yaw_rad), np.sin(self.origin.yaw_rad)
        along_x = (cols + 0.5) * self.resolution_m
        along_y = (rows + 0.5) * self.resolution_m
        x = self.origin.x + cos * along_x - sin * along_y
        y = self.origin.y + sin * along_x + cos * along_y
        return np.stack([x, y], axis=1)


def _nobody_can_write(cells: NDArray[np.integer[Any]]) -> bool:
    """True for what lies in a `bytes`, as a map does that came over a wire: no copy is needed."""
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
