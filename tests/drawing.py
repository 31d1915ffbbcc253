"""Maps drawn as text, so that the reader of a test sees the room."""

import numpy as np

from mapspeak.geometry import Pose
from mapspeak.spatial import UNKNOWN, OccupancyGrid

_OCCUPANCY = {"#": 100, ".": 0, "?": UNKNOWN, " ": UNKNOWN}


def grid_from_text(
    text: str, *, resolution_m: float = 1.0, origin: Pose | None = None
) -> OccupancyGrid:
    """Reads a map as a person draws it: '#' occupied, '.' free, '?' or ' ' unknown.

    The first line of text is the top of the map, its highest row. Empty lines before and after
    the drawing, and the indentation that all lines share, do not belong to it; short lines are
    filled up with unknown cells.
    """
    lines = _drawing_lines(text)
    n_cols = max((len(line) for line in lines), default=0)
    rows = [[_OCCUPANCY[sign] for sign in line.ljust(n_cols)] for line in reversed(lines)]
    return OccupancyGrid(
        cells=np.array(rows, dtype=np.int8).reshape(len(rows), n_cols),
        resolution_m=resolution_m,
        origin=origin or Pose(0.0, 0.0, 0.0),
    )


def text_from_grid(grid: OccupancyGrid) -> str:
    """Draws a map as text again, for assertions that a person can read."""
    signs = np.full(grid.cells.shape, "?")
    signs[grid.free] = "."
    signs[grid.occupied] = "#"
    return "\n".join("".join(row) for row in signs[::-1])


def _drawing_lines(text: str) -> list[str]:
    lines = text.split("\n")
    while lines and not lines[0].strip():
        del lines[0]
    while lines and not lines[-1].strip():
        del lines[-1]
    indent = min((len(line) - len(line.lstrip(" ")) for line in lines if line.strip()), default=0)
    return [line[indent:] for line in lines]
