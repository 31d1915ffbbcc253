"""The path distance from one place to every other, in one pass."""

import math
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.grid import FloatArray, IntArray, Mask, OccupancyGrid
from mapspeak.spatial.paths.lattice import (
    Clearance,
    Lattice,
    build_coarse_lattice,
    build_narrow_lattice,
    with_passable,
)
from mapspeak.spatial.paths.route import Path, find_path_near, find_seeds, find_way
from mapspeak.spatial.paths.wavefront import Costs, descend, spread


@dataclass(frozen=True, kw_only=True, eq=False)
class DistanceField:
    """Driving distances from one place to every other; compared by identity.

    Distances are the lengths of shortest paths over eight-connected cells, so up to 8 % longer than
    straight lines around the same corners.

    Attributes:
        lattice: The cells that the distances belong to.
        costs: The distances in lattice cells, flat; infinite where the robot cannot go.
        closed_lattice: The map's lattice, without a gap that was opened for this start.
    """

    start: Point
    radius_m: float
    lattice: Lattice
    costs: Costs
    leaves_pockets: bool = False
    closed_lattice: Lattice

    @property
    def grid(self) -> OccupancyGrid:
        """The map."""
        return self.lattice.grid

    @property
    def clearances_m(self) -> Clearance:
        """Distance from every cell of the map to the nearest obstacle."""
        return self.lattice.fine_clearance_m

    def distance_to(self, point: Point) -> float | None:
        """Return the metres to a point by path; None if the robot cannot get there."""
        index = self._find_reached(point)
        if index is None:
            return None
        by_cells = float(self.costs[index]) * self.lattice.cell_size_m
        return max(by_cells, self.start.distance_to(point))

    def _find_reached(self, point: Point) -> int | None:
        """Find the lattice cell at a point; None if the robot cannot get there."""
        index = self.lattice.index_at(point)
        return index if index is not None and math.isfinite(self.costs[index]) else None

    def _descend_to(self, point: Point) -> IntArray | None:
        goal = self._find_reached(point)
        return None if goal is None else descend(self.lattice.moves, None, self.costs, goal)

    def is_reachable(self, point: Point) -> bool:
        """Return True if the robot can drive there from the start."""
        return self.distance_to(point) is not None

    def path_to(self, point: Point) -> Path | None:
        """Find a way near the shortest one, off walls as far as its surroundings allow."""
        way = self._descend_to(point)
        if way is None:
            return None
        return find_path_near(self.lattice, way, (self.start, point), radius_m=self.radius_m)

    def cheapest_path_to(self, point: Point, weights: Costs) -> Path | None:
        """Find a way near the cheapest one where some floor costs more.

        Args:
            weights: Cost of a metre in each cell of the map, 1 or more.
        """
        coarse = self.lattice.coarsened(weights)
        ends = (self.start, point)
        way = find_way(self.lattice, coarse, ends, radius_m=self.radius_m)
        if way is None:
            return None
        return find_path_near(self.lattice, way, ends, radius_m=self.radius_m, weights=weights)

    def way_to(self, point: Point) -> tuple[Point, ...] | None:
        """Return the shortest way from cell to cell, good enough to draw; `path_to` is to drive."""
        way = self._descend_to(point)
        if way is None:
            return None
        rows, cols = np.divmod(way, self.lattice.n_cols)
        n = self.lattice.factor
        points = self.lattice.grid.points_at(rows * n + n // 2, cols * n + n // 2)
        return (*(Point(x, y) for x, y in points.tolist()), point)

    def from_elsewhere(self, start: Point) -> "DistanceField":
        """Return the distances from another place on the same map, for the same robot."""
        return _distances_over(
            self.closed_lattice, start, radius_m=self.radius_m, leaves_pockets=self.leaves_pockets
        )

    @cached_property
    def reachable(self) -> Mask:
        """True at the cells of the map that the robot can reach."""
        is_reached = np.isfinite(self.costs).reshape(self.lattice.moves.shape)
        return self.lattice.passable & self.lattice.refined(is_reached)

    def distances_at(self, rows: IntArray, cols: IntArray) -> FloatArray:
        """Return the metres by path to cells of the map; infinite where the robot cannot go."""
        costs = self.costs[self.lattice.indices(rows, cols)]
        metres = costs.astype(np.float64) * self.lattice.cell_size_m
        return np.where(self.lattice.passable[rows, cols], metres, np.inf)


def distances_from(
    grid: OccupancyGrid, start: Point, *, radius_m: float, leaves_pockets: bool = False
) -> DistanceField:
    """Return the path distance from the start to every place on the map.

    On large maps it works on cells of twice the size, with the same connections.

    Args:
        leaves_pockets: See `open_pocket`; not for a radius that must be kept to the millimetre.
    """
    lattice = build_coarse_lattice(grid, radius_m)
    return _distances_over(lattice, start, radius_m=radius_m, leaves_pockets=leaves_pockets)


def _distances_over(
    lattice: Lattice, start: Point, *, radius_m: float, leaves_pockets: bool
) -> DistanceField:
    closed, costs = lattice, _spread_from(lattice, start, radius_m)
    reached_m2 = np.count_nonzero(np.isfinite(costs)) * lattice.cell_size_m**2
    if leaves_pockets and reached_m2 < POCKET_M2:
        opened = open_pocket(lattice, costs, start, radius_m=radius_m)
        if opened is not lattice:
            lattice, costs = opened, _spread_from(opened, start, radius_m)
    costs.setflags(write=False)
    return DistanceField(
        start=start,
        radius_m=radius_m,
        lattice=lattice,
        costs=costs,
        leaves_pockets=leaves_pockets,
        closed_lattice=closed,
    )


def _spread_from(lattice: Lattice, start: Point, radius_m: float) -> Costs:
    seeds = find_seeds(lattice, start, radius_m=radius_m)
    if seeds is None:
        return np.full(lattice.moves.size, np.inf, dtype=np.float32)
    return spread(lattice.moves, None, seeds)


POCKET_M2 = 5.0
"""A robot confined to less floor than this may be in a pocket."""
FINE_RATIO = 0.2
"""Share of the radius; on larger cells, a gap that lacks one cell is surely too narrow."""


def open_pocket(lattice: Lattice, costs: Costs, start: Point, *, radius_m: float) -> Lattice:
    """Return the lattice with the narrowest gap opened that keeps a robot from most of the floor.

    Args:
        lattice: The map's, for the robot's radius.
        costs: On that lattice, from the start.

    Returns:
        The same lattice on a coarse map, or if no gap that lacks less than one cell on each side
        leads out.
    """
    cell_m = lattice.grid.resolution_m
    if cell_m > FINE_RATIO * radius_m:
        return lattice
    narrow = build_narrow_lattice(lattice, radius_m - cell_m)
    seeds = find_seeds(narrow, start, radius_m=radius_m)
    if seeds is None:
        return lattice
    ways = spread(narrow.moves, None, seeds)
    beyond = _find_largest(lattice, np.isfinite(ways).reshape(narrow.moves.shape), costs)
    if beyond is None:
        return lattice
    nearest = int(np.where(beyond.ravel(), ways, np.inf).argmin())
    gap = np.zeros(narrow.passable.size, dtype=np.uint8)
    gap[descend(narrow.moves, None, ways, nearest)] = 1
    # A way that goes round a corner needs the cells on both sides of its diagonal steps.
    wide = cv2.dilate(gap.reshape(narrow.passable.shape), np.ones((3, 3), np.uint8)) > 0
    return with_passable(lattice, lattice.passable | (wide & narrow.passable))


def _find_largest(lattice: Lattice, is_reached: Mask, costs: Costs) -> Mask | None:
    """Return the largest piece of passable floor that is reached through narrow gaps only."""
    here = np.isfinite(costs).reshape(lattice.moves.shape)
    left = (lattice.passable & is_reached & ~lattice.refined(here)).astype(np.uint8)
    n_pieces, pieces, stats, _ = cv2.connectedComponentsWithStats(left, connectivity=4)
    if n_pieces < 2:
        return None
    largest = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    n_here = np.count_nonzero(here) * lattice.factor**2
    is_more = stats[largest, cv2.CC_STAT_AREA] > n_here
    return np.asarray(pieces == largest) if is_more else None
