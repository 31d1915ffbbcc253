"""Where to look with the camera next: floor of the map that no look-around has had near by.

A LiDAR sees a hall from one end; a camera knows an extinguisher only from near. So once the map is
explored, the policy goes on to places from which floor is near that was far so far.
"""

import math
from collections.abc import Sequence

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray, Mask
from mapspeak.spatial.paths import clearance_m, distances_from

__all__ = ["find_viewpoint"]

SIGHT_M = 4.0
"""How far a look-around counts: things beyond it are seen, but small."""
LEAST_AREA_M2 = 1.5
N_RAYS = 180


def find_viewpoint(
    grid: OccupancyGrid, robot: Point, looked_from: Sequence[Point], *, radius_m: float
) -> Point | None:
    """Find the middle of the nearest piece of floor that is still to be looked at, or None."""
    distances = distances_from(grid, robot, radius_m=radius_m)
    rows, cols = np.nonzero(grid.free)
    ways_m = np.full(grid.cells.shape, np.inf)
    ways_m[rows, cols] = distances.distances_at(rows, cols)
    is_left = np.isfinite(ways_m)
    for place in looked_from:
        is_left &= ~_near_in_sight(grid, place)
    piece = _find_nearest_piece(grid, is_left, ways_m)
    if piece is None:
        return None
    middle = np.argmax(np.where(piece, _depth(piece) + clearance_m(grid), 0.0))
    row, col = np.unravel_index(int(middle), piece.shape)
    x, y = grid.points_at(np.array([row]), np.array([col]))[0]
    return Point(float(x), float(y))


def _near_in_sight(grid: OccupancyGrid, place: Point) -> Mask:
    """Return the cells that can be seen from a place and are near it."""
    angles = np.linspace(-math.pi, math.pi, N_RAYS, endpoint=False)
    reach = np.arange(0.0, SIGHT_M, grid.resolution_m)
    xs = place.x + np.cos(angles)[:, None] * reach
    ys = place.y + np.sin(angles)[:, None] * reach
    rows, cols = grid.cells_at(np.stack([xs.ravel(), ys.ravel()], axis=1))
    is_inside = grid.contains_cells(rows, cols)
    is_open = np.zeros(rows.shape, dtype=bool)
    is_open[is_inside] = grid.free[rows[is_inside], cols[is_inside]]
    is_open = is_open.reshape(xs.shape)
    n_open = np.where(is_open.all(axis=1), reach.size, np.argmin(is_open, axis=1))
    reached_m = n_open * grid.resolution_m
    ends = np.stack(
        [place.x + np.cos(angles) * reached_m, place.y + np.sin(angles) * reached_m], axis=1
    )
    corners = grid.fractional_cells_at(ends)[:, ::-1] - 0.5
    seen = np.zeros(grid.cells.shape, dtype=np.uint8)
    cv2.fillPoly(seen, [np.round(corners).astype(np.int32)], 1)
    return seen > 0


def _find_nearest_piece(grid: OccupancyGrid, is_left: Mask, ways_m: FloatArray) -> Mask | None:
    n_pieces, labels, statistics, _ = cv2.connectedComponentsWithStats(is_left.astype(np.uint8))
    areas_m2 = statistics[:, cv2.CC_STAT_AREA] * grid.resolution_m**2
    large = [label for label in range(1, n_pieces) if areas_m2[label] >= LEAST_AREA_M2]
    if not large:
        return None
    nearest = min(large, key=lambda label: float(ways_m[labels == label].min()))
    return np.asarray(labels == nearest)


def _depth(piece: Mask) -> FloatArray:
    """Return how many cells each cell lies inside its piece."""
    padded = np.pad(piece.astype(np.uint8), 1)
    depth = cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(depth[1:-1, 1:-1], dtype=np.float64)
