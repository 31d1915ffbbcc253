"""From a border with the unknown to the nearest place where the robot can stand."""

from dataclasses import dataclass

import cv2
import numpy as np

from mapspeak.spatial.frontiers.edges import Border
from mapspeak.spatial.grid import Cell, FloatArray, IntArray
from mapspeak.spatial.paths.distances import DistanceField
from mapspeak.spatial.paths.lattice import Lattice, build_fine_lattice
from mapspeak.spatial.paths.trace import descend
from mapspeak.spatial.paths.wavefront import Costs, Seeds, spread

__all__ = ["Approach", "build_approach", "build_wide_approach"]

NARROWEST_WEIGHT = 1000.0
"""What a cell beside a wall costs a way that looks for width; enough to go round a room."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Approach:
    """How every free cell is joined, over the floor, to the floor that the robot can reach.

    The robot itself may be too wide for the floor in between; a look over it is what counts.

    Attributes:
        floor: All free cells and the moves between them.
        weights: What a cell of way costs.
        costs: To each cell, flat; infinite where no floor leads.
    """

    floor: Lattice
    weights: Costs
    costs: Costs

    def costs_of(self, border: Border) -> FloatArray:
        """Gives the costs to each cell of a border."""
        flat = border.rows * self.floor.n_cols + border.cols
        return np.asarray(self.costs[flat], dtype=np.float64)

    def nearest_reachable(self, cell: Cell) -> Cell:
        """Gives the reachable cell that a free cell is joined to."""
        rows, cols = self.way_to(cell)
        return Cell(int(rows[0]), int(cols[0]))

    def way_to(self, cell: Cell) -> tuple[IntArray, IntArray]:
        """Gives the cells from the reachable floor to a free cell, both ends included."""
        goal = cell.row * self.floor.n_cols + cell.col
        way = descend(self.floor, self.weights, self.costs, goal)
        rows, cols = np.divmod(way, self.floor.n_cols)
        return rows, cols


def build_approach(distances: DistanceField) -> Approach:
    """Builds the shortest approach to all free cells; its costs are lengths in cells."""
    floor = build_fine_lattice(distances.lattice.grid, 0.0)
    return _approach(floor, distances, np.ones(floor.moves.shape, dtype=np.float32))


def build_wide_approach(distances: DistanceField) -> Approach:
    """Builds the approach that makes detours for width, as to say how wide the widest way is."""
    floor = build_fine_lattice(distances.lattice.grid, 0.0)
    lacking = distances.radius_m / np.maximum(floor.clearance_m, floor.grid.resolution_m)
    weights = np.clip(lacking, 1.0, None) ** 4
    return _approach(floor, distances, np.minimum(weights, NARROWEST_WEIGHT).astype(np.float32))


def _approach(floor: Lattice, distances: DistanceField, weights: Costs) -> Approach:
    reachable = distances.build_reachable_mask()
    beyond = (floor.passable & ~reachable).view(np.uint8)
    rim = reachable & (cv2.dilate(beyond, np.ones((3, 3), dtype=np.uint8)) > 0)
    cells = np.flatnonzero(rim)
    costs = np.full(reachable.size, np.inf, dtype=np.float32)
    if cells.size:
        seeds = Seeds(cells, np.zeros(cells.size, dtype=np.float32))
        costs = spread(floor.moves, weights, seeds)
    costs[reachable.ravel()] = 0.0
    return Approach(floor=floor, weights=weights, costs=costs)
