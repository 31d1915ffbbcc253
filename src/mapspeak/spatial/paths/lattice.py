"""The cells that a robot's centre may be in, the moves between them, and the room around each.

Clearance runs from cell centre to cell centre: a LiDAR's hits fall anywhere in the cell that they
mark, so that cell's centre is the unbiased place of the surface. On large maps two by two cells
make one cell of the lattice. It has a move where the fine cells have one, so that nothing opens or
closes by looking coarser.
"""

import dataclasses
import functools
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point
from mapspeak.spatial.grid import IntArray, Mask, OccupancyGrid
from mapspeak.spatial.paths.wavefront import BITS, Costs, Moves

Clearance = NDArray[np.float32]


def clearance_m(grid: OccupancyGrid) -> Clearance:
    """Return for every cell the metres to the nearest occupied cell; infinite if there is none.

    Unknown cells are not obstacles here: a robot that looks into the unknown stands beside it.
    """
    return measure_away(grid.occupied) * np.float32(grid.resolution_m)


def known_clearance_m(grid: OccupancyGrid) -> Clearance:
    """Return for every cell the metres to the nearest cell that is not free.

    Unknown cells and everything outside the array count as obstacles.
    """
    padded = np.pad(~grid.free, 1, constant_values=True)
    away = np.ascontiguousarray(measure_away(padded)[1:-1, 1:-1])
    return away * np.float32(grid.resolution_m)


