"""Lines of sight over a map: which cells they pass, and how far over free floor."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial import OccupancyGrid

__all__ = ["SightLines", "cast_sight_lines"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SightLines:
    """The cells on lines from each of some places, all of shape (places, lines, steps).

    Attributes:
        rows: Of the cells; 0 where a line is outside the array.
        cols: The same.
        is_open: True where nothing but free floor lies between.
    """

    rows: IntArray
    cols: IntArray
    is_open: NDArray[np.bool_]


def cast_sight_lines(
    grid: OccupancyGrid, places: FloatArray, *, angles: FloatArray, steps_m: FloatArray
) -> SightLines:
    """Casts lines from places, and looks at them step by step.

    Args:
        grid: The map.
        places: In metres, shape (n, 2).
        angles: Of the lines, in the map frame.
        steps_m: Where to look at a line, from its beginning.
    """
    # A map is no more than turned and shifted, so that only directions need to be turned.
    in_grid = angles - grid.origin.yaw_rad
    steps = steps_m / grid.resolution_m
    starts = grid.fractional_cells_at(places)
    rows = _floored(starts[:, 0, None, None] + np.outer(np.sin(in_grid), steps))
    cols = _floored(starts[:, 1, None, None] + np.outer(np.cos(in_grid), steps))
    is_inside = grid.contains_cells(rows, cols)
    rows[~is_inside] = cols[~is_inside] = 0
    is_free = grid.free[rows, cols] & is_inside
    return SightLines(rows=rows, cols=cols, is_open=np.logical_and.accumulate(is_free, axis=2))


def _floored(places: FloatArray) -> IntArray:
    return np.asarray(np.floor(places, out=places), dtype=np.intp)
