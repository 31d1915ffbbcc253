"""What may come into view: rays over the map that walls end and the unknown wears out.

Something hides what lies behind it in the unknown as it does on known floor. So a ray lasts there
as far as rays last on this map: it is met by a wall once per so many metres, by chance, and what it
may show is weighed by how likely it gets there.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import UNKNOWN, Cell, FloatArray, Mask, OccupancyGrid
from mapspeak.spatial.paths.lattice import Clearance, clearance_m
from mapspeak.spatial.visibility import cast_rays

__all__ = ["Prospect", "Views", "find_area_m2", "find_views"]

SIGHT_M = 8.0
"""How far a look goes at most; rooms end what a LiDAR could see beyond."""
STEP_M = 0.15
"""Rays are looked at so often; walls are thicker, as nothing is seen through small holes."""
WALL_HOLE_M = 0.3
"""Beams far apart leave holes in walls; through one this wide nothing can be seen."""
N_RAYS = 72
_ANGLES_RAD = np.linspace(0.0, math.tau, N_RAYS, endpoint=False)
LEAST_LEANING_RATIO = 0.02
"""Unknown that leans less than this to one side lies all around."""
AT_ONCE = 256
"""Places whose rays are held in memory together."""

Depths = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Prospect:
    """The unknown that may come into view from a place.

    Attributes:
        area_m2: As much as is to be expected.
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
        stride_m: The length of a step.
        openness_m: How far a ray goes over known floor, on average, until it meets a wall.
    """

    depths: Depths
    steps_m: FloatArray
    stride_m: float
    openness_m: float

    def areas_m2(self, openness_m: float) -> FloatArray:
        """Gives what may come into view along each ray, where rays last so far on average."""
        passed_m = np.arange(self.steps_m.size + 1) * self.stride_m
        lasting = np.exp(-passed_m / openness_m).astype(np.float32)
        lasting[0] = 0.0
        sectors_m2 = (self.steps_m * self.stride_m * (math.tau / N_RAYS)).astype(np.float32)
        areas_m2 = np.empty(self.depths.shape[:2])
        for start in range(0, len(self.depths), AT_ONCE):
            some = slice(start, start + AT_ONCE)
            areas_m2[some] = lasting[self.depths[some]] @ sectors_m2
        return areas_m2

    def find_prospects(self) -> list[Prospect]:
        """Finds the prospect from each place."""
        areas_m2 = self.areas_m2(self.openness_m)
        totals_m2 = areas_m2.sum(axis=1)
        along_x, along_y = areas_m2 @ np.cos(_ANGLES_RAD), areas_m2 @ np.sin(_ANGLES_RAD)
        is_leaning = np.hypot(along_x, along_y) > LEAST_LEANING_RATIO * totals_m2
        return [
            Prospect(float(total_m2), float(bearing_rad) if leans else None)
            for total_m2, bearing_rad, leans in zip(
                totals_m2, np.arctan2(along_y, along_x), is_leaning, strict=True
            )
        ]


def find_views(grid: OccupancyGrid, clearances_m: Clearance, places: Sequence[Cell]) -> Views:
    """Finds what there is to see from the centre of each of some cells inside the array.

    Outside the array everything is unknown.

    Args:
        grid: The map.
        clearances_m: From each of its cells to the nearest obstacle.
        places: The cells.
    """
    stride = max(round(STEP_M / grid.resolution_m), 1)
    steps = np.arange(stride, SIGHT_M / grid.resolution_m + 1e-6, stride)
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


def _look(
    grid: OccupancyGrid, clearances_m: Clearance, places: Sequence[Cell], steps: FloatArray
) -> tuple[Mask, Mask]:
    """Gives where rays are over the unknown, and where no wall hides them; by place, ray, step."""
    rows = np.array([place.row for place in places], dtype=np.intp)
    cols = np.array([place.col for place in places], dtype=np.intp)
    middles = np.stack([rows, cols], axis=1) + 0.5
    rays = cast_rays(grid.cells.shape, middles, angles_rad=_ANGLES_RAD, steps=steps)
    solid_m = np.minimum(clearances_m[rows, cols], WALL_HOLE_M / 2)
    # A ray that has left the array beside a wall has crossed it: the nearest cell inside counts.
    is_wall = clearances_m.ravel()[rays.cells] < solid_m[:, None, None]
    is_unknown = (grid.cells.ravel()[rays.cells] < 0) | ~rays.is_inside
    return is_unknown, ~np.logical_or.accumulate(is_wall, axis=2)


def find_area_m2(grid: OccupancyGrid, place: Cell, *, openness_m: float) -> float:
    """Finds how much may come into view from the centre of one cell, which may lie anywhere."""
    near = _crop(grid, place, math.ceil((SIGHT_M + WALL_HOLE_M) / grid.resolution_m))
    middle = Cell(near.n_rows // 2, near.n_cols // 2)
    views = find_views(near, clearance_m(near), [middle])
    return float(views.areas_m2(openness_m).sum())


def _crop(grid: OccupancyGrid, centre: Cell, reach: int) -> OccupancyGrid:
    """Gives the map around a cell, with that cell in the middle and unknown outside the array."""
    cells = np.full((2 * reach + 1, 2 * reach + 1), UNKNOWN, dtype=np.int8)
    top, left = centre.row - reach, centre.col - reach
    rows = slice(max(top, 0), min(top + 2 * reach + 1, grid.n_rows))
    cols = slice(max(left, 0), min(left + 2 * reach + 1, grid.n_cols))
    if rows.start < rows.stop and cols.start < cols.stop:
        cells[rows.start - top : rows.stop - top, cols.start - left : cols.stop - left] = (
            grid.cells[rows, cols]
        )
    return OccupancyGrid(cells=cells, resolution_m=grid.resolution_m)
