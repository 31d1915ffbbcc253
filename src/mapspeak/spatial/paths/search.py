"""The way from one place to another: near to the shortest, with room to the walls."""

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.grid import IntArray, OccupancyGrid
from mapspeak.spatial.paths.lattice import (
    Lattice,
    build_coarse_lattice,
    build_fine_lattice,
    restrict,
    with_passable,
)
from mapspeak.spatial.paths.path import Path
from mapspeak.spatial.paths.start import find_seeds
from mapspeak.spatial.paths.trace import descend, pull_straight, straighten
from mapspeak.spatial.paths.wavefront import Costs, spread

__all__ = ["find_path", "find_path_near"]

COMFORT_M = 0.4
"""Walls cease to matter where the robot's edge has this much room."""
WALL_WEIGHT = 2.0
"""A metre of way that grazes a wall counts as this many metres more."""
CORRIDOR_M = 0.5
"""How far to both sides of a rough way the fine one is looked for."""


def find_path(grid: OccupancyGrid, start: Point, goal: Point, *, radius_m: float) -> Path | None:
    """Finds a way that keeps the robot off walls where that costs little; None where there is none.

    It never leads through unknown cells or nearer to an obstacle than the radius. Only the start
    may be in such a place: the first leg then hops to a cell near by where the robot may be.
    """
    lattice = build_coarse_lattice(grid, radius_m)
    weights = _wall_weights(lattice, radius_m)
    way = _find_way(lattice, weights, (start, goal), radius_m)
    if way is None:
        return None
    if lattice.factor == 1:
        return straighten(lattice, weights, way, (start, goal))
    return find_path_near(lattice, way, (start, goal), radius_m=radius_m)


def find_path_near(
    lattice: Lattice,
    rough_way: IntArray,
    ends: tuple[Point, Point],
    *,
    radius_m: float,
    weights: Costs | None = None,
) -> Path | None:
    """Finds the way over fine cells that stays near a rough way over lattice cells.

    Near also means near the straight legs that could replace the rough way, as its own directions
    are multiples of 45 degrees. Weights are those of the map's cells, where some cost more.
    """
    rough_costs = _wall_weights(lattice, radius_m)
    if weights is not None:
        rough_costs = rough_costs * lattice.coarsened(weights)
    corridor, window = _build_corridor(lattice, rough_way, rough_costs, radius_m)
    costs = _wall_weights(corridor, radius_m)
    if weights is not None:
        costs = costs * weights[window]
    way = _find_way(corridor, costs, ends, radius_m)
    return None if way is None else straighten(corridor, costs, way, ends)


def _find_way(
    lattice: Lattice, weights: Costs, ends: tuple[Point, Point], radius_m: float
) -> IntArray | None:
    goal = lattice.index_at(ends[1])
    seeds = find_seeds(lattice, ends[0], radius_m=radius_m)
    if goal is None or seeds is None:
        return None
    costs = spread(lattice.moves, weights, seeds, goals=np.array([goal]))
    return descend(lattice.moves, weights, costs, goal) if np.isfinite(costs[goal]) else None


def _wall_weights(lattice: Lattice, radius_m: float) -> Costs:
    """Gives what a metre costs in each cell: 1 in the open, more towards walls."""
    lacking = (radius_m + COMFORT_M - lattice.clearance_m) / COMFORT_M
    np.clip(lacking, 0.0, 1.0, out=lacking)
    return np.asarray(1 + WALL_WEIGHT * lacking**2, dtype=np.float32)


def _build_corridor(
    lattice: Lattice, way: IntArray, costs: Costs, radius_m: float
) -> tuple[Lattice, tuple[slice, slice]]:
    """Gives the fine lattice of the cells near a way, and the part of the map that it covers."""
    margin = int(np.ceil((CORRIDOR_M + radius_m + COMFORT_M) / lattice.cell_size_m))
    rows, cols = np.divmod(way, lattice.n_cols)
    top, left = max(int(rows.min()) - margin, 0), max(int(cols.min()) - margin, 0)
    shape = (int(rows.max()) + margin + 1 - top, int(cols.max()) + margin + 1 - left)
    places = np.stack([rows, cols], axis=1) + 0.5
    corners = pull_straight(lattice.is_open, costs, places)
    drawn = np.zeros(shape, dtype=np.uint8)
    for line in (places, corners):
        cells = np.floor(line[:, ::-1] - (left, top)).astype(np.int32)
        cv2.polylines(drawn, [cells], isClosed=False, color=1)
    side = 2 * int(np.ceil(CORRIDOR_M / lattice.cell_size_m)) + 1
    near = cv2.dilate(drawn, np.ones((side, side), dtype=np.uint8)) > 0
    near = near.repeat(lattice.factor, axis=0).repeat(lattice.factor, axis=1)
    top, left = top * lattice.factor, left * lattice.factor
    window = (slice(top, top + near.shape[0]), slice(left, left + near.shape[1]))
    crop = lattice.grid.crop(*window)
    n_rows, n_cols = crop.cells.shape
    fine = build_fine_lattice(crop, radius_m)
    # What was opened on the whole map, for a robot in a pocket, stays open on this part.
    opened = with_passable(fine, fine.passable | lattice.passable[window])
    return restrict(opened, near[:n_rows, :n_cols]), window
