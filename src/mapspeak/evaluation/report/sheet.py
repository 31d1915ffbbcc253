"""A map below a way: the robot's last map as a small picture, and metres as its pixels."""

import io
import math
from dataclasses import dataclass

import numpy as np
from PIL import Image

from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray

__all__ = ["Sheet", "draw_sheet"]

GREYS = (244, 255, 60)
"""Unknown, free, occupied."""
UNKNOWN, FREE, OCCUPIED = range(3)
MARGIN_CELLS = 4
LONGEST_PX = 1200


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Sheet:
    """A map as a picture with y up.

    Attributes:
        png: The picture.
        width_px: Its width.
        height_px: Its height.
        grid: The part of the map that it shows.
        cells_per_px: How many cells a pixel's side is.
    """

    png: bytes
    width_px: int
    height_px: int
    grid: OccupancyGrid
    cells_per_px: int

    @property
    def px_per_m(self) -> float:
        """Pixels per metre."""
        return 1.0 / (self.grid.resolution_m * self.cells_per_px)

    def pixels_at(self, points: FloatArray) -> FloatArray:
        """Return (u, v) of shape (n, 2), as real numbers, for points in metres of shape (n, 2)."""
        cells = self.grid.fractional_cells_at(points) / self.cells_per_px
        return np.stack([cells[:, 1], self.height_px - cells[:, 0]], axis=1)

    def heading_deg(self, pose: Pose) -> float:
        """Return a heading as SVG turns things: clockwise from the picture's right."""
        return -math.degrees(pose.yaw_rad - self.grid.origin.yaw_rad)


def draw_sheet(grid: OccupancyGrid) -> Sheet | None:
    """Draw what is known of a map; None where nothing is."""
    rows, cols = np.nonzero(~grid.unknown)
    if not rows.size:
        return None
    part = grid.crop(_span(rows, grid.n_rows), _span(cols, grid.n_cols))
    step = math.ceil(max(part.n_rows, part.n_cols) / LONGEST_PX)
    tones = np.full(part.cells.shape, UNKNOWN, dtype=np.uint8)
    tones[part.free] = FREE
    tones[part.occupied] = OCCUPIED
    seen = np.flipud(tones[::step, ::step])
    height_px, width_px = seen.shape
    picture = Image.fromarray(np.ascontiguousarray(seen))
    picture.putpalette([grey for grey in GREYS for _ in range(3)])
    file = io.BytesIO()
    picture.save(file, "PNG", optimize=True)
    return Sheet(
        png=file.getvalue(),
        width_px=int(width_px),
        height_px=int(height_px),
        grid=part,
        cells_per_px=step,
    )


def _span(known: np.ndarray[tuple[int, ...], np.dtype[np.intp]], n_cells: int) -> slice:
    first, last = int(known.min()), int(known.max())
    return slice(max(first - MARGIN_CELLS, 0), min(last + 1 + MARGIN_CELLS, n_cells))
