"""From where the robot can look beyond a border with the unknown."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapspeak.spatial.frontiers.edges import Border, find_middle
from mapspeak.spatial.frontiers.terrain import Terrain
from mapspeak.spatial.grid import Cell, IntArray
from mapspeak.spatial.visibility import cast_rays

__all__ = ["Lookout", "find_lookouts"]

TARGET_EVERY_M = 1.0
"""Of a longer border, several places are looked at."""
MOST_TARGETS = 6
REACH_M = 0.5
"""A border further than this from where the robot can stand cannot be looked over from there."""
COMFORT_M = 0.1
"""How much more than its radius the robot should have around it where it is sent to look.

A navigator plans on its own map with its own rounding and padding; what is just wide enough here
it refuses. Two cells of a usual map make up for both.
"""
_ANGLES_RAD = np.linspace(0.0, math.tau, 32, endpoint=False)
AT_ONCE = 256
"""Targets whose surroundings are held in memory together."""


@dataclass(frozen=True, slots=True)
class Lookout:
    """A place to look beyond a border from.

    Attributes:
        stand: A cell that the robot can reach.
        target: The border's cell that it was chosen for.
    """

    stand: Cell
    target: Cell


def find_lookouts(terrain: Terrain, borders: Sequence[Border]) -> list[list[Lookout]]:
    """Finds for each border places to look beyond it from, all along it; none where none is near.

    A place is in sight of the border. It has room for the robot and some more where there is such
    a place in reach, else it is the one with most room; of equals it is the nearest one.
    """
    if not borders:
        return []
    targets = [_choose_targets(terrain, border) for border in borders]
    rows = np.concatenate([each[0] for each in targets])
    cols = np.concatenate([each[1] for each in targets])
    stands = _find_stands(terrain, rows, cols)
    ends = np.cumsum([each[0].size for each in targets])
    return [
        _lookouts(terrain, stands[own], rows[own], cols[own])
        for own in (slice(*pair) for pair in itertools.pairwise([0, *ends.tolist()]))
    ]


def _lookouts(terrain: Terrain, stands: IntArray, rows: IntArray, cols: IntArray) -> list[Lookout]:
    """Gives each stand of a border once, where there is any."""
    targets = {
        stand: Cell(row, col)
        for stand, row, col in zip(stands.tolist(), rows.tolist(), cols.tolist(), strict=True)
        if stand >= 0
    }
    n_cols = terrain.grid.n_cols
    return [Lookout(Cell(*divmod(stand, n_cols)), target) for stand, target in targets.items()]


def _choose_targets(terrain: Terrain, border: Border) -> tuple[IntArray, IntArray]:
    """Picks cells of a border, where the robot can go right to it if there is such a piece."""
    near = np.flatnonzero(terrain.reachable[border.rows, border.cols])
    every_m = TARGET_EVERY_M if near.size else REACH_M
    rows, cols = (border.rows[near], border.cols[near]) if near.size else (border.rows, border.cols)
    n_targets = min(max(round(border.length_m / every_m), 1), MOST_TARGETS)
    picked = _spread_out(rows, cols, n_targets)
    return rows[picked], cols[picked]


def _spread_out(rows: IntArray, cols: IntArray, n_cells: int) -> list[int]:
    """Picks cells far from each other: first the middle one, then always the furthest."""
    picked = [find_middle(rows, cols)]
    gaps = np.full(rows.size if n_cells > 1 else 0, np.inf)
    while len(picked) < n_cells:
        last = picked[-1]
        gaps = np.minimum(gaps, np.hypot(rows - rows[last], cols - cols[last]))
        picked.append(int(gaps.argmax()))
    return picked


def _find_stands(terrain: Terrain, rows: IntArray, cols: IntArray) -> IntArray:
    """Gives for each target the flat index of the best cell to stand in; -1 where there is none."""
    comfort_m = terrain.radius_m + COMFORT_M
    stands = rows * terrain.grid.n_cols + cols
    is_good = terrain.reachable[rows, cols] & (terrain.clearances_m[rows, cols] >= comfort_m)
    others = np.flatnonzero(~is_good)
    for start in range(0, others.size, AT_ONCE):
        some = others[start : start + AT_ONCE]
        stands[some] = _find_stands_off(terrain, rows[some], cols[some])
    return stands


def _find_stands_off(terrain: Terrain, rows: IntArray, cols: IntArray) -> IntArray:
    """Gives the same for targets that the robot cannot stand on well, by looking around them."""
    reach_m = terrain.radius_m + REACH_M
    n_steps = math.ceil(reach_m / terrain.grid.resolution_m)
    steps = np.arange(n_steps + 1, dtype=np.float64)
    middles = np.stack([rows, cols], axis=1) + 0.5
    rays = cast_rays(terrain.free.shape, middles, angles_rad=_ANGLES_RAD, steps=steps)
    clearances_m = terrain.clearances_m.ravel()[rays.cells]
    is_reachable = terrain.reachable.ravel()[rays.cells] & rays.is_inside
    # Beside an obstacle a ray might slip between two cells of wall that touch at a corner.
    is_wide = clearances_m > terrain.grid.resolution_m
    is_passed = terrain.free.ravel()[rays.cells] & rays.is_inside & (is_wide | is_reachable)
    is_passed[:, :, 0] = True
    is_seen = np.logical_and.accumulate(is_passed, axis=2)
    room_m = np.minimum(clearances_m, terrain.radius_m + COMFORT_M)
    # A step further away must be worth more room than the distance's whole weight.
    worth = np.where(is_seen & is_reachable, room_m - steps * 1e-6, -np.inf)
    flat = worth.reshape(rows.size, -1)
    best = flat.argmax(axis=1)
    each = np.arange(rows.size)
    found = rays.cells.reshape(rows.size, -1)[each, best]
    return np.where(np.isfinite(flat[each, best]), found, -1)
