"""The wall in line with a narrow place: what tells a door from a gap beside furniture."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.rooms.floor import Floor

_REACH_M = 1.5
_SLACK_RATIO = 1.3
_SLACK_M = 0.3
_ASIDE_M = (0.0,)

Line = NDArray[np.bool_]


class Frames:
    """Measures how much wall continues the line across a narrow place."""

    def __init__(self, floor: Floor, cell_size_m: float) -> None:
        self._cell_size_m = cell_size_m
        self._wall = cv2.dilate(floor.wall, np.ones((3, 3), np.uint8))
        self._angles_rad = [
            math.radians(angle + turn) for angle in floor.directions_deg for turn in (0, 90)
        ]

    def measure(self, row: int, col: int, clearance_m: float) -> float:
        """Gives the metres of wall on both sides of a place, in the best main direction.

        A direction counts only if the gap along it is about as wide as the place is narrow; on
        each side at most 1.5 m are looked at.
        """
        widest_m = 2 * clearance_m * _SLACK_RATIO + _SLACK_M
        return max(
            (self._along(row, col, angle_rad, widest_m) for angle_rad in self._angles_rad),
            default=0.0,
        )

    def _along(self, row: int, col: int, angle_rad: float, widest_m: float) -> float:
        """Gives the wall in line with a place in one direction; the line may pass beside it."""
        best_m = 0.0
        for aside_m in _ASIDE_M:
            aside = aside_m / self._cell_size_m
            start = row + aside * math.cos(angle_rad), col - aside * math.sin(angle_rad)
            one_gap, one_wall = self._look(*start, angle_rad, widest_m)
            other_gap, other_wall = self._look(*start, angle_rad + math.pi, widest_m)
            if one_gap + other_gap <= widest_m:
                best_m = max(best_m, one_wall + other_wall)
        return best_m

    def _look(
        self, row: float, col: float, angle_rad: float, widest_m: float
    ) -> tuple[float, float]:
        """Gives the way to the first wall and the length of wall from there on, in metres."""
        n_beyond = round(_REACH_M / self._cell_size_m)
        line = self._line(row, col, angle_rad, round(widest_m / self._cell_size_m) + n_beyond)
        at_wall = np.flatnonzero(line)
        if at_wall.size == 0:
            return math.inf, 0.0
        first = int(at_wall[0])
        n_wall = int(line[first : first + n_beyond].sum())
        return first * self._cell_size_m, n_wall * self._cell_size_m

    def _line(self, row: float, col: float, angle_rad: float, n_steps: int) -> Line:
        step = np.arange(1, n_steps)
        rows = np.rint(row + step * math.sin(angle_rad)).astype(np.intp)
        cols = np.rint(col + step * math.cos(angle_rad)).astype(np.intp)
        n_rows, n_cols = self._wall.shape
        inside = (rows >= 0) & (rows < n_rows) & (cols >= 0) & (cols < n_cols)
        line = np.zeros(step.size, bool)
        line[inside] = self._wall[rows[inside], cols[inside]] > 0
        return line
