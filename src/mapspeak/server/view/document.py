"""The content of a page as JSON documents: the grid, the robot, the calls; `overlay` has the rest.

A live page hears each as it changes, a chat asks for them, and a replay holds them step by step.
Points are metres in the map frame, angles degrees counter-clockwise from x.
"""

import base64
from collections.abc import Collection, Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict

from mapspeak.geometry import Pose
from mapspeak.server.view.tiles import TILE_CELLS, draw_tile, name_tiles
from mapspeak.spatial import OccupancyGrid

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
    def of(cls, grid: OccupancyGrid) -> "GridView":
        """Name the tiles of a map."""
        return cls(
            origin=PoseView.of(grid.origin),
            resolution_m=grid.resolution_m,
            n_rows=grid.n_rows,
            n_cols=grid.n_cols,
            tiles=name_tiles(grid),
        )

    @classmethod
    def whole(cls, grid: OccupancyGrid, known: Collection[str] = ()) -> "GridView":
        """Draw all tiles but those that the reader has already."""
        view = cls.of(grid)
        pictures = {
            name: f"data:image/png;base64,{base64.b64encode(draw_tile(grid, row, col)).decode()}"
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
        camera_fov_deg: How wide its camera sees; None until a picture has told.
    """

    pose: PoseView | None
    age_s: float
    doubt: str
    fault: str = ""
    held_by: str | None = None
    drive: DriveView | None = None
    waiting: Mapping[str, str] = {}
    camera_fov_deg: float | None = None


class CallView(ViewPart):
    """A call of a tool and its answer; in a replay also what else was said.

    Attributes:
        is_over: True once it has been answered.
        pictures: Addresses of those that came with it, relative to the page or the robot.
        note: Who and when, where that is known.
    """

    number: int
    tool: str
    arguments: Mapping[str, Any] = {}
    is_over: bool = True
    is_error: bool = False
    text: str = ""
    pictures: tuple[str, ...] = ()
    note: str = ""
