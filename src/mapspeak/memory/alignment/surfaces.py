"""Wall surfaces that face seen floor: what two maps of one building have in common.

Only surfaces count. The thickness of a wall, and whether cells behind it are occupied or unknown,
differ from map to map.
"""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray, IntArray, Mask

Distances = NDArray[np.float32]

FACING_M = 0.2
"""Some maps leave a seam of unknown cells between a wall and the floor before it."""
SMOOTHING_M = 0.15
"""Wall cells within about this distance together determine the direction of a wall."""
CLEAR_M = 0.4
"""Floor this far from any surface excludes walls, even between maps that agree roughly."""
SEEN_M = 0.3
"""A map still counts as seen this far behind a surface."""
_NEIGHBOURS = np.ones((3, 3), dtype=np.uint8)


@dataclass(frozen=True, eq=False)
class MapSurfaces:
    """The surfaces of one map; parts are computed when first asked for."""

    grid: OccupancyGrid

    @cached_property
    def cells(self) -> Mask:
        """True at the outermost occupied cells that have free ones near by."""
        side = 2 * max(round(FACING_M / self.grid.resolution_m), 1) + 1
        near_free = cv2.dilate(self.grid.free.view(np.uint8), np.ones((side, side), np.uint8)) > 0
        outermost = cv2.dilate(np.logical_not(self.grid.occupied).view(np.uint8), _NEIGHBOURS) > 0
        return np.asarray(self.grid.occupied & near_free & outermost, dtype=np.bool_)

    @cached_property
    def points(self) -> FloatArray:
        """The centres of these cells in the map frame, shape (n, 2)."""
        rows, cols = np.nonzero(self.cells)
        return self.grid.points_at(rows, cols)

    @cached_property
    def length_m(self) -> float:
        """About how many metres of surface the map shows."""
        return np.count_nonzero(self.cells) * self.grid.resolution_m

    @cached_property
    def lines(self) -> tuple[FloatArray, FloatArray]:
        """The angle of the wall's normal at each point, modulo pi, and how sure it is (0 to 1)."""
        doubled, sureness = self._orientations
        angles = (doubled[self.cells] / 2 + self.grid.origin.yaw_rad) % np.pi
        return angles.astype(np.float64), sureness[self.cells].astype(np.float64)

    @cached_property
    def distance_m(self) -> Distances:
        """Metres from each cell to the nearest surface cell."""
        return self._nearest[0]

    @cached_property
    def clear_floor(self) -> FloatArray:
        """The centres of free cells that are far from any surface, shape (n, 2)."""
        rows, cols = np.nonzero(self.grid.free & (self.distance_m > CLEAR_M))
        return self.grid.points_at(rows, cols)

    @cached_property
    def is_seen(self) -> Mask:
        """True where the map shows whether there is a surface."""
        return np.asarray(self.grid.free | (self.distance_m <= SEEN_M), dtype=np.bool_)

    def distances_at(self, points: FloatArray) -> tuple[FloatArray, Mask]:
        """Return the metres from points to the nearest surface, and where the map can tell."""
        rows, cols, is_inside = self._cells_of(points)
        distances = np.where(is_inside, self.distance_m[rows, cols], np.inf)
        return distances, is_inside & self.is_seen[rows, cols]

    def nearest_to(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the nearest surface point of each point, as an index, and about how far it is."""
        rows, cols, is_inside = self._cells_of(points)
        distance_m, labels = self._nearest
        indices = self._index_of_label[labels[rows, cols]]
        return indices, np.where(is_inside, distance_m[rows, cols], np.inf)

    def _cells_of(self, points: FloatArray) -> tuple[IntArray, IntArray, Mask]:
        rows, cols = self.grid.cells_at(points)
        n_rows, n_cols = self.grid.cells.shape
        is_inside = (rows >= 0) & (rows < n_rows) & (cols >= 0) & (cols < n_cols)
        return np.where(is_inside, rows, 0), np.where(is_inside, cols, 0), is_inside

    @cached_property
    def _nearest(self) -> tuple[Distances, NDArray[np.int32]]:
        if not self.cells.any():
            shape = self.grid.cells.shape
            return np.full(shape, np.inf, dtype=np.float32), np.zeros(shape, dtype=np.int32)
        off_cells, labels = cv2.distanceTransformWithLabels(
            np.logical_not(self.cells).view(np.uint8),
            cv2.DIST_L2,
            cv2.DIST_MASK_5,
            labelType=cv2.DIST_LABEL_PIXEL,
        )
        distance_m = np.asarray(off_cells, dtype=np.float32) * np.float32(self.grid.resolution_m)
        return distance_m, np.asarray(labels, dtype=np.int32)

    @cached_property
    def _index_of_label(self) -> IntArray:
        """The number, among the points, of the surface cell that carries each label."""
        labels = self._nearest[1][self.cells]
        indices = np.zeros(int(labels.max(initial=0)) + 1, dtype=np.intp)
        indices[labels] = np.arange(labels.size)
        return indices

    @cached_property
    def _orientations(self) -> tuple[Distances, Distances]:
        """Twice the angle of the walls' normals in the grid, and how much they agree around it.

        This is the structure tensor (Bigun and Granlund, "Optimal orientation detection of linear
        symmetry", 1987).
        """
        sigma = max(SMOOTHING_M / self.grid.resolution_m, 1.0)
        # Free floor against all else: the far side of a wall is drawn in many ways.
        floor = cv2.GaussianBlur(self.grid.free.astype(np.float32), (0, 0), sigma / 2)
        along_cols = cv2.Sobel(floor, cv2.CV_32F, 1, 0)
        along_rows = cv2.Sobel(floor, cv2.CV_32F, 0, 1)
        products = (along_cols**2, along_rows**2, along_cols * along_rows)
        xx, yy, xy = (cv2.GaussianBlur(each, (0, 0), 2 * sigma) for each in products)
        strength = np.hypot(xx - yy, 2 * xy)
        total = np.maximum(xx + yy, np.finfo(np.float32).tiny)
        return np.arctan2(2 * xy, xx - yy), np.asarray(strength / total, dtype=np.float32)


def placed(points: FloatArray, transform: Pose) -> FloatArray:
    """Return points of shape (n, 2) in the outer frame of a transform."""
    cos, sin = np.cos(transform.yaw_rad), np.sin(transform.yaw_rad)
    x = transform.x + cos * points[:, 0] - sin * points[:, 1]
    y = transform.y + sin * points[:, 0] + cos * points[:, 1]
    return np.stack([x, y], axis=1)


TOLERANCE_M = 0.2
"""Walls this near to each other are the same: SLAM bends maps, and door frames vary."""
MOST_POINTS = 8000


@dataclass(frozen=True, slots=True, kw_only=True)
class MapAgreement:
    """Agreement of walls when one map is placed on another.

    Attributes:
        shared_m: Metres of surface, the mean of both maps, that lie where both have seen.
        agreement_ratio: The share of these that have a surface of the other map beside them.
        overlap_ratio: The share of the smaller map's surface that the other map has seen, too.
    """

    shared_m: float
    agreement_ratio: float
    overlap_ratio: float

    @property
    def evidence_m(self) -> float:
        """Metres of surface for this placing, minus those against it."""
        return self.shared_m * (2 * self.agreement_ratio - 1)


def judge(old: MapSurfaces, new: MapSurfaces, transform: Pose) -> MapAgreement:
    """Return how well the old map, laid on the new one by a transform, agrees with it."""
    tolerance_m = max(TOLERANCE_M, 1.5 * max(old.grid.resolution_m, new.grid.resolution_m))
    forth = _count(old, new, transform, tolerance_m)
    back = _count(new, old, transform.inverse(), tolerance_m)
    shared_m = (forth[0] + back[0]) / 2
    agreeing_m = (forth[1] + back[1]) / 2
    smaller = min((forth, old), (back, new), key=lambda each: each[1].length_m)
    length_m = smaller[1].length_m
    return MapAgreement(
        shared_m=shared_m,
        agreement_ratio=agreeing_m / shared_m if shared_m else 0.0,
        overlap_ratio=smaller[0][0] / length_m if length_m else 0.0,
    )


def _count(
    one: MapSurfaces, other: MapSurfaces, transform: Pose, tolerance_m: float
) -> tuple[float, float]:
    """Return the metres of one map's surface that the other has seen, and that agree with it."""
    points = sample(one.points, most=MOST_POINTS)
    if not points.size:
        return 0.0, 0.0
    distances, is_seen = other.distances_at(placed(points, transform))
    metres_each = one.length_m / len(points)
    n_agreeing = np.count_nonzero(is_seen & (distances <= tolerance_m))
    return float(np.count_nonzero(is_seen)) * metres_each, float(n_agreeing) * metres_each


def sample(points: FloatArray, *, most: int) -> FloatArray:
    """Return some of the points, spread evenly over the map, the same ones every time."""
    return points[:: max(-(-len(points) // most), 1)]
