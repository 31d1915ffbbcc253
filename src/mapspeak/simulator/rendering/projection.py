"""The pinhole: from triangles in the world to edge functions on the picture.

Instead of clipping at the near plane, a triangle keeps three functions e0, e1, e2 that are linear
on the picture: e_i is the share of corner i, divided by depth. A pixel lies in the triangle where
none of them is negative; their sum is 1 / depth; and any quantity that is linear on the triangle
is, over depth, the same mixture of them (Olano and Greer, "Triangle scan conversion using 2D
homogeneous coordinates", 1997).
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Pose

__all__ = ["Projection", "Viewpoint", "find_in_view", "project", "widen"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

NEAR_M = 0.05
_OVERLAP_PX = 0.01
"""How far triangles reach over their edges, so that rounding leaves no gap between neighbours."""
_THINNEST = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Viewpoint:
    """Where a level pinhole camera stands, and what it takes in.

    Attributes:
        pose: In the world; it looks along its x axis.
        height_m: Above the floor.
        horizontal_fov_rad: The angle between the left and the right edge of the picture.
        width_px: Columns.
        height_px: Rows.
    """

    pose: Pose
    height_m: float
    horizontal_fov_rad: float
    width_px: int
    height_px: int

    @property
    def focal_px(self) -> float:
        """The distance of the picture plane, in pixels."""
        return self.width_px / 2 / math.tan(self.horizontal_fov_rad / 2)

    @property
    def place(self) -> FloatArray:
        """Where it is in the world, shape (3,)."""
        return np.array([self.pose.x, self.pose.y, self.height_m])

    def with_finer_pixels(self, factor: int) -> "Viewpoint":
        """Gives the same view with that many times the columns and rows."""
        return replace(self, width_px=self.width_px * factor, height_px=self.height_px * factor)


@dataclass(frozen=True, slots=True, eq=False)
class Projection:
    """The triangles that may be seen.

    Attributes:
        triangles: Which of the triangles given, shape (n,).
        edges: e_i(x, y) = edges[:, i] @ (x, y, 1), shape (n, 3, 3); pixel centres are at +0.5.
        bounds_px: Left, top, right and bottom of each on the picture, shape (n, 4).
    """

    triangles: IntArray
    edges: FloatArray
    bounds_px: FloatArray


def project(corners: FloatArray, viewpoint: Viewpoint) -> Projection:
    """Gives those triangles of shape (n, 3, 3) that face the camera and touch its view."""
    homogeneous = _to_picture(corners, viewpoint)
    chosen = np.flatnonzero(_is_in_view(homogeneous, viewpoint))
    homogeneous = homogeneous[chosen]
    first, second, third = homogeneous[:, 0], homogeneous[:, 1], homogeneous[:, 2]
    crosses = np.stack(
        [np.cross(second, third), np.cross(third, first), np.cross(first, second)], axis=1
    )
    volume = np.einsum("ij,ij->i", first, crosses[:, 0])
    faces_camera = volume < -_THINNEST
    edges = crosses[faces_camera] / volume[faces_camera, None, None]
    bounds = _bound(homogeneous[faces_camera], viewpoint)
    on_picture = (bounds[:, 0] < bounds[:, 2]) & (bounds[:, 1] < bounds[:, 3])
    return Projection(chosen[faces_camera][on_picture], edges[on_picture], bounds[on_picture])


def widen(edges: FloatArray) -> FloatArray:
    """Gives edge functions that reach a hundredth of a pixel over the edge."""
    wide = edges.copy()
    wide[..., 2] += _OVERLAP_PX * (np.abs(edges[..., 0]) + np.abs(edges[..., 1]))
    return wide


def find_in_view(
    centres: FloatArray, radii_m: FloatArray, viewpoint: Viewpoint
) -> NDArray[np.bool_]:
    """Tells which balls, with centres of shape (n, 3), touch the view."""
    half_fov = viewpoint.horizontal_fov_rad / 2
    half_rise = math.atan(math.tan(half_fov) * viewpoint.height_px / viewpoint.width_px)
    right, down, ahead = _in_camera(centres, viewpoint)
    beside = np.abs(right) * math.cos(half_fov) - ahead * math.sin(half_fov)
    above = np.abs(down) * math.cos(half_rise) - ahead * math.sin(half_rise)
    return np.asarray((ahead > -radii_m) & (beside < radii_m) & (above < radii_m))


def _in_camera(
    points: FloatArray, viewpoint: Viewpoint
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Gives how far points are to the right, below and ahead of the camera."""
    pose = viewpoint.pose
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    dx, dy = points[..., 0] - pose.x, points[..., 1] - pose.y
    return sin * dx - cos * dy, viewpoint.height_m - points[..., 2], cos * dx + sin * dy


def _to_picture(corners: FloatArray, viewpoint: Viewpoint) -> FloatArray:
    """Gives (x * depth, y * depth, depth) with x, y in pixels from the picture's upper left."""
    right, down, ahead = _in_camera(corners, viewpoint)
    x = viewpoint.focal_px * right + viewpoint.width_px / 2 * ahead
    y = viewpoint.focal_px * down + viewpoint.height_px / 2 * ahead
    return np.stack([x, y, ahead], axis=-1)


def _is_in_view(homogeneous: FloatArray, viewpoint: Viewpoint) -> NDArray[np.bool_]:
    x, y, depth = homogeneous[..., 0], homogeneous[..., 1], homogeneous[..., 2]
    is_outside = (
        (depth < NEAR_M).all(axis=1)
        | (x < 0).all(axis=1)
        | (y < 0).all(axis=1)
        | (x > viewpoint.width_px * depth).all(axis=1)
        | (y > viewpoint.height_px * depth).all(axis=1)
    )
    return np.asarray(~is_outside)


def _bound(homogeneous: FloatArray, viewpoint: Viewpoint) -> FloatArray:
    """Gives the bounds of what lies beyond the near plane, cut to the picture."""
    following = np.roll(homogeneous, -1, axis=1)
    depth, next_depth = homogeneous[..., 2], following[..., 2]
    crosses = (depth < NEAR_M) != (next_depth < NEAR_M)
    share = (NEAR_M - depth) / np.where(crosses, next_depth - depth, 1.0)
    cuts = homogeneous + share[..., None] * (following - homogeneous)
    points = np.concatenate([homogeneous, cuts], axis=1)
    counts = np.concatenate([depth >= NEAR_M, crosses], axis=1)
    xy = points[..., :2] / np.where(counts, points[..., 2], 1.0)[..., None]
    low = np.where(counts[..., None], xy, np.inf).min(axis=1)
    high = np.where(counts[..., None], xy, -np.inf).max(axis=1)
    size = (viewpoint.width_px, viewpoint.height_px)
    return np.concatenate([np.clip(low, 0, size), np.clip(high, 0, size)], axis=1)
