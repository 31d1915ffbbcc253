"""The way from one place to another: near to the shortest, with room to the walls."""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.grid import FloatArray, IntArray, Mask, OccupancyGrid
from mapspeak.spatial.paths.lattice import (
    Lattice,
    build_coarse_lattice,
    build_fine_lattice,
    moves_within,
    restrict,
    with_passable,
)
from mapspeak.spatial.paths.wavefront import ROUNDING, Costs, Seeds, descend, spread
from mapspeak.spatial.visibility import mean_on_line

WALLS_REACH_M = 0.4
"""Walls cease to matter where the robot's edge has this much room."""
WALL_WEIGHT = 2.0
"""A metre of way that grazes a wall counts as this many metres more."""
CORRIDOR_M = 0.5
"""The fine path is searched this far to both sides of the rough one."""
HOP_MARGIN_M = 0.5
"""Reach of a hop beyond the robot's radius."""
HOP_CHOICE_M = 0.3
"""Reach of a hop beyond the nearest cell, if the way is shorter from there."""
HOP_COST = 3.0
"""A metre of hop is worth this much of a way: enough to get into passable cells soon."""
N_MORE_PULLS = 2
"""Number of further passes over a straightened path; more no longer shorten it."""


@dataclass(frozen=True, slots=True)
class Path:
    """A polyline from the first point to the last.

    Attributes:
        points: At least two places, in the order they are passed.
    """

    points: tuple[Point, ...]
    length_m: float

    @classmethod
    def through(cls, points: tuple[Point, ...]) -> "Path":
        """Return the path through the points, with its length measured."""
        return cls(points, sum(a.distance_to(b) for a, b in itertools.pairwise(points)))

    def sampled(self, step_m: float) -> tuple[Point, ...]:
        """Return its points, and as many between them that none is farther off the next."""
        found = [self.points[0]]
        for start, end in itertools.pairwise(self.points):
            n_steps = max(math.ceil(start.distance_to(end) / step_m), 1)
            for step in range(1, n_steps + 1):
                share = step / n_steps
                found.append(
                    Point(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))
                )
        return tuple(found)


def find_path(grid: OccupancyGrid, start: Point, goal: Point, *, radius_m: float) -> Path | None:
    """Find a path that keeps off walls where that costs little; None if there is none.

    It never leads through unknown cells or nearer to an obstacle than the radius. Only the start
    may be in such a place: the first leg then hops to a cell near by where the robot may be.
    """
    lattice = build_coarse_lattice(grid, radius_m)
    weights = _wall_weights(lattice, radius_m)
    way = find_way(lattice, weights, (start, goal), radius_m=radius_m)
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
    """Find the way over fine cells that stays near a rough way over lattice cells.

    Near also means near the straight legs that could replace the rough way, as its own directions
    are multiples of 45 degrees. Weights are those of the map's cells, where some cost more.
    """
    if rough_way.size < 2:
        return Path.through(ends)
    rough_costs = _wall_weights(lattice, radius_m)
    if weights is not None:
        rough_costs = rough_costs * lattice.coarsened(weights)
    corridor, window = _build_corridor(lattice, rough_way, rough_costs, radius_m)
    costs = _wall_weights(corridor, radius_m)
    if weights is not None:
        costs = costs * weights[window]
    way = find_way(corridor, costs, ends, radius_m=radius_m)
    return None if way is None else straighten(corridor, costs, way, ends)


def find_way(
    lattice: Lattice, weights: Costs, ends: tuple[Point, Point], *, radius_m: float
) -> IntArray | None:
    """Find the cheapest path over the cells of a lattice; None if there is none."""
    goal = lattice.index_at(ends[1])
    seeds = find_seeds(lattice, ends[0], radius_m=radius_m)
    if goal is None or seeds is None:
        return None
    costs = spread(lattice.moves, weights, seeds, goals=np.array([goal]))
    return descend(lattice.moves, weights, costs, goal) if np.isfinite(costs[goal]) else None


def _wall_weights(lattice: Lattice, radius_m: float) -> Costs:
    """Return the cost of a metre in each cell: 1 in the open, more towards walls."""
    lacking = (radius_m + WALLS_REACH_M - lattice.clearance_m) / WALLS_REACH_M
    np.clip(lacking, 0.0, 1.0, out=lacking)
    return np.asarray(1 + WALL_WEIGHT * lacking**2, dtype=np.float32)


def _build_corridor(
    lattice: Lattice, way: IntArray, costs: Costs, radius_m: float
) -> tuple[Lattice, tuple[slice, slice]]:
    """Return the fine lattice of the cells near a way, and the part of the map that it covers."""
    margin = int(np.ceil((CORRIDOR_M + radius_m + WALLS_REACH_M) / lattice.cell_size_m))
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
    # A gap opened on the whole map, for a robot in a pocket, stays open on this part.
    opened = with_passable(fine, fine.passable | lattice.passable[window])
    return restrict(opened, near[:n_rows, :n_cols]), window


