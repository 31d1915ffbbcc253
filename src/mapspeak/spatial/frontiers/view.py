"""What may come into view: rays over the map that walls end and the unknown does not."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import FREE_MAX, UNKNOWN, Cell, FloatArray, OccupancyGrid

__all__ = ["Prospect", "find_prospect"]

SIGHT_M = 4.0
"""How far a look into the unknown is expected to go; rooms end what a LiDAR could see beyond."""
WALL_HOLE_M = 0.3
"""Beams far apart leave holes in walls; through one this wide nothing can be seen."""
N_RAYS = 72
LEAST_LEANING_RATIO = 0.02
"""Unknown that leans less than this to one side lies all around."""


@dataclass(frozen=True, slots=True)
class Prospect:
    """The unknown that may come into view from a place.

    Attributes:
        area_m2: As if nothing stood in the unknown.
        bearing_rad: Towards most of it, from the grid's own x axis; None where it lies all around.
    """

    area_m2: float
    bearing_rad: float | None


def find_prospect(grid: OccupancyGrid, place: Cell) -> Prospect:
    """Finds what unknown may come into view from the centre of a cell.

    Outside the array everything is unknown.
    """
    angles = np.linspace(0.0, math.tau, N_RAYS, endpoint=False)
    areas_m2 = _areas_by_ray(grid, place, angles)
    along_x, along_y = float(areas_m2 @ np.cos(angles)), float(areas_m2 @ np.sin(angles))
    total_m2 = float(areas_m2.sum())
    is_all_around = math.hypot(along_x, along_y) <= LEAST_LEANING_RATIO * total_m2
    return Prospect(total_m2, None if is_all_around else math.atan2(along_y, along_x))


def _areas_by_ray(grid: OccupancyGrid, place: Cell, angles: FloatArray) -> FloatArray:
    """Gives the unknown in each ray's sector, in square metres, up to the first wall."""
    reach = int(SIGHT_M / grid.resolution_m)
    window = _window(grid, place, reach + 1)
    steps = np.arange(1, reach + 1)
    rows = np.floor(reach + 1.5 + np.outer(np.sin(angles), steps)).astype(np.intp)
    cols = np.floor(reach + 1.5 + np.outer(np.cos(angles), steps)).astype(np.intp)
    is_behind_wall = np.logical_or.accumulate(_opaque(grid, window)[rows, cols], axis=1)
    sectors_m2 = steps * (math.tau / N_RAYS) * grid.resolution_m**2
    is_seen = (window[rows, cols] < 0) & ~is_behind_wall
    return np.asarray(is_seen @ sectors_m2, dtype=np.float64)


def _opaque(grid: OccupancyGrid, window: NDArray[np.int8]) -> NDArray[np.bool_]:
    """True in and near obstacles, so near that no ray gets through a hole; never at the centre."""
    occupied = window > FREE_MAX
    if not occupied.any():
        return occupied
    off_m = cv2.distanceTransform(
        (~occupied).view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE
    ) * np.float32(grid.resolution_m)
    middle = window.shape[0] // 2
    return np.asarray(off_m < min(WALL_HOLE_M / 2, float(off_m[middle, middle])), dtype=np.bool_)


def _window(grid: OccupancyGrid, centre: Cell, reach: int) -> NDArray[np.int8]:
    """Gives the cells around a cell, unknown outside the array."""
    window = np.full((2 * reach + 1, 2 * reach + 1), UNKNOWN, dtype=np.int8)
    top, left = centre.row - reach, centre.col - reach
    rows = slice(max(top, 0), min(top + 2 * reach + 1, grid.n_rows))
    cols = slice(max(left, 0), min(left + 2 * reach + 1, grid.n_cols))
    if rows.start < rows.stop and cols.start < cols.stop:
        window[rows.start - top : rows.stop - top, cols.start - left : cols.stop - left] = (
            grid.cells[rows, cols]
        )
    return window
