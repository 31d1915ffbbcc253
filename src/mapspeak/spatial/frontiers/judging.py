"""Whether the robot can look beyond a border with the unknown: from where, or why not."""

from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.frontiers.approach import Approach
from mapspeak.spatial.frontiers.edges import Border
from mapspeak.spatial.frontiers.frontier import RefusalReason, RefusedFrontier
from mapspeak.spatial.grid import Cell, IntArray, OccupancyGrid

__all__ = ["Lookout", "find_lookouts", "refuse"]

TARGET_EVERY_M = 1.0
"""Of a longer border, several places are looked at."""
MOST_TARGETS = 6
REACH_M = 0.5
"""A border further than this from where the robot can stand cannot be looked over from there."""


@dataclass(frozen=True, slots=True)
class Lookout:
    """A place to look beyond a border from.

    Attributes:
        stand: A cell that the robot can reach.
        target: The border's cell that it is nearest to.
    """

    stand: Cell
    target: Cell


def find_lookouts(approach: Approach, border: Border) -> list[Lookout] | RefusedFrontier:
    """Finds places to look beyond a border from, all along it, or says why there is none."""
    grid, radius_m = approach.grid, approach.radius_m
    away_m = approach.distances_m(border)
    if border.length_m < least_length_m(radius_m):
        return refuse(grid, border, RefusalReason.SPECKLE, f"speckle: {border.length_m:.2f} m")
    if not np.isfinite(away_m).any():
        return refuse(grid, border, RefusalReason.NO_WAY, "behind a wall: no way over known floor")
    near = np.flatnonzero(away_m <= radius_m + REACH_M)
    if not near.size:
        return _refuse_gap(approach, border, int(away_m.argmin()))
    n_targets = min(max(round(border.length_m / TARGET_EVERY_M), 1), MOST_TARGETS)
    targets = _spread_out(border.rows[near], border.cols[near], n_targets)
    return [Lookout(approach.nearest_reachable(target), target) for target in targets]


def refuse(
    grid: OccupancyGrid, border: Border, reason: RefusalReason, sentence: str
) -> RefusedFrontier:
    """Gives the refusal of a border."""
    return RefusedFrontier(
        anchor=_find_anchor(grid, border),
        length_m=border.length_m,
        reason=reason,
        sentence=sentence,
    )


def _find_anchor(grid: OccupancyGrid, border: Border) -> Point:
    """Gives the centre of the border's cell nearest to its middle."""
    middle = _middle(border.rows, border.cols)
    return grid.point_at(Cell(int(border.rows[middle]), int(border.cols[middle])))


def least_length_m(radius_m: float) -> float:
    """Gives the length from which a border is worth a look."""
    return radius_m


def _spread_out(rows: IntArray, cols: IntArray, n_cells: int) -> list[Cell]:
    """Picks cells far from each other: first the middle one, then always the furthest."""
    picked = [_middle(rows, cols)]
    gaps = np.full(rows.size, np.inf)
    while len(picked) < n_cells:
        last = picked[-1]
        gaps = np.minimum(gaps, np.hypot(rows - rows[last], cols - cols[last]))
        picked.append(int(gaps.argmax()))
    return [Cell(int(rows[index]), int(cols[index])) for index in picked]


def _middle(rows: IntArray, cols: IntArray) -> int:
    """Gives which of some cells is nearest to their mean."""
    return int(((rows - rows.mean()) ** 2 + (cols - cols.mean()) ** 2).argmin())


def _refuse_gap(approach: Approach, border: Border, nearest: int) -> RefusedFrontier:
    cell = Cell(int(border.rows[nearest]), int(border.cols[nearest]))
    sentence = (
        f"too narrow for the robot: {approach.gap_width_m(cell):.1f} m wide, "
        f"it needs {2 * approach.radius_m:.1f} m"
    )
    return refuse(approach.grid, border, RefusalReason.TOO_NARROW, sentence)
