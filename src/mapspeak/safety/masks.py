"""Keep-out masks as Nav2's KeepoutFilter reads them: a map's .yaml and picture, black is closed."""

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_map
from mapspeak.worldmodel.closures import Outline

CLOSED = 100
"""Nav2 makes a cell lethal at this value alone; less makes it dear, as for preferred lanes."""
MOST_SIDES = 100_000
FINE = 2


def load_mask(path: Path) -> tuple[Outline, ...]:
    """Reads a mask and gives outlines in the map frame: of what it closes, and of holes in it.

    Raises:
        MapError: A file is missing or damaged, or the mask closes nothing, or is too ragged.
    """
    grid = load_map(path).grid
    outlines = tuple(_find_outlines(grid))
    n_sides = sum(map(len, outlines))
    if n_sides == 0:
        raise MapError(
            f"The mask {path.name} closes nothing: no pixel of it is occupied.",
            hint="Black is closed, unless the .yaml says `negate: 1`.",
        )
    if n_sides > MOST_SIDES:
        raise MapError(
            f"The borders in the mask {path.name} have {n_sides:,} sides, the limit is "
            f"{MOST_SIDES:,}.",
            hint="Paint plain areas, or make it with a coarser resolution.",
        )
    return outlines


def _find_outlines(grid: OccupancyGrid) -> Iterator[Outline]:
    """Gives outlines a quarter of a cell outside the borders of the closed cells.

    OpenCV's contours run through the centres of border cells: in cells half as large, grown by one.
    """
    rows, cols = np.nonzero(grid.cells == CLOSED)
    if not rows.size:
        return
    window = slice(rows.min(), rows.max() + 1), slice(cols.min(), cols.max() + 1)
    is_closed = (grid.cells[window] == CLOSED).astype(np.uint8)
    fine = np.pad(is_closed.repeat(FINE, axis=0).repeat(FINE, axis=1), 1)
    fine = cv2.dilate(fine, np.ones((3, 3), dtype=np.uint8)).astype(np.uint8, copy=False)
    fine_m = grid.resolution_m / FINE
    corner = Pose(
        window[1].start * grid.resolution_m - fine_m, window[0].start * grid.resolution_m - fine_m
    )
    frame = OccupancyGrid(
        cells=fine.astype(np.int8), resolution_m=fine_m, origin=grid.origin @ corner
    )
    contours, _ = cv2.findContours(fine, cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)
    # The largest first: it gives the area its place in words.
    for contour in sorted(contours, key=cv2.contourArea, reverse=True):
        fine_cols, fine_rows = contour[:, 0, 0].astype(np.intp), contour[:, 0, 1].astype(np.intp)
        yield tuple(Point(x, y) for x, y in frame.points_at(fine_rows, fine_cols).tolist())
