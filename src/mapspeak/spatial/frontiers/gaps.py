"""Gaps that the map counts as just wide enough, and that proved too narrow for the robot.

A navigation keeps its own padding round the robot, which the map does not tell. A drive that found
no way shows it: the narrowest place of the way that the map has is too narrow, and so is everything
behind it, until the map shows the gap wider.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point
from mapspeak.spatial.grid import Cell, Mask
from mapspeak.spatial.paths.distances import DistanceField

STEP_M = 0.05
AROUND_M = 0.5
"""A gap may shift by this much while its map is corrected."""
STEP_CELLS = 0.5
"""Clearance is compared in steps of this many cells: a gap a cell or two wider is tried again."""
MOST_STEPS = 2
"""A way with more clearance than these steps beyond the radius was blocked by something else."""

Labels = NDArray[np.int32]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProvedGap:
    """A gap that the robot did not pass.

    Attributes:
        before: Where the robot was when no way led it through.
        width_m: By the map, at its narrowest.
        least_clearance_m: With so much it is worth another try.
    """

    point: Point
    before: Point
    width_m: float
    least_clearance_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Tried:
    """What the robot's drives to frontiers have shown.

    Attributes:
        looked_from: Where it has arrived: what stays unknown from there cannot be seen.
        failed_at: Where a drive failed, while the map there is as it was.
    """

    looked_from: tuple[Point, ...] = ()
    failed_at: tuple[Point, ...] = ()
    gaps: tuple[ProvedGap, ...] = ()


NOTHING_TRIED = Tried()


def find_proved_gap(distances: DistanceField, goal: Point) -> ProvedGap | None:
    """Find the gap that kept the robot from a goal; None where a way is roomy, or there is none.

    Args:
        distances: From where the robot gave up.
    """
    path = distances.path_to(goal)
    if path is None:
        return None
    points = path.sampled(min(STEP_M, distances.grid.resolution_m))
    for number in range(1, MOST_STEPS + 1):
        step_m = number * STEP_CELLS * distances.grid.resolution_m
        least_m = distances.radius_m + step_m - 1e-6
        labels = _label(distances.reachable & (distances.clearances_m >= least_m))
        here = _label_at(distances, labels, distances.start)
        there = _label_at(distances, labels, goal)
        if here and there and here != there:
            return _find_on_path(distances, labels, points, least_m)
    return None


def _find_on_path(
    distances: DistanceField, labels: Labels, points: Sequence[Point], least_m: float
) -> ProvedGap | None:
    """Find the narrowest place of a way between two pieces of floor that are wide enough."""
    grid, at = distances.grid, np.array([[point.x, point.y] for point in points])
    of_point = grid.look_up(labels, at, outside=0)
    wide = np.flatnonzero(of_point)
    leaves = np.flatnonzero(np.diff(of_point[wide]))
    if not leaves.size:
        return None
    first, last = int(wide[leaves[0]]), int(wide[leaves[0] + 1])
    clearances_m = grid.look_up(distances.clearances_m, at[first : last + 1], outside=0.0)
    narrowest = int(clearances_m.argmin())
    return ProvedGap(
        point=points[first + narrowest],
        before=distances.start,
        width_m=2 * float(clearances_m[narrowest]),
        least_clearance_m=least_m,
    )


def mask_behind(distances: DistanceField, gaps: Sequence[ProvedGap]) -> Mask:
    """Mark the reachable floor that lies behind gaps.

    A gap that has become wider, or on whose other side the robot is by now, does not count.
    """
    labels, robot = _label_without(distances, gaps)
    valid = tuple(gap for gap in gaps if _label_at(distances, labels, gap.before) == robot)
    if len(valid) < len(gaps):
        labels, robot = _label_without(distances, valid)
    return np.asarray((labels > 0) & (labels != robot))


def _label_without(distances: DistanceField, gaps: Sequence[ProvedGap]) -> tuple[Labels, int]:
    """Label the reachable floor from 1 without the gaps; return the label around the robot too."""
    open_floor = distances.reachable.copy()
    for gap in gaps:
        rows, cols = distances.grid.window_around(gap.point, AROUND_M)
        open_floor[rows, cols] &= distances.clearances_m[rows, cols] >= gap.least_clearance_m
    labels = _label(open_floor)
    return labels, _label_at(distances, labels, distances.start)


def _label(floor: Mask) -> Labels:
    _, labels = cv2.connectedComponents(floor.view(np.uint8), connectivity=4)
    return np.asarray(labels, dtype=np.int32)


def _label_at(distances: DistanceField, labels: Labels, point: Point) -> int:
    """Return the label nearest to a point; 0 where none is near."""
    grid = distances.grid
    rows, cols = grid.window_around(point, distances.radius_m + AROUND_M)
    near = labels[rows, cols]
    if not near.any():
        return 0
    at: Cell = grid.cell_at(point)
    down, across = np.nonzero(near)
    nearest = int(np.hypot(down + rows.start - at.row, across + cols.start - at.col).argmin())
    return int(near[down[nearest], across[nearest]])
