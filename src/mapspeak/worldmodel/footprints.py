"""The parts of the floor that rooms and doors take, as outlines in the map frame."""

import math

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.rooms import Door, Region, RoomMap
from mapspeak.worldmodel.closures import Outline

__all__ = ["outline_around", "outline_of_door", "outlines_of_region"]

SILL_M = 0.3
"""How much of the floor along the way through counts to a door."""
POST_M = 0.15
"""A door's outline goes so far into the walls beside it."""
N_CORNERS = 8


def outlines_of_region(rooms: RoomMap, region: Region) -> tuple[Outline, ...]:
    """Gives the outer borders of a region's parts, through the centres of its border cells."""
    inside = (rooms.labels == region.index).astype(np.uint8)
    contours, _ = cv2.findContours(inside, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    outlines = []
    for contour in contours:
        cols, rows = contour[:, 0, 0].astype(np.intp), contour[:, 0, 1].astype(np.intp)
        points = rooms.grid.points_at(rows, cols).tolist()
        outlines.append(tuple(Point(x, y) for x, y in points))
    return tuple(outlines)


def outline_of_door(rooms: RoomMap, door: Door) -> Outline:
    """Gives a narrow rectangle from post to post of a door."""
    along_rad = _direction_of(rooms, door)
    half_m = door.width_m / 2 + POST_M
    ahead = np.array([math.cos(along_rad), math.sin(along_rad)])
    aside = np.array([-ahead[1], ahead[0]])
    middle = np.array([door.place.x, door.place.y])
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    corners = (middle + a * half_m * ahead + b * SILL_M / 2 * aside for a, b in signs)
    return tuple(Point(*corner.tolist()) for corner in corners)


def outline_around(point: Point, *, radius_m: float) -> Outline:
    """Gives a round outline."""
    angles = (math.tau * (n + 0.5) / N_CORNERS for n in range(N_CORNERS))
    reach_m = radius_m / math.cos(math.pi / N_CORNERS)
    return tuple(
        Point(point.x + reach_m * math.cos(each), point.y + reach_m * math.sin(each))
        for each in angles
    )


def _direction_of(rooms: RoomMap, door: Door) -> float:
    """Gives the direction from post to post: that of the border between the two regions."""
    border = _border_near(rooms, door)
    if len(border) < 2:
        one, other = (rooms.region(each).widest for each in door.region_ids)
        return one.bearing_to(other) + math.pi / 2
    centred = border - border.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    return math.atan2(axes[0, 1], axes[0, 0])


def _border_near(rooms: RoomMap, door: Door) -> FloatArray:
    """Gives the centres of cells of one region that touch the other, near the door."""
    one, other = (rooms.region(each).index for each in door.region_ids)
    touching = cv2.dilate((rooms.labels == other).astype(np.uint8), np.ones((3, 3), np.uint8))
    rows, cols = np.nonzero((rooms.labels == one) & (touching > 0))
    points = rooms.grid.points_at(rows, cols)
    off_m = np.hypot(points[:, 0] - door.place.x, points[:, 1] - door.place.y)
    return points[off_m <= door.width_m / 2 + POST_M]
