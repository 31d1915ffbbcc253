"""What the laser and the bumper feel of a model: convex outlines of its solid parts."""

from collections.abc import Iterable

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point
from mapspeak.simulator.models.parts import FloatArray, Part

Contour = NDArray[np.float32]
SMALLEST_AREA_M2 = 1e-5
ROUNDING_M = 0.003


def find_outlines(
    parts: Iterable[Part], low_m: float, high_m: float
) -> tuple[tuple[Point, ...], ...]:
    """Gives the counter-clockwise outlines of the solid parts between two heights of their frame.

    An outline that lies within another one is left out.
    """
    slices = (_points_between(part.corners, low_m, high_m) for part in parts if part.is_solid)
    hulls = [_hull(points) for points in slices if len(points) >= 3]
    large = [hull for hull in hulls if cv2.contourArea(hull) > SMALLEST_AREA_M2]
    large.sort(key=cv2.contourArea, reverse=True)
    kept: list[Contour] = []
    for hull in large:
        if not any(_holds(other, hull) for other in kept):
            kept.append(hull)
    return tuple(tuple(Point(float(x), float(y)) for x, y in hull) for hull in kept)


def _points_between(corners: FloatArray, low_m: float, high_m: float) -> FloatArray:
    """Gives (x, y) of what spans the triangles' part between two heights."""
    points = corners.reshape(-1, 3)
    found = [points[(points[:, 2] >= low_m) & (points[:, 2] <= high_m)]]
    start = points
    end = np.roll(corners, -1, axis=1).reshape(-1, 3)
    for height in (low_m, high_m):
        crosses = (start[:, 2] < height) != (end[:, 2] < height)
        a, b = start[crosses], end[crosses]
        share = (height - a[:, 2:]) / (b[:, 2:] - a[:, 2:])
        found.append(a + share * (b - a))
    return np.concatenate(found)[:, :2]


def _hull(points: FloatArray) -> Contour:
    hull = cv2.convexHull(points.astype(np.float32), clockwise=False)
    return np.asarray(cv2.approxPolyDP(hull, ROUNDING_M, closed=True))[:, 0, :].astype(np.float32)


def _holds(outer: Contour, inner: Contour) -> bool:
    return all(
        cv2.pointPolygonTest(outer, (float(x), float(y)), measureDist=True) > -ROUNDING_M
        for x, y in inner
    )
