"""The ways look_at_map can show a map, the bare grid of numbers among them."""

import itertools
import json
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import MapError
from mapspeak.server.reports.mappicture import GREYS, draw_world, say_axes
from mapspeak.server.text.wording import say_pose
from mapspeak.server.text.world.look import MapView
from mapspeak.server.text.world.notices import say_warnings
from mapspeak.server.text.world.tables import describe_world
from mapspeak.server.text.world.told import PICTURE, Told
from mapspeak.spatial import FREE_MAX, UNKNOWN, OccupancyGrid
from mapspeak.spatial.picture import NORTH_UP_RAD, Zoom, draw_robot_pose

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
    """Return the known part of the map, or the part that is zoomed in on, as a JSON grid.

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
    parts += say_warnings(view.world)
    return " ".join(parts)


def _as_json(view: MapView, grid: OccupancyGrid, n_side: int) -> str:
    robot, origin = view.world.robot, grid.origin
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
    """Return one value for each block of cells: what stands in it, else what most of it is."""
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
    """Return the cells that are shown: what the zoom shows, or everything that is known."""
    grid, zoom = view.world.grid, view.look.zoom
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
    """Return the cells within a square along the grid's own axes."""
    centre = grid.fractional_cells_at(np.array([[zoom.centre.x, zoom.centre.y]]))[0]
    reach = zoom.radius_m / grid.resolution_m
    low = np.clip(np.floor(centre - reach), 0, grid.cells.shape).astype(int)
    high = np.clip(np.ceil(centre + reach), 0, grid.cells.shape).astype(int)
    return slice(int(low[0]), int(high[0])), slice(int(low[1]), int(high[1]))


class Representation(StrEnum):
    """How look_at_map shows the map."""

    PICTURE_TABLE = "picture-table"
    """The annotated picture and the same facts as tables; the default."""
    TABLE = "table"
    """The tables, and no picture."""
    PICTURE_ROOMS = "picture-rooms"
    """The annotated picture with rooms and ids, and no tables."""
    PICTURE_NUMBERS = "picture-numbers"
    """The map's picture with numbered axes and the robot, without rooms and ids."""
    PAPER_PICTURE = "paper-picture"
    """The paper's picture of the whole map with the robot as an arrow."""
    RAW_GRID = "raw-grid"
    """The occupancy grid as JSON."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """A map as it is shown.

    Attributes:
        text: What is said.
        png: The picture; None where there is none.
    """

    text: str
    png: bytes | None = None


def show(view: MapView, representation: Representation, told: Told | None = None) -> Shown:
    """Show what is to be seen of a map, in one of the ways; what was told is left out of tables."""
    return _WAYS[representation](view, told or Told())


def _show_picture_and_tables(view: MapView, told: Told) -> Shown:
    text, picture = describe_world(view, told), draw_world(view)
    caption = picture.caption
    if not told.is_new(PICTURE, caption, is_exact=True):
        caption = "Picture: scale as before."
    elif not told.is_first:
        caption = caption.replace(f" {GREYS}", "")
    return Shown(text=f"{text}\n\n{caption}", png=picture.png)


def _show_tables(view: MapView, told: Told) -> Shown:
    return Shown(text=f"{describe_world(view, told)}\n\nThere is no picture.")


def _show_rooms(view: MapView, _told: Told) -> Shown:
    picture = draw_world(view)
    return Shown(text=f"{_say_robot(view)}\n\n{picture.caption}", png=picture.png)


def _show_numbers(view: MapView, told: Told) -> Shown:
    return _show_rooms(replace(view, look=replace(view.look, layers=frozenset())), told)


def _show_paper(view: MapView, _told: Told) -> Shown:
    grid, robot = view.world.grid, view.world.robot
    picture = draw_robot_pose(grid, robot)
    is_plain = view.look.zoom is None and view.look.up_rad == NORTH_UP_RAD
    ignored = "" if is_plain else " It always shows the whole map with y up."
    text = f"{_say_robot(view)}\n\n{say_axes(grid, picture)}{ignored}"
    return Shown(text=text, png=picture.png)


def _show_raw_grid(view: MapView, _told: Told) -> Shown:
    return Shown(text=describe_raw_grid(view))


def _say_robot(view: MapView) -> str:
    """Return what a picture alone cannot be relied upon to say: where the robot is."""
    return "\n".join([*say_warnings(view.world), f"Robot: {say_pose(view.world.robot)}."])


_WAYS: dict[Representation, Callable[[MapView, Told], Shown]] = {
    Representation.PICTURE_TABLE: _show_picture_and_tables,
    Representation.TABLE: _show_tables,
    Representation.PICTURE_ROOMS: _show_rooms,
    Representation.PICTURE_NUMBERS: _show_numbers,
    Representation.PAPER_PICTURE: _show_paper,
    Representation.RAW_GRID: _show_raw_grid,
}
