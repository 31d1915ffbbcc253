"""Least costs over a graph of cells, a whole ring of cells per step, and the way back from them.

Every move costs at least one, so all cells whose cost lies between k and k + 1 are settled once
the rings before are, and can be handled together: Dijkstra's algorithm with buckets as wide as the
shortest edge (Denardo and Fox, "Shortest-route methods: 1. Reaching, pruning, and buckets", 1979).
A ring is a few numpy calls, which is what makes this fast without compiled code of our own.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import IntArray

Costs = NDArray[np.float32]
Moves = NDArray[np.uint8]

BITS = (1 << np.arange(8)).astype(np.uint8)
"""The bit of each direction in a cell's moves: east, north, west, south, then the diagonals
north-east, north-west, south-west, south-east. North is the next row."""
STEPS = np.array([1.0] * 4 + [math.sqrt(2.0)] * 4, dtype=np.float32)
"""The length of a move in each direction, in cells."""
ROUNDING = 1e-3
"""Tolerance between two costs of the same way, in cells and as a share."""


@dataclass(frozen=True, slots=True, eq=False)
class Seeds:
    """Start cells of a wavefront.

    Attributes:
        cells: Flat indices, each once.
        costs: Cost already spent at each.
    """

    cells: IntArray
    costs: Costs


def offsets(n_cols: int) -> IntArray:
    """Return the change of the flat index for each direction."""
    east, north = 1, n_cols
    straight = [east, north, -east, -north]
    diagonal = [north + east, north - east, -north - east, -north + east]
    return np.array(straight + diagonal, dtype=np.intp)


def spread(
    moves: Moves, weights: Costs | None, seeds: Seeds, *, goals: IntArray | None = None
) -> Costs:
    """Return the least cost to every cell, flat; infinite where the wave does not arrive.

    Args:
        moves: Shape (rows, cols); the directions in which each cell may be left. No move may leave
            the array, so the outermost cells have none outwards.
        weights: Cost of a unit of way in each cell, at least 1; a move costs its length times the
            mean of both ends. None if all cells cost 1.
        goals: Stop once all these cells are settled.
    """
    front = _Front(moves, None if weights is None else weights.ravel(), seeds)
    while front.waiting.size:
        ring, limit = front.take_ring()
        if goals is not None and (front.costs[goals] < limit).all():
            break
        front.advance(ring)
    return front.costs


def descend(moves: Moves, weights: Costs | None, costs: Costs, goal: int) -> IntArray:
    """Return the flat indices of the cheapest way to the goal, from the seed where it begins.

    The arguments are those of `spread` and the costs that it gave.
    """
    directions = offsets(moves.shape[1])
    flat_moves = moves.ravel()
    flat_weights = None if weights is None else weights.ravel()
    way = [goal]
    while True:
        cell = way[-1]
        is_open = (flat_moves[cell] & BITS) != 0
        neighbours = cell + directions[is_open]
        if not neighbours.size:
            break
        lengths = STEPS[is_open]
        if flat_weights is not None:
            lengths = lengths * ((flat_weights[neighbours] + flat_weights[cell]) * np.float32(0.5))
        totals = costs[neighbours] + lengths
        best = int(totals.argmin())
        if totals[best] > costs[cell] + ROUNDING:
            break
        way.append(int(neighbours[best]))
    return np.array(way[::-1], dtype=np.intp)


class _Front:
    """State of the wave: costs so far, and the cells reached that are not settled, each once."""

    def __init__(self, moves: Moves, weights: Costs | None, seeds: Seeds) -> None:
        n_cells = moves.size
        self.costs: Costs = np.full(n_cells, np.inf, dtype=np.float32)
        self.costs[seeds.cells] = seeds.costs
        self.waiting = seeds.cells
        self._moves = moves.ravel()
        self._weights = weights
        self._offsets = offsets(moves.shape[1])[:, None]
        self._last_writer = np.zeros(n_cells, dtype=np.int32)

    def take_ring(self) -> tuple[IntArray, int]:
        """Take the cells of the next bucket that holds any; return them and its upper limit."""
        costs = self.costs.take(self.waiting)
        limit = int(costs.min()) + 1
        is_now = costs < limit
        ring, self.waiting = self.waiting[is_now], self.waiting[~is_now]
        return ring, limit

    def advance(self, ring: IntArray) -> None:
        """Move from the ring's cells to their neighbours where that is cheaper than so far."""
        costs = (self.costs.take(ring) + self._move_costs(ring)).ravel()
        targets = (ring + self._offsets).ravel()
        is_better = ((self._moves.take(ring) & BITS[:, None]) != 0).ravel()
        is_better &= costs < self.costs.take(targets, mode="clip")
        better = np.flatnonzero(is_better)
        reached = targets.take(better)
        new = reached[self.costs.take(reached) == np.inf]
        np.minimum.at(self.costs, reached, costs.take(better))
        # Each once: the last writer wins.
        order = np.arange(new.size, dtype=np.int32)
        self._last_writer[new] = order
        self.waiting = np.concatenate([self.waiting, new[self._last_writer.take(new) == order]])

    def _move_costs(self, ring: IntArray) -> Costs:
        if self._weights is None:
            return STEPS[:, None]
        ends = self._weights.take(ring + self._offsets, mode="clip")
        means = (self._weights.take(ring) + ends) * np.float32(0.5)
        return np.asarray(STEPS[:, None] * means, dtype=np.float32)