def measure_away(mask: Mask) -> Clearance:
    """Return for each cell how many cells away the nearest of a mask is; infinite for none."""
    if not mask.any():
        return np.full(mask.shape, np.inf, dtype=np.float32)
    source = np.logical_not(mask).view(np.uint8)
    transformed = cv2.distanceTransform(source, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    distance = np.asarray(transformed, dtype=np.float32)
    # Its last digit differs from run to run, and with the threads that OpenCV finds free. Each
    # distance is the root of a whole number, so that the right digit is known.
    np.square(distance, out=distance)
    np.rint(distance, out=distance)
    np.sqrt(distance, out=distance)
    return distance


Number = TypeVar("Number", np.bool_, np.float32)

LARGE_MAP = 500_000
"""Number of cells from which distances are computed on two by two cells."""
_EAST, _NORTH, _WEST, _SOUTH, _NORTH_EAST, _NORTH_WEST, _SOUTH_WEST, _SOUTH_EAST = BITS


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lattice:
    """A grid's passable cells, perhaps two by two, and the moves from each.

    Attributes:
        passable: True where the robot's centre may be; the shape of the map.
        factor: Number of the map's cells along the side of a lattice cell.
        moves: The directions in which each lattice cell may be left, as bits.
        is_open: True where a lattice cell can be entered.
        clearance_m: The largest within each lattice cell.
    """

    grid: OccupancyGrid
    passable: Mask
    factor: int
    moves: Moves
    is_open: Mask
    clearance_m: Clearance
    fine_clearance_m: Clearance

    @property
    def cell_size_m(self) -> float:
        """The side of one lattice cell."""
        return self.grid.resolution_m * self.factor

    @property
    def n_cols(self) -> int:
        """Lattice cells per row."""
        return int(self.moves.shape[1])

    def index_at(self, point: Point) -> int | None:
        """Return the flat index of the cell at a point; None if the robot cannot be there."""
        cell = self.grid.cell_at(point)
        if not (self.grid.contains(cell) and self.passable[cell.row, cell.col]):
            return None
        index = (cell.row // self.factor) * self.n_cols + cell.col // self.factor
        return index if self.is_open.flat[index] else None

    def coarsened(self, weights: Costs) -> Costs:
        """Return the largest of the weights of the map's cells within each lattice cell."""
        if self.factor == 1:
            return weights
        return functools.reduce(np.maximum, _quarters(weights))

    def refined(self, mask: Mask) -> Mask:
        """Return a mask of the lattice in the cells of the map."""
        fine = mask.repeat(self.factor, axis=0).repeat(self.factor, axis=1)
        n_rows, n_cols = self.passable.shape
        return fine[:n_rows, :n_cols]

    def indices(self, rows: IntArray, cols: IntArray) -> IntArray:
        """Return the flat indices of the lattice cells that hold cells of the map."""
        return (rows // self.factor) * self.n_cols + cols // self.factor


def build_fine_lattice(grid: OccupancyGrid, radius_m: float) -> Lattice:
    """Return the lattice with one cell for each cell of the map."""
    clearance = clearance_m(grid)
    return _fine(grid, clearance, grid.free & (clearance >= radius_m))


def build_coarse_lattice(grid: OccupancyGrid, radius_m: float) -> Lattice:
    """Return the lattice that suits the map's size: of two by two cells where it is large."""
    clearance = clearance_m(grid)
    build = _fine if grid.cells.size < LARGE_MAP else _halve
    return build(grid, clearance, grid.free & (clearance >= radius_m))


def build_narrow_lattice(lattice: Lattice, radius_m: float) -> Lattice:
    """Return the fine lattice of the same map for a robot of another radius."""
    passable = lattice.grid.free & (lattice.fine_clearance_m >= radius_m)
    return _fine(lattice.grid, lattice.fine_clearance_m, passable)


def with_passable(lattice: Lattice, passable: Mask) -> Lattice:
    """Return the lattice with other cells passable; a mask of the shape of the map."""
    build = _fine if lattice.factor == 1 else _halve
    return build(lattice.grid, lattice.fine_clearance_m, passable)


def restrict(lattice: Lattice, mask: Mask) -> Lattice:
    """Return a fine lattice that can be entered inside the mask only."""
    is_open = lattice.is_open & mask
    return dataclasses.replace(lattice, is_open=is_open, moves=moves_within(is_open))


def moves_within(mask: Mask) -> Moves:
    """Return the moves between neighbouring cells of the mask."""
    return _moves(mask[:, :-1] & mask[:, 1:], mask[:-1] & mask[1:])


def _fine(grid: OccupancyGrid, clearance: Clearance, passable: Mask) -> Lattice:
    return Lattice(
        grid=grid,
        passable=passable,
        factor=1,
        moves=moves_within(passable),
        is_open=passable,
        clearance_m=clearance,
        fine_clearance_m=clearance,
    )


def _halve(grid: OccupancyGrid, clearance: Clearance, passable: Mask) -> Lattice:
    low_left, low_right, high_left, high_right = _quarters(passable)
    # Open where there are passable ones among four cells, and they touch by their sides.
    rising = low_left & high_right & ~low_right & ~high_left
    falling = low_right & high_left & ~low_left & ~high_right
    is_open = (low_left | low_right | high_left | high_right) & ~(rising | falling)
    to_east = (low_right[:, :-1] & low_left[:, 1:]) | (high_right[:, :-1] & high_left[:, 1:])
    to_north = (high_left[:-1] & low_left[1:]) | (high_right[:-1] & low_right[1:])
    return Lattice(
        grid=grid,
        passable=passable,
        factor=2,
        moves=_moves(
            to_east & is_open[:, :-1] & is_open[:, 1:], to_north & is_open[:-1] & is_open[1:]
        ),
        is_open=is_open,
        clearance_m=functools.reduce(np.maximum, _quarters(clearance)),
        fine_clearance_m=clearance,
    )


def _quarters(values: NDArray[Number]) -> tuple[NDArray[Number], ...]:
    """Return the low left, low right, high left and high right cell of each two by two cells."""
    n_rows, n_cols = values.shape
    if n_rows % 2 or n_cols % 2:
        values = np.pad(values, ((0, n_rows % 2), (0, n_cols % 2)))
    return values[0::2, 0::2], values[0::2, 1::2], values[1::2, 0::2], values[1::2, 1::2]


def _moves(to_east: Mask, to_north: Mask) -> Moves:
    """Return all moves from those to the east and to the north.

    A diagonal move needs both ways around its corner, so that no wall's corner is cut.
    """
    moves = np.zeros((to_east.shape[0], to_north.shape[1]), dtype=np.uint8)
    moves[:, :-1] |= to_east * _EAST
    moves[:, 1:] |= to_east * _WEST
    moves[:-1] |= to_north * _NORTH
    moves[1:] |= to_north * _SOUTH
    is_square = to_east[:-1] & to_east[1:] & to_north[:, :-1] & to_north[:, 1:]
    moves[:-1, :-1] |= is_square * _NORTH_EAST
    moves[:-1, 1:] |= is_square * _NORTH_WEST
    moves[1:, 1:] |= is_square * _SOUTH_WEST
    moves[1:, :-1] |= is_square * _SOUTH_EAST
    return moves
