"""From a border with the unknown to the nearest place where the robot can stand."""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from mapspeak.spatial.frontiers.edges import Border
from mapspeak.spatial.grid import Cell, FloatArray, IntArray, Mask, OccupancyGrid
from mapspeak.spatial.paths.clearance import clearance_m
from mapspeak.spatial.paths.distances import DistanceField
from mapspeak.spatial.paths.lattice import moves_within
from mapspeak.spatial.paths.trace import descend
from mapspeak.spatial.paths.wavefront import Costs, Moves, Seeds, spread

__all__ = ["Approach", "build_approach"]

DETOUR_M = 1.5
"""How far around the shortest way a wider one is looked for."""
MOST_WEIGHT = 50.0
"""What the narrowest cell costs a way that looks for width."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Approach:
    """How every free cell is joined, over the floor, to the floor that the robot can reach.

    The robot itself may be too wide for the floor in between; a look over it is what counts.

    Attributes:
        grid: The map.
        radius_m: Of the robot.
        reachable: Where it can get to.
        moves: Between free cells.
        costs: The length in cells to each, flat; infinite where no floor leads.
    """

    grid: OccupancyGrid
    radius_m: float
    reachable: Mask
    moves: Moves
    costs: Costs

    def distances_m(self, border: Border) -> FloatArray:
        """Gives the metres from the reachable floor to each cell of a border."""
        costs = self.costs[border.rows * self.grid.n_cols + border.cols]
        return np.asarray(costs * self.grid.resolution_m, dtype=np.float64)

    def nearest_reachable(self, cell: Cell) -> Cell:
        """Gives the reachable cell that a free cell is joined to."""
        rows, cols = self._way_to(cell)
        return Cell(int(rows[0]), int(cols[0]))

    def gap_width_m(self, cell: Cell) -> float:
        """Gives how wide the widest way to a free cell is, at its narrowest."""
        window = self._window(*self._way_to(cell))
        near = OccupancyGrid(cells=self.grid.cells[window], resolution_m=self.grid.resolution_m)
        clearances_m = clearance_m(near)
        lacking = self.radius_m / np.maximum(clearances_m, self.grid.resolution_m)
        weights = np.clip(lacking**3, 1.0, MOST_WEIGHT).astype(np.float32)
        moves = moves_within(near.free)
        costs = spread(moves, weights, _seeds(self.reachable[window]))
        goal = (cell.row - window[0].start) * near.n_cols + cell.col - window[1].start
        way = descend(moves, weights, costs, goal)
        return 2 * float(clearances_m.ravel()[way].min())

    def _way_to(self, cell: Cell) -> tuple[IntArray, IntArray]:
        """Gives the cells from the reachable floor to a free cell, both ends included."""
        way = descend(self.moves, None, self.costs, cell.row * self.grid.n_cols + cell.col)
        rows, cols = np.divmod(way, self.grid.n_cols)
        return rows, cols

    def _window(self, rows: IntArray, cols: IntArray) -> tuple[slice, slice]:
        """Gives the part of the map around some cells."""
        margin = math.ceil(DETOUR_M / self.grid.resolution_m)
        return (
            slice(max(int(rows.min()) - margin, 0), int(rows.max()) + margin + 1),
            slice(max(int(cols.min()) - margin, 0), int(cols.max()) + margin + 1),
        )


def build_approach(distances: DistanceField) -> Approach:
    """Builds the approach to all free cells of the map that the distances belong to."""
    grid = distances.lattice.grid
    reachable = distances.build_reachable_mask()
    moves = moves_within(grid.free)
    beyond = (grid.free & ~reachable).view(np.uint8)
    rim = reachable & (cv2.dilate(beyond, np.ones((3, 3), dtype=np.uint8)) > 0)
    costs = spread(moves, None, _seeds(rim))
    costs[reachable.ravel()] = 0.0
    return Approach(
        grid=grid,
        radius_m=distances.radius_m,
        reachable=reachable,
        moves=moves,
        costs=costs,
    )


def _seeds(mask: Mask) -> Seeds:
    cells = np.flatnonzero(mask)
    return Seeds(cells, np.zeros(cells.size, dtype=np.float32))
