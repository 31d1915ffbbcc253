"""The map as square pictures, of which a page fetches anew only those that have changed."""

import hashlib

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial import OccupancyGrid

TILE_CELLS = 256
UNKNOWN_GREY = 127


def name_tiles(grid: OccupancyGrid) -> list[list[str]]:
    """Return a name for what each tile shows, row by row from the grid's origin; "" for nothing."""
    return [
        [_name(_cut(grid, row, col)) for col in range(_count(grid.n_cols))]
        for row in range(_count(grid.n_rows))
    ]


def draw_tile(grid: OccupancyGrid, row: int, col: int) -> bytes:
    """Return a tile as PNG, a pixel a cell, the row farthest from the origin on top.

    Grey 255 is free, 0 occupied, the unknown transparent: the page gives it its own colour.
    """
    cells = _cut(grid, row, col)[::-1]
    known = cells >= 0
    grey = np.where(known, np.round(255 - 2.55 * np.clip(cells, 0, 100)), UNKNOWN_GREY)
    drawn = np.dstack([grey, grey, grey, np.where(known, 255, 0)]).astype(np.uint8)
    return bytes(cv2.imencode(".png", drawn)[1])


def _count(n_cells: int) -> int:
    return -(-n_cells // TILE_CELLS)


def _cut(grid: OccupancyGrid, row: int, col: int) -> NDArray[np.int8]:
    rows = slice(row * TILE_CELLS, (row + 1) * TILE_CELLS)
    cols = slice(col * TILE_CELLS, (col + 1) * TILE_CELLS)
    return grid.cells[rows, cols]


def _name(cells: NDArray[np.int8]) -> str:
    if (cells < 0).all():
        return ""
    content = hashlib.blake2b(np.ascontiguousarray(cells).data, digest_size=8)
    content.update(repr(cells.shape).encode())
    return content.hexdigest()
