"""How far every cell is from the nearest obstacle.

Distances run from cell centre to cell centre: a LiDAR's hits fall anywhere in the cell that they
mark, so that cell's centre is the unbiased place of the surface.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import Mask, OccupancyGrid

__all__ = ["clearance_m", "known_clearance_m"]

Clearance = NDArray[np.float32]


def clearance_m(grid: OccupancyGrid) -> Clearance:
    """Gives for every cell the metres to the nearest occupied cell; infinite where there is none.

    Unknown cells are no obstacle here: a robot that looks into the unknown stands beside it.
    """
    return _distance_to(grid.occupied, grid.resolution_m)


def known_clearance_m(grid: OccupancyGrid) -> Clearance:
    """Gives for every cell the metres to the nearest cell that is not free.

    Unknown cells and everything outside the array count as obstacles.
    """
    padded = np.pad(~grid.free, 1, constant_values=True)
    return np.ascontiguousarray(_distance_to(padded, grid.resolution_m)[1:-1, 1:-1])


def _distance_to(blocked: Mask, resolution_m: float) -> Clearance:
    if not blocked.any():
        return np.full(blocked.shape, np.inf, dtype=np.float32)
    source = np.logical_not(blocked).view(np.uint8)
    transformed = cv2.distanceTransform(source, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    distance = np.asarray(transformed, dtype=np.float32)
    # Its last digit depends on how many threads OpenCV finds free. In cells each distance is the
    # root of a whole number, so that the right digit is known.
    np.square(distance, out=distance)
    np.rint(distance, out=distance)
    np.sqrt(distance, out=distance)
    distance *= np.float32(resolution_m)
    return distance
