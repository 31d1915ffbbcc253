"""The ways between some places, and the shortest way past all of them."""

import functools
import math
from collections.abc import Sequence

import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.paths.distances import DistanceField
from mapspeak.spatial.paths.lattice import moves_within
from mapspeak.spatial.paths.wavefront import Seeds, spread

MOST_CELLS = 4_000_000
"""Limit of cells in memory for waves that spread together."""


def find_ways_between(distances: DistanceField, stops: Sequence[Point]) -> FloatArray:
    """Return the lengths of ways between reachable places, shape (n, n), in metres.

    They are estimates, on the coarsest cells at which walls, widened by the robot's radius on both
    sides, do not vanish.
    """
    grid = distances.grid
    factor = max(int(distances.radius_m / math.sqrt(2) / grid.resolution_m), 1)
    rows, cols = grid.cells_at(np.array([[stop.x, stop.y] for stop in stops]))
    # The way through the robot's own position joins any two of them, so no way is longer.
    from_robot_m = distances.distances_at(rows, cols)
    reach = math.ceil(float(from_robot_m.max()) / grid.resolution_m) + 1
    window = grid.window(rows, cols, margin=reach)
    coarse = _coarser(distances.reachable[window], factor)
    cells: IntArray = np.ravel_multi_index(
        ((rows - window[0].start) // factor, (cols - window[1].start) // factor), coarse.shape
    )
    at_once = max(MOST_CELLS // coarse.size, 1)
    ways = [
        _spread_together(coarse, cells[start : start + at_once], cells)
        for start in range(0, cells.size, at_once)
    ]
    ways_m = np.concatenate(ways) * factor * grid.resolution_m
    return np.minimum(ways_m, from_robot_m[:, None] + from_robot_m)


def _spread_together(distances: Mask, starts: IntArray, goals: IntArray) -> FloatArray:
    """Return the ways in cells from each start to all goals, shape (starts, goals).

    Each wave spreads on its own copy of the floor; the copies are stacked, as the number of steps
    determines the time.
    """
    n_copies = len(starts)
    moves = np.tile(moves_within(distances), (n_copies, 1))
    first = np.arange(n_copies) * distances.size
    seeds = Seeds(first + starts, np.zeros(n_copies, dtype=np.float32))
    ends = first[:, None] + goals
    costs = spread(moves, None, seeds, goals=ends.ravel())
    return np.asarray(costs[ends], dtype=np.float64)


def find_shortest_rounds(from_start_m: FloatArray, between_m: FloatArray) -> FloatArray:
    """Return for each stop the length of the shortest way that passes it first and then all others.

    Args:
        from_start_m: To each of n stops, shape (n,); for a dozen at most.
        between_m: From stop to stop, shape (n, n).
    """
    return np.asarray(from_start_m + _find_rests(between_m)[-1], dtype=np.float64)


def find_worthiest_first(
    from_start_m: FloatArray, between_m: FloatArray, worth_m: FloatArray, needed: Mask
) -> int | None:
    """Return the first stop of the way whose stops are worth most beyond its length.

    This is the prize-collecting travelling salesman (Balas, 1989) on a way that ends anywhere.

    Args:
        from_start_m: To each of n stops, shape (n,); for a dozen at most.
        between_m: From stop to stop, shape (n, n).
        worth_m: The metres that each stop is worth, shape (n,).
        needed: Stops that the way passes whatever they are worth, shape (n,).

    Returns:
        Its index; None where no stop is needed and no way is worth its length.
    """
    bits = 1 << np.arange(len(worth_m))
    ways_m = from_start_m + _find_rests(between_m)
    passes = (np.arange(len(ways_m))[:, None] & bits) != 0
    gains_m = passes @ worth_m - ways_m.min(axis=1)
    gains_m[0] = 0.0
    gains_m[~passes[:, needed].all(axis=1)] = -math.inf
    best = int(gains_m.argmax())
    return int(ways_m[best].argmin()) if best else None


def _find_rests(between_m: FloatArray) -> FloatArray:
    """Return the shortest ways that begin at a stop and pass all of a set.

    Exact, by dynamic programming over sets of stops (Held and Karp, 1962).

    Returns:
        Shape (2 ** n, n), by the set's bits and the first stop; infinite where that is not in it.
    """
    n_stops = len(between_m)
    bits = 1 << np.arange(n_stops)
    rest_m = np.full((1 << n_stops, n_stops), np.inf)
    rest_m[bits, np.arange(n_stops)] = 0.0
    visited = np.arange(1 << n_stops)
    n_visited = ((visited[:, None] & bits) != 0).sum(axis=1)
    for n_left in range(2, n_stops + 1):
        for first, bit in enumerate(bits):
            sets = visited[(n_visited == n_left) & (visited & bit != 0)]
            rest_m[sets, first] = (between_m[first] + rest_m[sets ^ bit]).min(axis=1)
    return rest_m


def _coarser(mask: Mask, factor: int) -> Mask:
    """Return the mask in cells of factor by factor; true where one of them was."""
    n_rows, n_cols = mask.shape
    padded = np.pad(mask, ((0, -n_rows % factor), (0, -n_cols % factor)))
    parts = (padded[down::factor, right::factor] for down, right in np.ndindex(factor, factor))
    return functools.reduce(np.logical_or, parts)
