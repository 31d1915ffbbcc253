"""Many rays from many cells at once: which cells they pass."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import FloatArray, IntArray, Mask

__all__ = ["Rays", "cast_rays"]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Rays:
    """The cells on rays from each of some places, all of shape (places, directions, steps).

    Attributes:
        cells: Flat indices into the array; of the nearest cell inside where the ray is outside.
        is_inside: True where the ray is inside the array.
        angles: Of the directions, from the array's own x axis, shape (directions,).
    """

    cells: IntArray
    is_inside: Mask
    angles: FloatArray


def cast_rays(
    shape: tuple[int, int], rows: IntArray, cols: IntArray, *, n_directions: int, steps: FloatArray
) -> Rays:
    """Casts rays from the centres of cells all around, and looks at them at so many cells' way.

    Args:
        shape: Rows and columns of the array.
        rows: Of the cells that rays begin in.
        cols: Of the same cells.
        n_directions: Rays from each.
        steps: Where to look at a ray, in cells from its beginning.
    """
    angles = np.linspace(0.0, math.tau, n_directions, endpoint=False)
    on_rows = _passed(np.outer(np.sin(angles), steps), rows)
    on_cols = _passed(np.outer(np.cos(angles), steps), cols)
    n_rows, n_cols = shape
    is_inside = (on_rows >= 0) & (on_rows < n_rows) & (on_cols >= 0) & (on_cols < n_cols)
    inside_rows = np.clip(on_rows, 0, n_rows - 1).astype(np.intp)
    cells = inside_rows * n_cols + np.clip(on_cols, 0, n_cols - 1)
    return Rays(cells=cells, is_inside=is_inside, angles=angles)


def _passed(offsets: FloatArray, starts: IntArray) -> NDArray[np.int32]:
    """Gives the rows, or the columns, that lie so far from the middle of those at the start."""
    whole = np.floor(offsets + 0.5).astype(np.int32)
    return np.asarray(starts.astype(np.int32)[:, None, None] + whole, dtype=np.int32)
