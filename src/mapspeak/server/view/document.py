"""The content of a page as JSON documents: the grid, the robot, the calls; `overlay` has the rest.

A live page hears each as it changes, a chat asks for them, and a replay holds them step by step.
Points are metres in the map frame, angles degrees counter-clockwise from x.
"""

import base64
import hashlib
from collections.abc import Collection, Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid

TILE_CELLS = 256
UNKNOWN_GREY = 127
Spot = tuple[float, float]


class ViewPart(BaseModel):
    """A part of the document."""

    model_config = ConfigDict(frozen=True)


class PoseView(ViewPart):
    """A place and a heading."""

    x: float
    y: float
    yaw_deg: float

    @classmethod
    def of(cls, pose: Pose) -> "PoseView":
        """Round a pose to the millimetre and a tenth of a degree."""
        return cls(x=round(pose.x, 3), y=round(pose.y, 3), yaw_deg=round(pose.yaw_deg, 1))


class GridView(ViewPart):
    """The grid: where it lies, and the names of its tiles from its origin on.

    Attributes:
        pictures: Tiles by their names, as data URLs; a page that has a server fetches them there.
    """

    origin: PoseView
    resolution_m: float
    n_rows: int
    n_cols: int
    tile_cells: int = TILE_CELLS
    tiles: list[list[str]]
    pictures: Mapping[str, str] | None = None

    @classmethod
    def of(cls, grid: OccupancyGrid, *, tile_cells: int = TILE_CELLS) -> "GridView":
        """Name the tiles of a map."""
        return cls(
            origin=PoseView.of(grid.origin),
            resolution_m=grid.resolution_m,
            n_rows=grid.n_rows,
            n_cols=grid.n_cols,
            tile_cells=tile_cells,
            tiles=name_tiles(grid, tile_cells=tile_cells),
        )

    @classmethod
    def whole(cls, grid: OccupancyGrid, known: Collection[str] = ()) -> "GridView":
        """Draw all tiles but those that the reader has already."""
        view = cls.of(grid)
        pictures = {
            name: embed_tile(draw_tile(grid, row, col))
            for row, names in enumerate(view.tiles)
            for col, name in enumerate(names)
            if name and name not in known
        }
        return view.model_copy(update={"pictures": pictures})


class DriveView(ViewPart):
    """A drive, as it was heard of last."""

    id: str
    place: str
    state: str
    reason: str
    goal: PoseView
    path: list[Spot]


class RobotView(ViewPart):
    """The robot as it is now.

    Attributes:
        doubt: Why it may be elsewhere; empty for a fresh pose on the map.
        held_by: The holder and the reason; None where it is not held.
        waiting: The commands that wait for approval, by their ids.
        cameras: Their names, the one that looks ahead first.
        camera_fov_deg: How wide that one sees; None until a picture has told.
    """

    pose: PoseView | None
    age_s: float
    doubt: str
    fault: str = ""
    held_by: str | None = None
    drive: DriveView | None = None
    waiting: Mapping[str, str] = {}
    cameras: tuple[str, ...] = ()
    camera_fov_deg: float | None = None


class MissionsView(ViewPart):
    """The latest mission and the saved ones, each as a tree.

    Attributes:
        states: Of the latest mission's leaves that have begun, by their numbers.
        questions: Those that wait for an answer, in words.
    """

    latest: Mapping[str, Any] | None = None
    is_over: bool = True
    states: Mapping[int, str] = {}
    questions: tuple[str, ...] = ()
    saved: tuple[Mapping[str, Any], ...] = ()


class CallView(ViewPart):
    """A call of a tool and its answer; in a replay also what else was said.

    Attributes:
        is_over: True once it has been answered.
        pictures: Addresses of those that came with it, relative to the page or the robot.
        age_s: Time since it began, when it is told; None in a replay.
        took_s: Time until its answer.
        note: Who and when, in a replay.
    """

    number: int
    tool: str
    arguments: Mapping[str, Any] = {}
    is_over: bool = True
    is_error: bool = False
    text: str = ""
    pictures: tuple[str, ...] = ()
    age_s: float | None = None
    took_s: float | None = None
    note: str = ""


# --- the map as square pictures, of which a page fetches anew only those that have changed ---


def name_tiles(grid: OccupancyGrid, *, tile_cells: int = TILE_CELLS) -> list[list[str]]:
    """Return a name for what each tile shows, row by row from the grid's origin; "" for nothing."""
    return [
        [_name(_cut(grid, row, col, tile_cells)) for col in range(-(-grid.n_cols // tile_cells))]
        for row in range(-(-grid.n_rows // tile_cells))
    ]


def draw_tile(grid: OccupancyGrid, row: int, col: int, *, tile_cells: int = TILE_CELLS) -> bytes:
    """Return a tile as PNG, a pixel a cell, the row farthest from the origin on top.

    Grey 255 is free, 0 occupied, the unknown transparent: the page gives it its own colour.
    """
    cells = _cut(grid, row, col, tile_cells)[::-1]
    known = cells >= 0
    grey = np.where(known, np.round(255 - 2.55 * np.clip(cells, 0, 100)), UNKNOWN_GREY)
    drawn = np.dstack([grey, grey, grey, np.where(known, 255, 0)]).astype(np.uint8)
    return bytes(cv2.imencode(".png", drawn)[1])


def embed_tile(png: bytes) -> str:
    """Return a tile as a data URL, for a page without a server."""
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"


def _cut(grid: OccupancyGrid, row: int, col: int, tile_cells: int) -> NDArray[np.int8]:
    rows = slice(row * tile_cells, (row + 1) * tile_cells)
    cols = slice(col * tile_cells, (col + 1) * tile_cells)
    return grid.cells[rows, cols]


def _name(cells: NDArray[np.int8]) -> str:
    if (cells < 0).all():
        return ""
    content = hashlib.blake2b(np.ascontiguousarray(cells).data, digest_size=8)
    content.update(repr(cells.shape).encode())
    return content.hexdigest()
