"""Where an old map may lie on a new one: turns by walls' directions, shifts by correlation."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Pose, wrap_angle
from mapspeak.semantic.alignment.surfaces import MapSurfaces, placed
from mapspeak.spatial.grid import FloatArray

__all__ = ["guess_transforms"]

Raster = NDArray[np.float32]

N_BINS = 360
"""Of directions modulo pi: half a degree each."""
BLUR_BINS = 2.0
N_TURNS = 6
"""Turns to be tried, each in both senses; a building of right angles has two."""
APART_RAD = np.radians(4.0)
LEAST_TURN_RATIO = 0.5
"""A turn by which directions agree so much less than by the best one is not tried."""
N_SHIFTS = 4
"""Shifts to be tried for each turn."""
APART_M = 1.0

CELL_M = 0.2
LARGEST_RASTER = 1024
"""Cells along the side of the raster for shifts; a larger building gets larger cells."""
NEAR_CELLS = 1.25
CONFLICT = 0.5
"""What a wall in clear floor counts against a wall on a wall."""


def guess_transforms(old: MapSurfaces, new: MapSurfaces) -> Iterator[Pose]:
    """Gives transforms from the old map's frame to the new one's that are worth a closer look."""
    if not (old.points.size and new.points.size):
        return
    field = _Field(old, new)
    for turn_rad in _find_turns(old, new):
        yield from field.find_shifts(turn_rad)


# --- turns -----------------------------------------------------------------------------------


def _find_turns(old: MapSurfaces, new: MapSurfaces) -> list[float]:
    """Gives turns by which the walls of both maps run in the same directions, best first."""
    before, after = _directions(old), _directions(new)
    spectrum = np.conj(np.fft.rfft(before)) * np.fft.rfft(after)
    likeness = np.fft.irfft(spectrum, N_BINS)
    floor = float(np.median(likeness))
    least = floor + LEAST_TURN_RATIO * (float(likeness.max()) - floor)
    turns: list[float] = []
    for index in np.argsort(-likeness, kind="stable"):
        if len(turns) == N_TURNS or likeness[index] < least:
            break
        turn_rad = float(_peak(likeness, int(index))) * np.pi / N_BINS
        if all(abs(_wrap_line(turn_rad - other)) > APART_RAD for other in turns):
            turns.append(turn_rad)
    return [wrap_angle(turn + half) for turn in turns for half in (0.0, np.pi)]


def _directions(surfaces: MapSurfaces) -> FloatArray:
    """Gives how much wall runs in each direction modulo pi, a little blurred."""
    angles, sureness = surfaces.lines
    bins = (angles / np.pi * N_BINS).astype(np.intp) % N_BINS
    histogram = np.bincount(bins, weights=sureness, minlength=N_BINS)
    frequencies = np.fft.rfftfreq(N_BINS)
    blur = np.exp(-2 * (np.pi * BLUR_BINS * frequencies) ** 2)
    return np.asarray(np.fft.irfft(np.fft.rfft(histogram) * blur, N_BINS))


def _peak(values: FloatArray, index: int) -> float:
    """Gives where the parabola through a highest value and its neighbours is highest."""
    low, middle, high = (values[(index + step) % len(values)] for step in (-1, 0, 1))
    curvature = low - 2 * middle + high
    return index + (0.5 * (low - high) / curvature if curvature < 0 else 0.0)


def _wrap_line(angle_rad: float) -> float:
    return (angle_rad + np.pi / 2) % np.pi - np.pi / 2


# --- shifts ----------------------------------------------------------------------------------


class _Field:
    """The new map as a raster that a turned old map is laid on in every place at once."""

    def __init__(self, old: MapSurfaces, new: MapSurfaces) -> None:
        self._old_walls, self._old_floor = _thinned(old.points), _thinned(old.clear_floor)
        self._old_centre = _middle(old.points)
        reach_m = float(np.hypot(*(old.points - self._old_centre).T).max())
        self._low = new.points.min(axis=0) - reach_m
        extent_m = float((new.points.max(axis=0) + reach_m - self._low).max()) + reach_m
        self._cell_m = max(CELL_M, extent_m / LARGEST_RASTER)
        self._size = _smooth_size(int(np.ceil(extent_m / self._cell_m)))
        self._fits, self._walls = map(np.fft.rfft2, self._rasters(new))

    def find_shifts(self, turn_rad: float) -> Iterator[Pose]:
        """Gives the shifts, for one turn, by which most walls fall on walls."""
        turn = Pose(0.0, 0.0, turn_rad)
        turned_centre = placed(self._old_centre[None], turn)[0]
        # Laid about the raster's corner, so that a shift is where the centre comes to lie.
        walls = self._drawn(placed(self._old_walls, turn) - turned_centre)
        floor = self._drawn(placed(self._old_floor, turn) - turned_centre)
        spectrum = np.conj(np.fft.rfft2(walls)) * self._fits
        spectrum -= CONFLICT * np.conj(np.fft.rfft2(floor)) * self._walls
        score = np.fft.irfft2(spectrum, (self._size, self._size)).astype(np.float32)
        for row, col in self._peaks(score):
            x, y = self._low + np.array([col, row]) * self._cell_m - turned_centre
            yield Pose(float(x), float(y), turn_rad)

    def _rasters(self, new: MapSurfaces) -> tuple[Raster, Raster]:
        """Gives how well a wall fits in each place of the new map, and where its walls are."""
        steps = np.arange(self._size) * self._cell_m
        xs, ys = np.meshgrid(self._low[0] + steps, self._low[1] + steps)
        centres = np.stack([xs.ravel(), ys.ravel()], axis=1)
        distances, is_seen = new.distances_at(centres)
        near = np.exp(-((distances / (NEAR_CELLS * self._cell_m)) ** 2))
        is_clear = is_seen & (distances > 2 * NEAR_CELLS * self._cell_m)
        fits = np.where(is_clear, -CONFLICT, near).reshape(self._size, self._size)
        return fits.astype(np.float32), self._drawn(new.points - self._low)

    def _drawn(self, points: FloatArray) -> Raster:
        """Gives the raster with ones where points are; what lies left of it is wrapped round."""
        cols, rows = np.round(points / self._cell_m).astype(np.intp).T % self._size
        raster = np.zeros((self._size, self._size), dtype=np.float32)
        raster[rows, cols] = 1.0
        return raster

    def _peaks(self, score: Raster) -> Iterator[tuple[int, int]]:
        apart = max(round(APART_M / self._cell_m), 1)
        around = np.arange(-apart, apart + 1)
        for _ in range(N_SHIFTS):
            row, col = np.unravel_index(int(score.argmax()), score.shape)
            if score[row, col] <= 0:
                return
            yield int(row), int(col)
            score[np.ix_((row + around) % self._size, (col + around) % self._size)] = -np.inf


def _middle(points: FloatArray) -> FloatArray:
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)


def _thinned(points: FloatArray) -> FloatArray:
    """Gives one point for each part of the plane as large as a cell of the raster."""
    if not points.size:
        return points
    keys = np.floor(points / (CELL_M / 2)).astype(np.int64)
    _, first = np.unique(keys, axis=0, return_index=True)
    return points[np.sort(first)]


def _smooth_size(least: int) -> int:
    """Gives a size with small factors alone, which fast Fourier transforms like."""
    size = least
    while True:
        rest = size
        for factor in (2, 3, 5):
            while rest % factor == 0:
                rest //= factor
        if rest == 1:
            return size
        size += 1
