"""How well two maps agree where both have seen the building."""

from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Pose
from mapspeak.semantic.alignment.surfaces import MapSurfaces, placed
from mapspeak.spatial.grid import FloatArray

__all__ = ["Agreement", "judge"]

TOLERANCE_M = 0.2
"""Walls so near to each other are the same: SLAM bends, and door frames are drawn variously."""
MOST_POINTS = 8000


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """How well walls fit when one map is laid on another.

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
        """Metres of surface that speak for this placing, less those that speak against it."""
        return self.shared_m * (2 * self.agreement_ratio - 1)


def judge(old: MapSurfaces, new: MapSurfaces, transform: Pose) -> Agreement:
    """Gives how well the old map, laid on the new one by a transform, agrees with it."""
    tolerance_m = max(TOLERANCE_M, 1.5 * max(old.grid.resolution_m, new.grid.resolution_m))
    forth = _count(old, new, transform, tolerance_m)
    back = _count(new, old, transform.inverse(), tolerance_m)
    shared_m = (forth[0] + back[0]) / 2
    agreeing_m = (forth[1] + back[1]) / 2
    smaller = min((forth, old), (back, new), key=lambda each: each[1].length_m)
    length_m = smaller[1].length_m
    return Agreement(
        shared_m=shared_m,
        agreement_ratio=agreeing_m / shared_m if shared_m else 0.0,
        overlap_ratio=smaller[0][0] / length_m if length_m else 0.0,
    )


def _count(
    one: MapSurfaces, other: MapSurfaces, transform: Pose, tolerance_m: float
) -> tuple[float, float]:
    """Gives the metres of one map's surface that the other has seen, and that agree with it."""
    points = _sample(one.points)
    if not points.size:
        return 0.0, 0.0
    distances, is_seen = other.distances_at(placed(points, transform))
    metres_each = one.length_m / len(points)
    n_agreeing = np.count_nonzero(is_seen & (distances <= tolerance_m))
    return float(np.count_nonzero(is_seen)) * metres_each, float(n_agreeing) * metres_each


def _sample(points: FloatArray) -> FloatArray:
    """Gives some of the points, spread evenly over the map, the same ones every time."""
    return points[:: max(-(-len(points) // MOST_POINTS), 1)]