def find_seeds(lattice: Lattice, start: Point, *, radius_m: float) -> Seeds | None:
    """Return the lattice cells where a path from the start begins; None if there are none."""
    index = lattice.index_at(start)
    if index is not None:
        return Seeds(np.array([index]), np.zeros(1, dtype=np.float32))
    if not lattice.grid.contains(lattice.grid.cell_at(start)):
        return None
    rows, cols, costs = _hops(lattice, start, reach_m=radius_m + HOP_MARGIN_M)
    indices = lattice.indices(rows, cols)
    is_open = lattice.is_open.ravel()[indices]
    if not is_open.any():
        return None
    indices, costs = indices[is_open], costs[is_open]
    # Each index once, with its least cost.
    order = np.lexsort((costs, indices))
    unique, first = np.unique(indices[order], return_index=True)
    return Seeds(unique, costs[order][first])


def _hops(lattice: Lattice, start: Point, *, reach_m: float) -> tuple[IntArray, IntArray, Costs]:
    """Return passable cells in reach of a hop, and the extra cost over the nearest.

    One cell of wall costs more than any hop around it: a robot that seems to stand in a wall
    leaves it on the near side, and no other hop goes through a wall. No hop crosses barred cells.
    """
    here, window = lattice.grid.cell_at(start), lattice.grid.window_around(start, reach_m)
    top, left = window[0].start, window[1].start
    occupied, passable = lattice.grid.occupied[window], lattice.passable[window]
    weights = np.where(occupied, HOP_COST * occupied.size, HOP_COST).astype(np.float32)
    at = (here.row - top) * occupied.shape[1] + here.col - left
    seed = Seeds(np.array([at]), np.zeros(1, dtype=np.float32))
    barred = lattice.grid.find_barred(start)
    may_pass = np.ones_like(occupied) if barred is None else ~barred[window]
    # A cell that an area merely touches may be the robot's own.
    may_pass.flat[at] = True
    spent = spread(moves_within(may_pass), weights, seed).reshape(occupied.shape)
    is_reached = passable & np.isfinite(spent)
    more = spent - spent[is_reached].min(initial=np.float32(np.finfo(np.float32).max))
    choice = HOP_COST * HOP_CHOICE_M / lattice.grid.resolution_m
    rows, cols = np.nonzero(is_reached & (more <= choice))
    return rows + top, cols + left, more[rows, cols] / np.float32(lattice.factor)


def straighten(lattice: Lattice, weights: Costs, way: IntArray, ends: tuple[Point, Point]) -> Path:
    """Return a path of few straight legs along a way over a fine lattice, between exact ends.

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
    """Return the corners of a path of straight legs that replaces a way of neighbouring cells.

    One pass finds corners on the way itself; the next ones find better corners on the legs.

    Args:
        mask: Where legs may lead.
        weights: Cost of moving by a cell's side in each cell.
        places: The way, in fractional cells.
    """
    walled = np.where(mask, weights, np.float32(np.inf))
    corners = places[_corner_indices(walled, weights, places)]
    for _ in range(N_MORE_PULLS):
        places = _resampled(corners)
        corners = places[_corner_indices(walled, weights, places)]
    return corners


def _corner_indices(walled: Costs, weights: Costs, places: FloatArray) -> list[int]:
    """Pick the places where the path turns: from each, the furthest that a leg may reach."""
    cells = np.floor(places).astype(np.intp)
    on_way = weights[cells[:, 0], cells[:, 1]].astype(np.float64)
    lengths = np.hypot(*np.diff(places, axis=0).T)
    # The cost of the way up to each place.
    spent = np.concatenate([[0.0], np.cumsum(lengths * (on_way[:-1] + on_way[1:]) / 2)])

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
    """Return the corners and places between them, about a cell apart."""
    legs = [
        start
        + np.linspace(0, 1, int(np.ceil(np.abs(end - start).max())) + 1)[:-1, None] * (end - start)
        for start, end in itertools.pairwise(corners)
    ]
    return np.concatenate([*legs, corners[-1:]])


def _furthest(is_leg: Callable[[int, int], bool], first: int, last: int) -> int:
    """Return the furthest place that a leg reaches: doubling the stride, then halving the gap."""
    good, stride = first + 1, 2
    while first + stride <= last and is_leg(first, first + stride):
        good, stride = first + stride, stride * 2
    bad = min(first + stride, last + 1)
    while bad - good > 1:
        middle = (good + bad) // 2
        good, bad = (middle, bad) if is_leg(first, middle) else (good, middle)
    return good
