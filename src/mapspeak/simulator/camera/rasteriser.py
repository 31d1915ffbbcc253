"""Pinhole projection, and the visible triangle at each pixel.

Instead of clipping at the near plane, a triangle keeps three functions e0, e1, e2 that are linear
on the picture: e_i is the share of corner i, divided by depth. A pixel lies in the triangle where
none of them is negative; their sum is 1 / depth; and any quantity that is linear on the triangle
is, over depth, the same mixture of them (Olano and Greer, "Triangle scan conversion using 2D
homogeneous coordinates", 1997).

The depth buffer is filled tile by tile. Every triangle is paired with the tiles that it may touch.
A triangle that covers a whole tile hides everything behind it there, so most of what is hidden
falls away before any pixel is looked at. What is left is compared pixel by pixel.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Pose
from mapspeak.simulator.camera.scene import Scene

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

NEAR_M = 0.05
_OVERLAP_PX = 0.01
"""Triangles extend over their edges by this, so that rounding leaves no gaps."""
_THINNEST = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Viewpoint:
    """Pose and field of view of a level pinhole camera.

    Attributes:
        pose: In the world; it looks along its x axis.
        height_m: Above the floor.
        horizontal_fov_rad: The angle between the left and the right edge of the picture.
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
        """Its position in the world, shape (3,)."""
        return np.array([self.pose.x, self.pose.y, self.height_m])

    def with_finer_pixels(self, factor: int) -> "Viewpoint":
        """Return the same view with that many times the columns and rows."""
        return replace(self, width_px=self.width_px * factor, height_px=self.height_px * factor)


def project(corners: FloatArray, viewpoint: Viewpoint) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return which triangles of shape (n, 3, 3) face the camera and touch its view.

    With them come their edge functions e_i(x, y) = edges[:, i] @ (x, y, 1), shape (n, 3, 3), where
    pixel centres are at +0.5, and the left, top, right and bottom of each on the picture, shape
    (n, 4).
    """
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
    return chosen[faces_camera][on_picture], edges[on_picture], bounds[on_picture]


def widen(edges: FloatArray) -> FloatArray:
    """Return edge functions that reach a hundredth of a pixel over the edge."""
    wide = edges.copy()
    wide[..., 2] += _OVERLAP_PX * (np.abs(edges[..., 0]) + np.abs(edges[..., 1]))
    return wide


def find_in_view(
    centres: FloatArray, radii_m: FloatArray, viewpoint: Viewpoint
) -> NDArray[np.bool_]:
    """Return True for balls, with centres of shape (n, 3), that touch the view."""
    half_fov = viewpoint.horizontal_fov_rad / 2
    half_rise = math.atan(math.tan(half_fov) * viewpoint.height_px / viewpoint.width_px)
    right, down, ahead = _in_camera(centres, viewpoint)
    beside = np.abs(right) * math.cos(half_fov) - ahead * math.sin(half_fov)
    above = np.abs(down) * math.cos(half_rise) - ahead * math.sin(half_rise)
    return np.asarray((ahead > -radii_m) & (beside < radii_m) & (above < radii_m))


def _in_camera(
    points: FloatArray, viewpoint: Viewpoint
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return how far points are to the right, below and ahead of the camera."""
    pose = viewpoint.pose
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    dx, dy = points[..., 0] - pose.x, points[..., 1] - pose.y
    return sin * dx - cos * dy, viewpoint.height_m - points[..., 2], cos * dx + sin * dy


def _to_picture(corners: FloatArray, viewpoint: Viewpoint) -> FloatArray:
    """Return (x * depth, y * depth, depth) with x, y in pixels from the picture's upper left."""
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
    """Return the bounds of the part beyond the near plane, clipped to the picture."""
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


TILE_PX = 8
NOTHING = -1


