"""Viewpoints to look beyond a border, and the gain that may come into view there.

Walls end rays, and the unknown attenuates them: obstacles hide what lies behind them there as on
known floor. So a ray hits a wall in the unknown at random, once per mean ray length of this map,
and what it may show is weighted by the probability that the ray gets there.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.frontiers.borders import Border, find_middle
from mapspeak.spatial.frontiers.frontier import Frontier
from mapspeak.spatial.grid import UNKNOWN, Cell, FloatArray, IntArray, Mask, OccupancyGrid
from mapspeak.spatial.paths.distances import DistanceField
from mapspeak.spatial.paths.lattice import Clearance, clearance_m
from mapspeak.spatial.visibility import cast_rays

TARGET_EVERY_M = 1.0
"""Longer borders have several targets, this far apart."""
MOST_TARGETS = 6
REACH_M = 0.5
"""A robot farther than this from a border cannot look over it."""
NARROW_COMFORT_M = 0.1
"""Room beyond its radius that the robot should have at least where many places are compared.

A navigator plans on its own map with its own rounding and padding, and refuses places that are
just wide enough here. Two cells of a usual map make up for both.
"""
_TARGET_ANGLES_RAD = np.linspace(0.0, math.tau, 32, endpoint=False)
AT_ONCE = 256
"""Places whose rays are held in memory together."""

LOOK_M = 8.0
"""Range limit of a look; rooms limit what a LiDAR could see beyond."""
STEP_M = 0.15
"""Sampling distance along rays; walls are thicker, as small holes in them are closed."""
WALL_HOLE_M = 0.3
"""Beams far apart leave holes in walls; through one this wide nothing can be seen."""
N_RAYS = 72
_ANGLES_RAD = np.linspace(0.0, math.tau, N_RAYS, endpoint=False)
LEAST_LEANING_RATIO = 0.02
"""Unknown with a weaker mean direction than this lies all around."""

Depths = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class FrontierViewpoint:
    """A place to look beyond a border from.

    Attributes:
        cell: A cell that the robot can reach.
        target: The cell of the border that it was chosen for.
    """

    cell: Cell
    target: Cell


def find_viewpoints(
    distances: DistanceField, borders: Sequence[Border]
) -> list[list[FrontierViewpoint]]:
    """Find viewpoints all along each border; none if no place near by suits.

    A viewpoint is in sight of the border. It has clearance to spare if there is such a place in
    reach, else it is the one with most clearance; of equals it is the nearest one.
    """
    if not borders:
        return []
    targets = [_choose_targets(distances, border) for border in borders]
    rows = np.concatenate([target[0] for target in targets])
    cols = np.concatenate([target[1] for target in targets])
    cells = _find_cells(distances, rows, cols)
    found = zip(cells.tolist(), rows.tolist(), cols.tolist(), strict=True)
    viewpoints = []
    for own_rows, _ in targets:
        of_border = itertools.islice(found, own_rows.size)
        # Each cell once, for the last of its targets.
        target_of = {cell: Cell(row, col) for cell, row, col in of_border if cell >= 0}
        viewpoints.append(
            [
                FrontierViewpoint(Cell(*divmod(cell, distances.grid.n_cols)), target)
                for cell, target in target_of.items()
            ]
        )
    return viewpoints


def _choose_targets(distances: DistanceField, border: Border) -> tuple[IntArray, IntArray]:
    """Pick cells of a border, if possible where the robot can go right up to it."""
    near = np.flatnonzero(distances.reachable[border.rows, border.cols])
    every_m = TARGET_EVERY_M if near.size else REACH_M
    rows, cols = (border.rows[near], border.cols[near]) if near.size else (border.rows, border.cols)
    n_targets = min(max(round(border.length_m / every_m), 1), MOST_TARGETS)
    picked = _spread_out(rows, cols, n_targets)
    return rows[picked], cols[picked]


def _spread_out(rows: IntArray, cols: IntArray, n_cells: int) -> list[int]:
    """Pick cells far from each other: first the middle one, then always the furthest."""
    picked = [find_middle(rows, cols)]
    gaps = np.full(rows.size if n_cells > 1 else 0, np.inf)
    while len(picked) < n_cells:
        last = picked[-1]
        gaps = np.minimum(gaps, np.hypot(rows - rows[last], cols - cols[last]))
        picked.append(int(gaps.argmax()))
    return picked


def _find_cells(distances: DistanceField, rows: IntArray, cols: IntArray) -> IntArray:
    """Return the flat index of the best cell to stand in for each target; -1 for none."""
    comfort_m = distances.radius_m + NARROW_COMFORT_M
    cells = rows * distances.grid.n_cols + cols
    is_good = distances.reachable[rows, cols] & (distances.clearances_m[rows, cols] >= comfort_m)
    others = np.flatnonzero(~is_good)
    for start in range(0, others.size, AT_ONCE):
        some = others[start : start + AT_ONCE]
        cells[some] = _find_cells_off(distances, rows[some], cols[some])
    return cells


def _find_cells_off(distances: DistanceField, rows: IntArray, cols: IntArray) -> IntArray:
    """Find the same for targets that the robot cannot stand on well, by looking around them."""
    reach_m = distances.radius_m + REACH_M
    n_steps = math.ceil(reach_m / distances.grid.resolution_m)
    steps = np.arange(n_steps + 1, dtype=np.float64)
    middles = np.stack([rows, cols], axis=1) + 0.5
    rays = cast_rays(distances.grid.free.shape, middles, angles_rad=_TARGET_ANGLES_RAD, steps=steps)
    clearances_m = distances.clearances_m.ravel()[rays.cells]
    is_reachable = distances.reachable.ravel()[rays.cells] & rays.is_inside
    # Beside an obstacle a ray might slip between two cells of wall that touch at a corner.
    is_wide = clearances_m > distances.grid.resolution_m
    is_passed = distances.grid.free.ravel()[rays.cells] & rays.is_inside & (is_wide | is_reachable)
    is_passed[:, :, 0] = True
    is_seen = np.logical_and.accumulate(is_passed, axis=2)
    room_m = np.minimum(clearances_m, distances.radius_m + NARROW_COMFORT_M)
    # A step further away must gain more room than the whole weight of the distance.
    worth = np.where(is_seen & is_reachable, room_m - steps * 1e-6, -np.inf)
    flat = worth.reshape(rows.size, -1)
    best = flat.argmax(axis=1)
    each = np.arange(rows.size)
    found = rays.cells.reshape(rows.size, -1)[each, best]
    return np.where(np.isfinite(flat[each, best]), found, -1)


@dataclass(frozen=True, slots=True)
class ExpectedGain:
    """The unknown that may come into view from a place.

    Attributes:
        bearing_rad: Towards most of it, from the grid's own x axis; None where it lies all around.
    """

    area_m2: float
    bearing_rad: float | None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Views:
    """The rays from some places, step by step.

    Attributes:
        depths: Steps into the unknown, this one included; 0 on known floor and behind walls.
            Shape (places, rays, steps).
        steps_m: From the place to each step.
        openness_m: How far a ray goes over known floor, on average, until it meets a wall.
    """

    depths: Depths
    steps_m: FloatArray
    stride_m: float
    openness_m: float

    def areas_m2(self, openness_m: float) -> FloatArray:
        """Return what may come into view along each ray, given the mean length of rays."""
        passed_m = np.arange(self.steps_m.size + 1) * self.stride_m
        lasting = np.exp(-passed_m / openness_m).astype(np.float32)
        lasting[0] = 0.0
        sectors_m2 = (self.steps_m * self.stride_m * (math.tau / N_RAYS)).astype(np.float32)
        areas_m2 = np.empty(self.depths.shape[:2])
        for start in range(0, len(self.depths), AT_ONCE):
            some = slice(start, start + AT_ONCE)
            areas_m2[some] = lasting[self.depths[some]] @ sectors_m2
        return areas_m2

    def find_gains(self) -> list[ExpectedGain]:
        """Find the expected gain at each place."""
        areas_m2 = self.areas_m2(self.openness_m)
        totals_m2 = areas_m2.sum(axis=1)
        along_x, along_y = areas_m2 @ np.cos(_ANGLES_RAD), areas_m2 @ np.sin(_ANGLES_RAD)
        is_leaning = np.hypot(along_x, along_y) > LEAST_LEANING_RATIO * totals_m2
        return [
            ExpectedGain(float(total_m2), float(bearing_rad) if leans else None)
            for total_m2, bearing_rad, leans in zip(
                totals_m2, np.arctan2(along_y, along_x), is_leaning, strict=True
            )
        ]


def find_views(grid: OccupancyGrid, clearances_m: Clearance, places: Sequence[Cell]) -> Views:
    """Find what is visible from the centre of each of some cells inside the array.

    Outside the array everything is unknown.

    Args:
        clearances_m: From each of its cells to the nearest obstacle.
    """
    stride = max(round(STEP_M / grid.resolution_m), 1)
    steps = np.arange(stride, LOOK_M / grid.resolution_m + 1e-6, stride)
    depths, n_passed, n_met = [np.zeros((0, N_RAYS, steps.size), dtype=np.uint8)], 0, 0
    for start in range(0, len(places), AT_ONCE):
        is_unknown, is_open = _look(grid, clearances_m, places[start : start + AT_ONCE], steps)
        is_shown = is_unknown & is_open
        depths.append(np.cumsum(is_shown, axis=2, dtype=np.uint8) * is_shown)
        is_surely_open = is_open & ~np.logical_or.accumulate(is_unknown, axis=2)
        n_passed += int(is_surely_open.sum())
        n_met += int((is_surely_open[:, :, :-1] & ~is_open[:, :, 1:]).sum())
    stride_m = stride * grid.resolution_m
    return Views(
        depths=np.concatenate(depths),
        steps_m=steps * grid.resolution_m,
        stride_m=stride_m,
        openness_m=stride_m * max(n_passed, 1) / max(n_met, 1),
    )


def rows_and_cols(cells: Sequence[Cell]) -> tuple[IntArray, IntArray]:
    """Return the rows and the columns of some cells."""
    rows, cols = np.array([(cell.row, cell.col) for cell in cells], dtype=np.intp).reshape(-1, 2).T
    return rows, cols


def _look(
    grid: OccupancyGrid, clearances_m: Clearance, places: Sequence[Cell], steps: FloatArray
) -> tuple[Mask, Mask]:
    """Return where rays are over the unknown, and not hidden by a wall; by place, ray, step."""
    rows, cols = rows_and_cols(places)
    middles = np.stack([rows, cols], axis=1) + 0.5
    rays = cast_rays(grid.cells.shape, middles, angles_rad=_ANGLES_RAD, steps=steps)
    solid_m = np.minimum(clearances_m[rows, cols], WALL_HOLE_M / 2)
    # A ray that has left the array beside a wall has crossed it: the nearest cell inside counts.
    is_wall = clearances_m.ravel()[rays.cells] < solid_m[:, None, None]
    is_unknown = (grid.cells.ravel()[rays.cells] < 0) | ~rays.is_inside
    return is_unknown, ~np.logical_or.accumulate(is_wall, axis=2)


def remaining_ratio(grid: OccupancyGrid, frontier: Frontier) -> float:
    """Return the share of a frontier's gain that its pose still promises.

    A robot under way to a frontier can turn to the next one when this falls: it has already seen
    from afar what it was sent to see. The map may have grown and moved its origin since.
    """
    place = grid.cell_at(frontier.pose.point)
    reach = math.ceil((LOOK_M + WALL_HOLE_M) / grid.resolution_m)
    # The map around it, wherever it is, with unknown outside the array.
    cells = np.full((2 * reach + 1, 2 * reach + 1), UNKNOWN, dtype=np.int8)
    rows, cols = grid.window(place.row, place.col, margin=reach)
    top, left = place.row - reach, place.col - reach
    inside = (slice(rows.start - top, rows.stop - top), slice(cols.start - left, cols.stop - left))
    cells[inside] = grid.cells[rows, cols]
    near = OccupancyGrid(cells=cells, resolution_m=grid.resolution_m)
    views = find_views(near, clearance_m(near), [Cell(reach, reach)])
    return float(views.areas_m2(frontier.openness_m).sum()) / frontier.gain_m2
