"""The wall in line with a narrow place: what tells a door from a gap beside furniture."""

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.rooms.floor import Floor
from mapspeak.spatial.visibility import cast_rays

_REACH_M = 1.5
_SLACK_RATIO = 1.3
_SLACK_M = 0.3

Lines = NDArray[np.bool_]


class Frames:
    """Measures how much wall continues the line across a narrow place."""

    def __init__(self, floor: Floor, cell_size_m: float) -> None:
        self._cell_size_m = cell_size_m
        self._wall = cv2.dilate(floor.wall, np.ones((3, 3), np.uint8))
        angles_deg = [angle + turn for angle in floor.directions_deg for turn in (0, 90)]
        one_way = np.radians(np.array(angles_deg))
        self._angles_rad = np.concatenate([one_way, one_way + np.pi])

    def measure(self, row: int, col: int, clearance_m: float) -> float:
        """Gives the metres of wall on both sides of a place, in the best main direction.

        A direction counts only if the gap along it is about as wide as the place is narrow; on
        each side at most 1.5 m are looked at.
        """
        if self._angles_rad.size == 0:
            return 0.0
        widest_m = 2 * clearance_m * _SLACK_RATIO + _SLACK_M
        gap_m, wall_m = self._look(row, col, widest_m)
        n = len(gap_m) // 2
        is_gap = gap_m[:n] + gap_m[n:] <= widest_m
        return float(np.where(is_gap, wall_m[:n] + wall_m[n:], 0.0).max())

    def _look(
        self, row: int, col: int, widest_m: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Gives, each way, how far the first wall is and how much wall there is from there on."""
        n_beyond = round(_REACH_M / self._cell_size_m)
        lines = self._lines(row, col, round(widest_m / self._cell_size_m) + n_beyond)
        first = lines.argmax(axis=1)
        n_wall = np.zeros((lines.shape[0], lines.shape[1] + 1), np.intp)
        np.cumsum(lines, axis=1, out=n_wall[:, 1:])
        way = np.arange(len(lines))
        last = np.minimum(first + n_beyond, lines.shape[1])
        gap_m = np.where(lines.any(axis=1), first * self._cell_size_m, np.inf)
        return gap_m, (n_wall[way, last] - n_wall[way, first]) * self._cell_size_m

    def _lines(self, row: int, col: int, n_steps: int) -> Lines:
        steps = np.arange(1.0, max(n_steps, 2))
        start = np.array([[row + 0.5, col + 0.5]])
        rays = cast_rays(self._wall.shape, start, angles_rad=self._angles_rad, steps=steps)
        is_wall: Lines = (self._wall.ravel()[rays.cells[0]] > 0) & rays.is_inside[0]
        return is_wall