@dataclass(frozen=True, slots=True, eq=False)
class Visibility:
    """The visible triangle at each pixel.

    Attributes:
        triangles: Indices of the scene's triangles that may be visible, shape (n,).
        edges: Their edge functions, as `project` returns them, shape (n, 3, 3).
        rows: Index into these at each pixel, shape (height, width); -1 for nothing.
        inverse_depth: One over the depth along the optical axis, 1/m, likewise; 0 for nothing.
    """

    triangles: IntArray
    edges: FloatArray
    rows: NDArray[np.int32]
    inverse_depth: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class _Pairs:
    """Triangles and the tiles they may touch.

    Attributes:
        rows: Of the triangles' edge functions.
        columns_px: The left edge of the tile.
        lines_px: The top edge of the tile.
    """

    rows: IntArray
    columns_px: IntArray
    lines_px: IntArray

    def chosen(self, which: NDArray[np.bool_] | IntArray) -> "_Pairs":
        return _Pairs(self.rows[which], self.columns_px[which], self.lines_px[which])


def look(scene: Scene, viewpoint: Viewpoint) -> Visibility:
    """Return the visible triangle at each pixel of a view."""
    in_view = find_in_view(scene.group_centres, scene.group_radii_m, viewpoint)
    chosen = np.flatnonzero(in_view[scene.groups])
    triangles, edges, bounds_px = project(scene.triangles.corners[chosen], viewpoint)
    rows, inverse_depth = find_nearest(edges, bounds_px, viewpoint)
    return Visibility(chosen[triangles], edges, rows, inverse_depth)


