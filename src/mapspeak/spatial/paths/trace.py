"""From least costs to a way: steepest descent, then straight legs where they cost no more."""

import itertools
from collections.abc import Callable

import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.paths.lattice import Lattice
from mapspeak.spatial.paths.path import Path
from mapspeak.spatial.paths.sight import mean_on_line
from mapspeak.spatial.paths.wavefront import BITS, STEPS, Costs, Moves, offsets

__all__ = ["descend", "pull_straight", "straighten"]

N_MORE_PULLS = 2
"""How often a straightened path is pulled again; more no longer shortens it."""
ROUNDING = 1e-3
"""How much two costs of the same way may differ, in cells and as a share."""


def descend(moves: Moves, weights: Costs | None, costs: Costs, goal: int) -> IntArray:
    """Gives the flat indices of the cheapest way to the goal, from the seed where it begins.

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


def straighten(lattice: Lattice, weights: Costs, way: IntArray, ends: tuple[Point, Point]) -> Path:
    """Gives a path of few straight legs along a way over a fine lattice, between exact ends.

    A leg replaces cells of the way only where it stays passable and costs no more than they do,
    so the clearance that the search has paid for is kept.
    """
    start, goal = ends
    places = np.stack(np.divmod(way, lattice.n_cols), axis=1) + 0.5
    exact = lattice.grid.fractional_cells_at(np.array([[start.x, start.y], [goal.x, goal.y]]))
    begins_at_start = lattice.index_at(start) == way[0]
    if begins_at_start:
        places[0] = exact[0]
    places[-1] = exact[1]
    corners = pull_straight(lattice.passable, weights, places)
    inner = corners[1 if begins_at_start else 0 : -1] * lattice.grid.resolution_m
    points = (lattice.grid.origin.transform(Point(float(x), float(y))) for y, x in inner)
    return Path.through((start, *points, goal))


def pull_straight(mask: Mask, weights: Costs, places: FloatArray) -> FloatArray:
    """Gives the corners of a path of straight legs that replaces a way of neighbouring cells.

    One pass finds corners on the way itself; the next ones find better corners on the legs.

    Args:
        mask: Where legs may lead.
        weights: What a cell's side of way costs in each cell.
        places: The way, in fractional cells.
    """
    walled = np.where(mask, weights, np.float32(np.inf))
    corners = places[_corner_indices(walled, weights, places)]
    for _ in range(N_MORE_PULLS):
        places = _resampled(corners)
        corners = places[_corner_indices(walled, weights, places)]
    return corners


def _corner_indices(walled: Costs, weights: Costs, places: FloatArray) -> list[int]:
    """Picks the places where the path turns: from each, the furthest that a leg may reach."""
    spent = _spent_along(places, weights)

    def is_leg(first: int, last: int) -> bool:
        start, end = places[first], places[last]
        cost = float(np.hypot(*(end - start))) * mean_on_line(walled, start, end)
        replaced = float(spent[last] - spent[first])
        return cost <= replaced * (1 + ROUNDING) + ROUNDING

    corners = [0]
    while corners[-1] < len(places) - 1:
        corners.append(_furthest(is_leg, corners[-1], len(places) - 1))
    return corners


def _resampled(corners: FloatArray) -> FloatArray:
    """Gives the corners and places between them, about a cell apart."""
    legs = [
        start
        + np.linspace(0, 1, int(np.ceil(np.abs(end - start).max())) + 1)[:-1, None] * (end - start)
        for start, end in itertools.pairwise(corners)
    ]
    return np.concatenate([*legs, corners[-1:]])


def _spent_along(places: FloatArray, weights: Costs) -> FloatArray:
    """Gives what the way has cost up to each place."""
    cells = np.floor(places).astype(np.intp)
    on_way = weights[cells[:, 0], cells[:, 1]].astype(np.float64)
    lengths = np.hypot(*np.diff(places, axis=0).T)
    return np.concatenate([[0.0], np.cumsum(lengths * (on_way[:-1] + on_way[1:]) / 2)])


def _furthest(is_leg: Callable[[int, int], bool], first: int, last: int) -> int:
    """Gives the furthest place that a leg reaches: doubling the stride, then halving the gap."""
    good, stride = first + 1, 2
    while first + stride <= last and is_leg(first, first + stride):
        good, stride = first + stride, stride * 2
    bad = min(first + stride, last + 1)
    while bad - good > 1:
        middle = (good + bad) // 2
        good, bad = (middle, bad) if is_leg(first, middle) else (good, middle)
    return good
