"""Where a search begins, also when the robot seems to stand where it cannot be.

A robot that has just started knows nothing of the floor below it, and one that has parked at a
wall is nearer to it than a planner likes. Both hop to passable cells near by first.
"""

import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.grid import IntArray
from mapspeak.spatial.paths.lattice import Lattice, moves_within
from mapspeak.spatial.paths.wavefront import Costs, Seeds, spread

__all__ = ["find_seeds"]

HOP_MARGIN_M = 0.5
"""How much further than its own radius a robot may hop."""
HOP_CHOICE_M = 0.3
"""How much further than the nearest cell the hop may go, where the way is shorter from there."""
HOP_COST = 3.0
"""A metre of hop is worth this much of a way: enough to get into passable cells soon."""


def find_seeds(lattice: Lattice, start: Point, *, radius_m: float) -> Seeds | None:
    """Gives the lattice cells where a way from the start begins; None where there are none."""
    index = lattice.index_at(start)
    if index is not None:
        return Seeds(np.array([index]), np.zeros(1, dtype=np.float32))
    if not lattice.grid.contains(lattice.grid.cell_at(start)):
        return None
    rows, cols, costs = _hops(lattice, start, reach_m=radius_m + HOP_MARGIN_M)
    indices = lattice.indices(rows, cols)
    is_open = lattice.is_open.ravel()[indices]
    return _cheapest(indices[is_open], costs[is_open]) if is_open.any() else None


def _hops(lattice: Lattice, start: Point, *, reach_m: float) -> tuple[IntArray, IntArray, Costs]:
    """Gives passable cells in reach of a hop, and what it costs more than that to the nearest.

    One cell of wall costs more than any hop around it: a robot that seems to stand in a wall
    leaves it on the near side, and no other hop goes through a wall. None at all goes over what
    is barred.
    """
    here = lattice.grid.cell_at(start)
    reach = int(np.ceil(reach_m / lattice.grid.resolution_m))
    top, left = max(here.row - reach, 0), max(here.col - reach, 0)
    window = (slice(top, here.row + reach + 1), slice(left, here.col + reach + 1))
    occupied, passable = lattice.grid.occupied[window], lattice.passable[window]
    weights = np.where(occupied, HOP_COST * occupied.size, HOP_COST).astype(np.float32)
    at = (here.row - top) * occupied.shape[1] + here.col - left
    seed = Seeds(np.array([at]), np.zeros(1, dtype=np.float32))
    barred = lattice.grid.find_barred(start)
    may_pass = np.ones_like(occupied) if barred is None else ~barred[window]
    # A cell that an area only touches may be the robot's own.
    may_pass.flat[at] = True
    spent = spread(moves_within(may_pass), weights, seed).reshape(occupied.shape)
    is_reached = passable & np.isfinite(spent)
    more = spent - spent[is_reached].min(initial=np.float32(np.finfo(np.float32).max))
    choice = HOP_COST * HOP_CHOICE_M / lattice.grid.resolution_m
    rows, cols = np.nonzero(is_reached & (more <= choice))
    return rows + top, cols + left, more[rows, cols] / np.float32(lattice.factor)


def _cheapest(indices: IntArray, costs: Costs) -> Seeds:
    """Gives each index once, with its least cost."""
    order = np.lexsort((costs, indices))
    unique, first = np.unique(indices[order], return_index=True)
    return Seeds(unique, costs[order][first])
