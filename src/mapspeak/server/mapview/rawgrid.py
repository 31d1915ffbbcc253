"""The map as numbers and nothing else: a JSON grid as plain ROS servers give it, made to fit."""

import itertools
import json
import math

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import MapError
from mapspeak.server.mapview.views import MapView
from mapspeak.server.wording import say_warnings
from mapspeak.spatial import FREE_MAX, UNKNOWN, OccupancyGrid
from mapspeak.spatial.picture import Zoom

MOST_CHARACTERS = 18_000
"""Of the JSON: answers of more than 20,000 characters are cut by some clients."""
MEANING = (
    "The map as a grid of numbers: -1 unknown, 0 surely free to 100 surely occupied. Row 0 is at "
    "the origin; rows grow along the grid's y axis, columns along its x axis; metres in the map "
    "frame, yaw_deg counter-clockwise from x."
)
LEAST_CHARACTERS = 2
"""Of one value and the comma after it."""


def describe_raw_grid(view: MapView) -> str:
    """Gives the known part of the map, or the part that is zoomed in on, as a JSON grid.

    Where the cells are too many, square blocks of them become one value each, and the text says so.

    Raises:
        MapError: The zoom shows no map.
    """
    grid = _part_of(view)
    n_values = grid.cells.size
    least = max(1, math.ceil(math.sqrt(n_values * LEAST_CHARACTERS / MOST_CHARACTERS)))
    for n_side in itertools.count(least):
        text = _as_json(view, grid, n_side)
        if len(text) <= MOST_CHARACTERS:
            break
    return f"{_say_meaning(view, grid, n_side)}\n{text}"


def _say_meaning(view: MapView, grid: OccupancyGrid, n_side: int) -> str:
    parts = [MEANING]
    if n_side > 1:
        parts.append(
            f"Made coarser to fit: each value stands for {n_side} x {n_side} cells of "
            f"{grid.resolution_m:g} m. It is their highest value where any is occupied, -1 where "
            "most are unknown: narrow gaps may look closed; around and radius_m show fewer cells "
            "more finely."
        )
    parts += say_warnings(view.atlas)
    return " ".join(parts)


def _as_json(view: MapView, grid: OccupancyGrid, n_side: int) -> str:
    robot, origin = view.atlas.robot, grid.origin
    values = _coarsen(grid.cells, n_side)
    answer = {
        "robot": {"x": round(robot.x, 2), "y": round(robot.y, 2), "yaw_deg": round(robot.yaw_deg)},
        "origin": {
            "x": round(origin.x, 3),
            "y": round(origin.y, 3),
            "yaw_deg": round(origin.yaw_deg, 2),
        },
        "resolution_m": round(grid.resolution_m * n_side, 6),
        "n_rows": values.shape[0],
        "n_cols": values.shape[1],
        "data": values.tolist(),
    }
    return json.dumps(answer, separators=(",", ":"))


def _coarsen(cells: NDArray[np.int8], n_side: int) -> NDArray[np.int8]:
    """Gives one value for each block of cells: what stands in it, else what most of it is."""
    if n_side == 1:
        return cells
    n_rows, n_cols = (math.ceil(n / n_side) for n in cells.shape)
    whole = np.full((n_rows * n_side, n_cols * n_side), UNKNOWN, dtype=np.int8)
    whole[: cells.shape[0], : cells.shape[1]] = cells
    blocks = whole.reshape(n_rows, n_side, n_cols, n_side).swapaxes(1, 2)
    highest = blocks.max(axis=(2, 3))
    is_unknown = (blocks < 0).mean(axis=(2, 3)) > 0.5
    has_obstacle = highest > FREE_MAX
    return np.where(is_unknown & ~has_obstacle, np.int8(UNKNOWN), highest)


def _part_of(view: MapView) -> OccupancyGrid:
    """Gives the cells that are shown: what the zoom shows, or everything that is known."""
    grid, zoom = view.atlas.grid, view.look.zoom
    rows, cols = _known(grid) if zoom is None else _window(grid, zoom)
    if rows.start >= rows.stop or cols.start >= cols.stop:
        raise MapError("No cell of the map lies there.", hint="Look at the whole map first.")
    return grid.crop(rows, cols)


def _known(grid: OccupancyGrid) -> tuple[slice, slice]:
    rows, cols = (np.flatnonzero((grid.cells >= 0).any(axis=axis)) for axis in (1, 0))
    if not rows.size:
        return slice(0, grid.n_rows), slice(0, grid.n_cols)
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(cols[0]), int(cols[-1]) + 1)


def _window(grid: OccupancyGrid, zoom: Zoom) -> tuple[slice, slice]:
    """Gives the cells within a square along the grid's own axes."""
    centre = grid.fractional_cells_at(np.array([[zoom.centre.x, zoom.centre.y]]))[0]
    reach = zoom.radius_m / grid.resolution_m
    low = np.clip(np.floor(centre - reach), 0, grid.cells.shape).astype(int)
    high = np.clip(np.ceil(centre + reach), 0, grid.cells.shape).astype(int)
    return slice(int(low[0]), int(high[0])), slice(int(low[1]), int(high[1]))
