"""Whether the robot gets through a door, and where."""

import math

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.paths import DistanceField
from mapspeak.spatial.rooms import Door, RoomMap

__all__ = ["find_crossing"]

AROUND_M = 0.5
"""So far beyond the posts and the robot's own radius both sides of a door are looked at."""


def find_crossing(rooms: RoomMap, distances: DistanceField, door: Door) -> Point | None:
    """Finds the place in a door where the robot passes from one side to the other, or None.

    That the middle of a door can be reached is not enough: the robot may stand before it.
    """
    reach_m = door.width_m / 2 + distances.radius_m + AROUND_M
    reach = math.ceil(reach_m / rooms.grid.resolution_m)
    cell = rooms.grid.cell_at(door.place)
    top, left = max(cell.row - reach, 0), max(cell.col - reach, 0)
    labels = rooms.labels[top : cell.row + reach + 1, left : cell.col + reach + 1]
    rows = np.arange(top, top + labels.shape[0])[:, np.newaxis]
    cols = np.arange(left, left + labels.shape[1])
    is_reached = np.isfinite(distances.distances_at(rows, cols))
    _, parts = cv2.connectedComponents(is_reached.astype(np.uint8), connectivity=8)
    sides = [rooms.region(region_id).index for region_id in door.region_ids]
    one, other = (np.unique(parts[is_reached & (labels == index)]) for index in sides)
    crossing = np.isin(parts, np.intersect1d(one, other)) & is_reached
    if not crossing.any():
        return None
    at_rows, at_cols = np.nonzero(crossing)
    points = rooms.grid.points_at(at_rows + top, at_cols + left)
    off_m = np.hypot(points[:, 0] - door.place.x, points[:, 1] - door.place.y)
    x, y = points[int(np.argmin(off_m))].tolist()
    return Point(x, y)
