"""What a page draws, as one JSON document: the grid here, what lies on it in `overlay`.

Points are metres in the map frame, angles degrees counter-clockwise from x.
"""

from pydantic import BaseModel, ConfigDict

from mapspeak.geometry import Pose
from mapspeak.server.view.tiles import TILE_CELLS, name_tiles
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
    """The grid: where it lies, and the names of its tiles from its origin on."""

    origin: PoseView
    resolution_m: float
    n_rows: int
    n_cols: int
    tile_cells: int = TILE_CELLS
    tiles: list[list[str]]

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
