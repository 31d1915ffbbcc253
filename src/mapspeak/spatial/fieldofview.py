"""What a camera shows from a place: the floor and the walls in each heading, and what is new."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.spatial.grid import FloatArray, IntArray, Mask, OccupancyGrid
from mapspeak.spatial.visibility import cast_rays

SIGHT_M = 8.0
"""A wall that is farther away is in a picture without being shown by it."""
HALF_VIEW_RAD = math.radians(30.0)
"""Half the opening of a common camera, where the robot does not say."""
N_RAYS = 720
"""At the end of sight, neighbouring rays are 7 cm apart."""
_RAY_RAD = math.tau / N_RAYS
_ANGLES_RAD: FloatArray = np.arange(N_RAYS, dtype=np.float64) * _RAY_RAD
NO_WALL = -1
JOINED_M = 0.8
"""Neighbouring rays meet one wall as far apart at the end of sight, at 5 degrees to it."""
LEAST_OUTLINE_M = 0.6
"""Shorter lines, there and back, are crumbs."""
AT_ONCE = 64
"""Places whose rays are held in memory together."""
N_HEADINGS = 72
"""In which floor is measured, counter-clockwise from the x axis of the map."""


@dataclass(frozen=True, slots=True)
class CameraView:
    """Where a picture was taken, and how wide it is.

    Attributes:
        pose: In the map frame; the camera looks along its heading.
        is_ahead: It is the camera that a robot turns to what it is to look at.
    """

    pose: Pose
    half_view_rad: float = HALF_VIEW_RAD
    is_ahead: bool = True


def find_half_view_rad(views: Sequence[CameraView]) -> float:
    """Return half the opening of the camera that looks ahead, or of a common one.

    Args:
        views: The pictures so far, the latest last.
    """
    ahead = (view.half_view_rad for view in reversed(views) if view.is_ahead)
    return next(ahead, HALF_VIEW_RAD)


@dataclass(frozen=True, slots=True, eq=False)
class Panorama:
    """What rays to all sides of a place end at, counter-clockwise from the x axis of the map.

    A wall is known by the free cell before it, so that its two sides are two walls.

    Attributes:
        walls: The flat index of that cell for each ray, shape (N_RAYS,); NO_WALL where the ray ends
            in the unknown or meets nothing within sight.
        metres: How long each ray is.
        is_open: The ray ends in the unknown.
    """

    grid: OccupancyGrid
    walls: IntArray = field(repr=False)
    metres: FloatArray = field(repr=False)
    is_open: Mask = field(repr=False)

    def ends_before(self, place: Point) -> FloatArray:
        """Return a point just before the end of each ray from their place, shape (N_RAYS, 2)."""
        far_m = np.maximum(self.metres - 1.5 * self.grid.resolution_m, 0.0)[:, None]
        along = np.column_stack([np.cos(_ANGLES_RAD), np.sin(_ANGLES_RAD)])
        return np.asarray([place.x, place.y] + far_m * along, dtype=np.float64)

    def wall_m_by_heading(self, half_view_rad: float, *, but: Mask | None = None) -> FloatArray:
        """Return how much wall a picture in the direction of each ray would show, in metres.

        Args:
            but: Walls that do not count, as a mask of the grid.
        """
        counts = self.walls != NO_WALL
        if but is not None:
            counts &= ~but.ravel()[self.walls]
        # Each cell counts once, for the first ray that meets it.
        first = np.zeros(N_RAYS, dtype=np.float64)
        _, at = np.unique(np.where(counts, self.walls, NO_WALL), return_index=True)
        first[at] = self.grid.resolution_m
        return sum_by_heading(np.where(counts, first, 0.0), half_view_rad)


def sum_by_heading(by_ray: FloatArray, half_view_rad: float) -> FloatArray:
    """Sum what each ray counts over the rays of a picture in its direction.

    Args:
        by_ray: All around, evenly spread, along the last axis.
    """
    n_rays = by_ray.shape[-1]
    half = min(max(round(half_view_rad / (math.tau / n_rays)), 1), (n_rays - 1) // 2)
    around = np.concatenate([by_ray[..., -half:], by_ray, by_ray[..., :half]], axis=-1)
    before = [(0, 0)] * (by_ray.ndim - 1)
    sums = np.cumsum(np.pad(around, [*before, (1, 0)]), axis=-1)
    return np.asarray(sums[..., 2 * half + 1 :] - sums[..., : -2 * half - 1], dtype=np.float64)


def floor_by_heading(
    grid: OccupancyGrid,
    floor: Mask,
    places: FloatArray,
    half_view_rad: float,
    *,
    reach_m: float = SIGHT_M,
) -> FloatArray:
    """Return how much of some floor pictures from places show, by heading, in m2.

    Args:
        floor: What counts, as a mask of the grid.
        places: Points, shape (n, 2).

    Returns:
        Shape (n, N_HEADINGS).
    """
    angles: FloatArray = np.arange(N_HEADINGS, dtype=np.float64) * (math.tau / N_HEADINGS)
    # No step is longer than a cell, so that no ray passes a wall between two of them.
    step_m = grid.resolution_m
    steps_m = np.arange(step_m, reach_m + 1e-9, step_m)
    rays = cast_rays(
        grid.cells.shape,
        grid.fractional_cells_at(places),
        angles_rad=angles - grid.origin.yaw_rad,
        steps=steps_m / grid.resolution_m,
    )
    counts = rays.follow(grid.free) & floor.ravel()[rays.cells]
    return sum_by_heading(counts @ (steps_m * step_m * math.tau / N_HEADINGS), half_view_rad)


def heading_index(yaw_rad: float) -> int:
    """Return the index of the heading nearest to a direction."""
    return round(yaw_rad / (math.tau / N_HEADINGS)) % N_HEADINGS


def heading_rad(index: int) -> float:
    """Return a heading by its index, from -pi to pi."""
    return math.remainder(index * math.tau / N_HEADINGS, math.tau)


def ray_at(yaw_rad: float) -> int:
    """Return the index of the ray in a direction of the map frame."""
    return round(yaw_rad / _RAY_RAD) % N_RAYS


def heading_of(ray: int) -> float:
    """Return the direction of a ray, from -pi to pi."""
    return math.remainder(float(_ANGLES_RAD[ray]), math.tau)


def look_all_around(grid: OccupancyGrid, place: Point) -> Panorama:
    """Follow rays from a place to all sides until they end."""
    walls, metres, is_open = _follow(grid, np.array([[place.x, place.y]]), _ANGLES_RAD)
    return Panorama(grid, walls[0], metres[0], is_open[0])


def is_in_sight(grid: OccupancyGrid, place: Point, target: Point, *, own_m: float) -> bool:
    """Return True when free floor lies between a place and a target near enough to be looked at.

    Args:
        own_m: So near to the target nothing hides it: it is solid itself, or hangs on a wall.
    """
    away_m = place.distance_to(target)
    if away_m > SIGHT_M:
        return False
    bearing = np.array([place.bearing_to(target)])
    _, metres, _ = _follow(grid, np.array([[place.x, place.y]]), bearing)
    return bool(metres[0, 0] >= away_m - own_m)


def mask_pictured(grid: OccupancyGrid, views: Iterable[CameraView]) -> Mask:
    """Mark the walls that pictures show, by the free cells before them."""
    shown = np.zeros(grid.cells.shape, dtype=np.uint8)
    most = round(JOINED_M / grid.resolution_m)
    along_walls = cv2.dilate(grid.occupied.view(np.uint8), np.ones((5, 5), np.uint8)) > 0
    for view in views:
        n_rays = math.ceil(2 * view.half_view_rad / _RAY_RAD)
        turned = np.linspace(-view.half_view_rad, view.half_view_rad, n_rays)
        here = np.array([[view.pose.x, view.pose.y]])
        walls = _follow(grid, here, view.pose.yaw_rad + turned)[0][0]
        shown.ravel()[walls[walls != NO_WALL]] = 1
        shown.ravel()[_join_hits(walls, along_walls, most=most)] = 1
    # A map moves its walls by a cell as it grows.
    return np.asarray((cv2.dilate(shown, np.ones((3, 3), np.uint8)) > 0) & grid.free)


def _join_hits(walls: IntArray, along_walls: Mask, *, most: int) -> IntArray:
    """Return the cells between the hits of neighbouring rays where a wall joins the hits.

    Rays that graze a wall meet it far apart.

    Args:
        walls: The cells that the rays end at, or NO_WALL, shape (n,).
        along_walls: The cells that are next to walls, or nearly.
        most: Of cells that may lie between two hits.
    """
    n_cols = along_walls.shape[1]
    cells = np.stack(np.divmod(walls, n_cols), axis=-1)
    is_hit = (walls[1:] != NO_WALL) & (walls[:-1] != NO_WALL)
    apart = np.abs(np.diff(cells, axis=0)).max(axis=1)
    at = np.flatnonzero(is_hit & (apart > 1) & (apart <= most))
    shares = np.linspace(0.0, 1.0, most + 1)[:, None]
    lines = np.rint(cells[at, None] + shares * (cells[at + 1] - cells[at])[:, None]).astype(np.intp)
    between = lines[..., 0] * n_cols + lines[..., 1]
    is_along = along_walls.ravel()[between].all(axis=1)
    return np.asarray(between[is_along].ravel(), dtype=np.intp)


def measure_pictured(grid: OccupancyGrid, shown: Mask, places: FloatArray) -> float:
    """Return the share of the walls in sight of some places that pictures show; 1 without walls.

    Args:
        shown: From `mask_pictured`.
        places: Points, shape (n, 2); a ray every few degrees is followed from each.
    """
    in_sight = np.zeros(grid.cells.size, dtype=np.bool_)
    for walls, _ in _follow_from(grid, places):
        in_sight[walls[walls != NO_WALL]] = True
    n_walls = np.count_nonzero(in_sight)
    return np.count_nonzero(in_sight & shown.ravel()) / n_walls if n_walls else 1.0


def outline_unpictured(grid: OccupancyGrid, shown: Mask) -> list[FloatArray]:
    """Return lines along the walls that no picture shows, each of shape (n, 2), in metres.

    Args:
        shown: From `mask_pictured`.
    """
    beside = cv2.dilate(grid.occupied.view(np.uint8), np.ones((3, 3), np.uint8)) > 0
    return trace_outlines(grid, beside & grid.free & ~shown, least_m=LEAST_OUTLINE_M)


def trace_outlines(grid: OccupancyGrid, cells: Mask, *, least_m: float) -> list[FloatArray]:
    """Return rings around some cells of a grid, each of shape (n, 2), in metres.

    Args:
        least_m: Shorter ones are left out.
    """
    marked = cells.astype(np.uint8)
    contours, _ = cv2.findContours(marked, cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)
    return [
        grid.points_at(*contour[:, 0, ::-1].T.astype(np.intp))
        for contour in contours
        if cv2.arcLength(contour, closed=True) * grid.resolution_m >= least_m
    ]


@dataclass(frozen=True, slots=True, eq=False)
class WallsByHeading:
    """The walls that rays from places end at, of shape (places, N_HEADINGS).

    Attributes:
        walls: The last free cell of each ray, or NO_WALL.
        metres: How wide each wall looks, which is no more than it is long.
    """

    walls: IntArray
    metres: FloatArray

    def measure_new(self, shown: Mask) -> FloatArray:
        """Return how much wall that no picture shows lies in each heading, in metres.

        Args:
            shown: From `mask_pictured`.
        """
        is_new = (self.walls != NO_WALL) & ~shown.ravel()[self.walls]
        return np.where(is_new, self.metres, 0.0)


def find_walls_by_heading(grid: OccupancyGrid, places: FloatArray) -> WallsByHeading:
    """Find the walls around some places, shape (n, 2)."""
    found = list(_follow_from(grid, places))
    none = np.zeros((0, N_HEADINGS))
    walls = np.concatenate([none.astype(np.intp), *(each for each, _ in found)])
    metres = np.concatenate([none, *(each for _, each in found)])
    return WallsByHeading(walls, metres * (math.tau / N_HEADINGS))


def _follow_from(grid: OccupancyGrid, places: FloatArray) -> Iterator[tuple[IntArray, FloatArray]]:
    """Follow a ray in each heading from each place: where they end at walls, and their lengths."""
    angles = np.arange(N_HEADINGS, dtype=np.float64) * (math.tau / N_HEADINGS)
    for start in range(0, len(places), AT_ONCE):
        walls, metres, _ = _follow(grid, places[start : start + AT_ONCE], angles)
        yield walls, metres


def _follow(
    grid: OccupancyGrid, places: FloatArray, angles_rad: FloatArray
) -> tuple[IntArray, FloatArray, Mask]:
    """Follow rays from places to where they end; all results have the shape (places, rays).

    Returns:
        The last free cell of a ray that ends at a wall, else NO_WALL; its length in metres; True
        where it ends in the unknown.
    """
    # No step is longer than a cell, so that no ray passes a wall between two of them.
    steps_m = np.arange(0.0, SIGHT_M, grid.resolution_m * 0.9)
    rays = cast_rays(
        grid.cells.shape,
        grid.fractional_cells_at(places),
        angles_rad=angles_rad - grid.origin.yaw_rad,
        steps=steps_m / grid.resolution_m,
    )
    n_free = rays.follow(grid.free).sum(axis=2)
    has_end = n_free < steps_m.size
    end = np.minimum(n_free, steps_m.size - 1)[..., None]
    before = np.maximum(n_free - 1, 0)[..., None]
    is_inside = np.take_along_axis(rays.is_inside, end, axis=2)[..., 0]
    met = np.take_along_axis(rays.cells, end, axis=2)[..., 0]
    at_wall = has_end & (n_free > 0) & is_inside & grid.occupied.ravel()[met]
    walls = np.take_along_axis(rays.cells, before, axis=2)[..., 0]
    return np.where(at_wall, walls, NO_WALL), steps_m[end[..., 0]], has_end & ~at_wall
