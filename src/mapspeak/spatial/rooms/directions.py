"""The directions of walls, modulo a right angle."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import FloatArray, IntArray

MAX_DIRECTIONS = 8
_LEAST_RATIO = 0.2
"""A main direction has at least this share of the strongest one's edges."""
_EDGE_BLUR_CELLS = 1.5
_MARGIN_CELLS = 8
"""The blur of an edge reaches no farther."""
_BELL_DEG = 2.0
_APART_DEG = 6
"""Main directions differ by more than this."""
_SEARCHES = ((45.0, 1.0, 5_000), (1.0, 0.25, 20_000))
"""Reach and step in degrees, and how many cells to look at: coarse, then near the best."""


def find_main_direction(occupied: NDArray[np.uint8]) -> float:
    """Return how far the strongest direction of walls is off the axes, from -45 to 45 degrees.

    It is the angle at which the edges of obstacles fall into the fewest rows and columns.
    Gradients would not do: the steps of an oblique wall draw them towards the axes.
    """
    inside = cv2.erode(occupied, np.ones((3, 3), np.uint8))
    cells = np.flatnonzero(occupied > inside)
    off_deg = 0.0
    for reach_deg, step_deg, most_cells in _SEARCHES:
        rows, cols = np.divmod(cells[:: cells.size // most_cells + 1], occupied.shape[1])
        angles_deg = off_deg + np.arange(-reach_deg, reach_deg + step_deg / 2, step_deg)
        # On small maps several are equally good: then the one nearest to the axes.
        angles_deg = angles_deg[np.argsort(np.abs(angles_deg), kind="stable")]
        fullness = [_fullness(rows, cols, math.radians(angle_deg)) for angle_deg in angles_deg]
        off_deg = float(angles_deg[int(np.argmax(fullness))])
    return (off_deg + 45.0) % 90.0 - 45.0


def _fullness(rows: IntArray, cols: IntArray, angle_rad: float) -> float:
    """Return the sum of squares of how many cells fall into each row and each column."""
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    if not rows.size:
        return 0.0
    sums = 0.0
    for places in (cosine * cols + sine * rows, cosine * rows - sine * cols):
        counts = np.bincount((places - places.min()).astype(np.intp)).astype(np.float64)
        sums += float(counts @ counts)
    return sums


def find_wall_directions(occupied: NDArray[np.uint8]) -> list[float]:
    """Return the main directions of walls in degrees from 0 to 90, the strongest first.

    They are the peaks of the histogram of gradient angles modulo 90 degrees, each with at least
    a fifth of the highest; and last, halfway between the strongest and its right angle, the
    direction of cut corners, which would else be found or not as the raster happens to lie.
    """
    histogram = _angle_histogram(occupied)
    highest = float(histogram.max())
    if highest <= 0:
        return []
    around = np.stack(
        [np.roll(histogram, shift) for shift in range(-_APART_DEG, _APART_DEG + 1)]
    ).max(axis=0)
    peaks = np.flatnonzero((histogram >= around) & (histogram >= _LEAST_RATIO * highest))
    strongest = sorted(peaks.tolist(), key=lambda peak: (-histogram[peak], peak))
    directions = [peak + 0.5 for peak in strongest[:MAX_DIRECTIONS]]
    halfway = (directions[0] + 45.0) % 90.0
    is_new = all(abs((halfway - other + 45.0) % 90.0 - 45.0) > _APART_DEG for other in directions)
    return [*directions, halfway] if is_new else directions


def _angle_histogram(occupied: NDArray[np.uint8]) -> FloatArray:
    angle_deg, strength = _find_edges(occupied)
    counts = np.bincount(angle_deg.astype(np.intp) % 90, weights=strength, minlength=90)
    bell = np.exp(-0.5 * (np.arange(-8, 9) / _BELL_DEG) ** 2)
    wrapped = np.concatenate([counts[-8:], counts, counts[:8]])
    return np.convolve(wrapped, bell / bell.sum(), mode="valid")


def _find_edges(occupied: NDArray[np.uint8]) -> tuple[FloatArray, FloatArray]:
    """Return the angles of the gradients at edges, in degrees, and how strong they are."""
    framed = np.pad(occupied, _MARGIN_CELLS).astype(np.float32)
    soft = cv2.GaussianBlur(framed, (0, 0), _EDGE_BLUR_CELLS)
    across = cv2.Sobel(soft, cv2.CV_32F, 1, 0)
    along = cv2.Sobel(soft, cv2.CV_32F, 0, 1)
    strength, angle_deg = cv2.cartToPolar(across, along, angleInDegrees=True)
    strong = strength > 0.3 * strength.max()
    return angle_deg[strong].astype(np.float64), strength[strong].astype(np.float64)
