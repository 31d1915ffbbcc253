"""How long the round through all frontiers becomes, by the one it begins with."""

import math

import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.frontiers.terrain import Terrain
from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.paths.lattice import moves_within
from mapspeak.spatial.paths.wavefront import Seeds, spread

__all__ = ["find_shortest_rounds", "find_ways_between"]

MOST_CELLS = 4_000_000
"""So many cells are held in memory for waves that spread together."""


def find_ways_between(terrain: Terrain, stops: list[Point]) -> FloatArray:
    """Gives the lengths of ways between reachable places, shape (n, n), in metres.

    They are estimates: the floor is looked at in cells so coarse that walls, which keep the robot's
    radius on both sides, just do not vanish.
    """
    grid = terrain.grid
    factor = max(int(terrain.radius_m / math.sqrt(2) / grid.resolution_m), 1)
    rows, cols = grid.cells_at(np.array([[stop.x, stop.y] for stop in stops]))
    window = _window(terrain, rows, cols)
    floor = _coarser(terrain.reachable[window], factor)
    cells: IntArray = np.ravel_multi_index(
        ((rows - window[0].start) // factor, (cols - window[1].start) // factor), floor.shape
    )
    at_once = max(MOST_CELLS // floor.size, 1)
    ways = [
        _spread_together(floor, cells[start : start + at_once], cells)
        for start in range(0, cells.size, at_once)
    ]
    return np.concatenate(ways) * factor * grid.resolution_m


def _window(terrain: Terrain, rows: IntArray, cols: IntArray) -> tuple[slice, slice]:
    """Gives the part of the map that shortest ways between some cells cannot leave.

    By way of the robot's own place there is a way between any two of them.
    """
    from_robot_m = terrain.distances.distances_at(rows, cols)
    reach = math.ceil(float(from_robot_m.max()) / terrain.grid.resolution_m) + 1
    return terrain.grid.window(rows, cols, margin=reach)


def _spread_together(floor: Mask, starts: IntArray, goals: IntArray) -> FloatArray:
    """Gives the ways in cells from each start to all goals, shape (starts, goals).

    Each wave has a copy of the floor of its own, one above the other, as it is the number of steps
    that takes the time.
    """
    n_copies = len(starts)
    moves = np.tile(moves_within(floor), (n_copies, 1))
    first = np.arange(n_copies) * floor.size
    seeds = Seeds(first + starts, np.zeros(n_copies, dtype=np.float32))
    ends = first[:, None] + goals
    costs = spread(moves, None, seeds, goals=ends.ravel())
    return np.asarray(costs[ends], dtype=np.float64)


def find_shortest_rounds(from_start_m: FloatArray, between_m: FloatArray) -> FloatArray:
    """Gives for each stop the length of the shortest way that passes it first and then all others.

    Exact, by dynamic programming over sets of stops (Held and Karp, 1962); for a dozen at most.

    Args:
        from_start_m: To each of n stops, shape (n,).
        between_m: From stop to stop, shape (n, n).
    """
    n_stops = len(from_start_m)
    bits = 1 << np.arange(n_stops)
    rest_m = np.full((1 << n_stops, n_stops), np.inf)
    rest_m[bits, np.arange(n_stops)] = 0.0
    for visited in range(1, 1 << n_stops):
        for first in np.flatnonzero(visited & bits):
            others = visited & ~bits[first]
            if others:
                rest_m[visited, first] = (between_m[first] + rest_m[others]).min()
    return np.asarray(from_start_m + rest_m[-1], dtype=np.float64)


def _coarser(mask: Mask, factor: int) -> Mask:
    """Gives the mask in cells of factor by factor; true where one of them was."""
    n_rows, n_cols = mask.shape
    padded = np.pad(mask, ((0, -n_rows % factor), (0, -n_cols % factor)))
    blocks = padded.reshape(padded.shape[0] // factor, factor, -1, factor)
    return np.asarray(blocks.any(axis=(1, 3)), dtype=np.bool_)