def find_nearest(
    edges: FloatArray, bounds_px: FloatArray, viewpoint: Viewpoint
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Return which row of projected triangles is nearest at each pixel, and one over its depth."""
    pairs = _pair_with_tiles(bounds_px)
    touches, covers = _compare_tiles(pairs, widen(edges))
    pairs, covers = pairs.chosen(touches), covers[touches]
    in_front = _is_in_front(pairs, covers, edges.sum(axis=1), viewpoint)
    return _compare_pixels(pairs.chosen(in_front), covers[in_front], edges, viewpoint)


def _pair_with_tiles(bounds_px: FloatArray) -> _Pairs:
    low = np.floor(bounds_px[:, :2] / TILE_PX).astype(np.intp)
    high = np.ceil(bounds_px[:, 2:] / TILE_PX).astype(np.intp)
    size = np.maximum(high - low, 1)
    n_tiles = size[:, 0] * size[:, 1]
    rows = np.repeat(np.arange(len(bounds_px)), n_tiles)
    nth = np.arange(len(rows)) - np.repeat(np.cumsum(n_tiles) - n_tiles, n_tiles)
    line, column = np.divmod(nth, size[rows, 0])
    columns_px = (low[rows, 0] + column) * TILE_PX
    lines_px = (low[rows, 1] + line) * TILE_PX
    return _Pairs(rows, columns_px, lines_px)


def _compare_tiles(pairs: _Pairs, edges: FloatArray) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which tiles are not wholly beyond an edge, and which their triangle covers."""
    touches = np.ones(len(pairs.rows), dtype=bool)
    covers = touches.copy()
    for i in range(3):
        lowest, highest = _range_on_tiles(edges[:, i], pairs)
        touches &= highest >= 0
        covers &= lowest >= 0
    return touches, covers


def _is_in_front(
    pairs: _Pairs, covers: NDArray[np.bool_], inverse_depth: FloatArray, viewpoint: Viewpoint
) -> NDArray[np.bool_]:
    """Return False for pairs that lie behind a triangle which covers the tile."""
    farthest, nearest = _range_on_tiles(inverse_depth, pairs)
    n_lines, n_columns = _count_tiles(viewpoint)
    tiles = pairs.lines_px // TILE_PX * n_columns + pairs.columns_px // TILE_PX
    hidden_beyond = np.zeros(n_columns * n_lines)
    np.maximum.at(hidden_beyond, tiles[covers], farthest[covers])
    return np.asarray(nearest >= hidden_beyond[tiles])


def _count_tiles(viewpoint: Viewpoint) -> tuple[int, int]:
    """Return how many lines and columns of tiles hold the picture."""
    return -(-viewpoint.height_px // TILE_PX), -(-viewpoint.width_px // TILE_PX)


def _range_on_tiles(plane: FloatArray, pairs: _Pairs) -> tuple[FloatArray, FloatArray]:
    """Return the least and greatest value of linear functions on the pixel centres of tiles."""
    a, b, c = plane[pairs.rows].T
    at_first = a * (pairs.columns_px + 0.5) + b * (pairs.lines_px + 0.5) + c
    across, along = a * (TILE_PX - 1), b * (TILE_PX - 1)
    lowest = at_first + np.minimum(across, 0) + np.minimum(along, 0)
    highest = at_first + np.maximum(across, 0) + np.maximum(along, 0)
    return lowest, highest


def _compare_pixels(
    pairs: _Pairs, covers: NDArray[np.bool_], edges: FloatArray, viewpoint: Viewpoint
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    n_lines, n_columns = _count_tiles(viewpoint)
    rows = np.full((n_columns * n_lines, TILE_PX, TILE_PX), NOTHING, dtype=np.int32)
    nearest = np.zeros((n_columns * n_lines, TILE_PX, TILE_PX), dtype=np.float32)
    tiles = pairs.lines_px // TILE_PX * n_columns + pairs.columns_px // TILE_PX
    wide_edges, inverse_depth = widen(edges), edges.sum(axis=1)
    for layer in _layers(tiles):
        tile, row = tiles[layer], pairs.rows[layer]
        columns_px, lines_px = pairs.columns_px[layer], pairs.lines_px[layer]
        depth, so_far = _on_pixels(inverse_depth[row], columns_px, lines_px), nearest[tile]
        wins = depth > so_far
        partial = np.flatnonzero(~covers[layer])
        sides = _on_pixels(
            wide_edges[row[partial]], columns_px[partial, None], lines_px[partial, None]
        )
        wins[partial] &= sides.min(axis=1) >= 0
        nearest[tile] = np.where(wins, depth, so_far)
        rows[tile] = np.where(wins, row[:, None, None].astype(np.int32), rows[tile])
    shape = (n_lines, n_columns)
    return _as_picture(rows, shape, viewpoint), _as_picture(nearest, shape, viewpoint)


def _layers(tiles: IntArray) -> list[IntArray]:
    """Split pairs so that no tile comes twice in a layer."""
    order = np.argsort(tiles, kind="stable")
    ordered = tiles[order]
    starts = np.flatnonzero(np.diff(ordered, prepend=-1))
    rank = np.arange(len(tiles)) - np.repeat(starts, np.diff(starts, append=len(tiles)))
    by_rank = np.argsort(rank, kind="stable")
    ends = np.cumsum(np.bincount(rank)) if len(rank) else np.empty(0, dtype=np.intp)
    return np.split(order[by_rank], ends[:-1]) if len(ends) else []


def _on_pixels(planes: FloatArray, columns_px: IntArray, lines_px: IntArray) -> NDArray[np.float32]:
    """Return linear functions, shape (..., 3), at every pixel of their tiles: (..., tile, tile)."""
    a, b, c = planes[..., 0], planes[..., 1], planes[..., 2]
    at_corner = a * columns_px + b * lines_px + c
    steps = np.arange(TILE_PX) + 0.5
    along_line = (at_corner[..., None] + a[..., None] * steps).astype(np.float32)
    down = (b[..., None] * steps).astype(np.float32)
    return np.asarray(along_line[..., None, :] + down[..., :, None])


def _as_picture(tiles: NDArray[Any], shape: tuple[int, int], viewpoint: Viewpoint) -> NDArray[Any]:
    picture = tiles.reshape(*shape, TILE_PX, TILE_PX).swapaxes(1, 2)
    flat = picture.reshape(shape[0] * TILE_PX, shape[1] * TILE_PX)
    return flat[: viewpoint.height_px, : viewpoint.width_px]
