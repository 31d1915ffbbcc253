"""Where in a region its label stands best."""

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ["find_poles"]


def find_poles(
    regions: NDArray[np.uint16], wanted: tuple[int, ...]
) -> dict[int, tuple[float, float]]:
    """Gives, for each region in sight, (u, v) of the point farthest from its border, to two pixels.

    That is the pole of inaccessibility: the place with the most room for a label. The sides of the
    picture are borders too, so the pole of a region that is only partly in sight lies in that part.

    Args:
        regions: The region of each pixel of the map area; 0 for none.
        wanted: The regions that are looked for.
    """
    coarse = cv2.copyMakeBorder(regions[::2, ::2], 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=(0,))
    kernel = np.ones((3, 3), dtype=np.uint8)
    is_inner = (cv2.dilate(coarse, kernel) == cv2.erode(coarse, kernel)) & (coarse > 0)
    depth = cv2.distanceTransform(is_inner.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    is_peak = (depth >= cv2.dilate(depth, kernel)) & (coarse > 0)
    rows, cols = np.nonzero(is_peak)
    order = np.argsort(-depth[rows, cols], kind="stable")
    labels, first = np.unique(coarse[rows[order], cols[order]], return_index=True)
    peaks = order[first]
    poles = {
        int(label): (2.0 * float(cols[peak]) - 1.5, 2.0 * float(rows[peak]) - 1.5)
        for label, peak in zip(labels, peaks, strict=True)
    }
    return poles | _find_slivers(regions, set(wanted) - poles.keys())


def _find_slivers(regions: NDArray[np.uint16], missing: set[int]) -> dict[int, tuple[float, float]]:
    """Gives the first pixel of regions so small that every second row and column misses them."""
    if not missing:
        return {}
    is_seen = cv2.calcHist([regions], [0], None, [1 << 16], [0, 1 << 16]).ravel() > 0
    found = {}
    for label in sorted(label for label in missing if is_seen[label]):
        row, col = np.unravel_index(int(np.argmax(regions == label)), regions.shape)
        found[label] = (float(col) + 0.5, float(row) + 0.5)
    return found
