"""How long the round through all frontiers becomes, by the one it begins with."""

import math

import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.paths.distances import DistanceField
from mapspeak.spatial.paths.lattice import moves_within
from mapspeak.spatial.paths.wavefront import Seeds, spread

__all__ = ["find_shortest_rounds", "find_ways_between"]


def find_ways_between(distances: DistanceField, stops: list[Point]) -> FloatArray:
    """Gives the lengths of ways between reachable places, shape (n, n), in metres.

    They are estimates: the floor is looked at in cells so coarse that walls, which keep the robot's
    radius on both sides, just do not vanish.
    """
    grid = distances.lattice.grid
    factor = max(int(distances.radius_m / math.sqrt(2) / grid.resolution_m), 1)
    floor = _coarser(distances.build_reachable_mask(), factor)
    moves = moves_within(floor)
    rows, cols = grid.cells_at(np.array([[stop.x, stop.y] for stop in stops]))
    cells: IntArray = (rows // factor) * floor.shape[1] + cols // factor
    start = np.zeros(1, dtype=np.float32)
    ways = [spread(moves, None, Seeds(cell[None], start))[cells] for cell in cells]
    return np.array(ways, dtype=np.float64) * factor * grid.resolution_m


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
