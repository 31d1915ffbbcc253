"""Where to stand to look at a thing: near it, on the side it was seen from, facing it."""

import math
from collections.abc import Sequence

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.semantic.things.sight import BODY_M, SightMap
from mapspeak.spatial import UNKNOWN, OccupancyGrid
from mapspeak.spatial.grid import FREE_MAX, FloatArray
from mapspeak.spatial.paths import DistanceField, clearance_m

__all__ = ["find_approach", "find_fronts"]

LARGEST_OFF_M = 1.4
"""One stands no farther from a thing, so that it is within 1.5 m on a coarse map, too."""
BEST_OFF_M = 1.0
"""Near enough for 1.5 m, far enough to have it ahead even where its place is half a metre off."""
COMFORT_M = 0.15
_STEP_BACK_M = 0.1


def find_approach(
    sight: SightMap, distances: DistanceField, target: Point, seen_from: Sequence[Point]
) -> Pose | None:
    """Finds a pose that the robot can drive to and that faces a thing from near.

    A thing on a wall has floor on both sides of it; the right one is that from which it was seen.

    Args:
        sight: The map.
        distances: From the robot, on that map.
        target: Where the thing is.
        seen_from: The places of those who saw it.

    Returns:
        None where the robot cannot get to within 1.4 m in sight of it.
    """
    points, clear_m = _reachable_near(sight, distances, target)
    if not len(points):
        return None
    off_m = np.hypot(points[:, 0] - target.x, points[:, 1] - target.y)
    fronts = find_fronts(sight, target, seen_from)
    is_seen = np.any([_sees(sight, front, points) for front in fronts], axis=0)
    tight_m = np.maximum(distances.radius_m + COMFORT_M - clear_m, 0.0)
    costs = np.where(is_seen, np.abs(off_m - BEST_OFF_M) + 2 * tight_m, np.inf)
    best = int(np.argmin(costs))
    if not math.isfinite(costs[best]):
        return None
    place = Point(*points[best].tolist())
    return Pose(place.x, place.y, place.bearing_to(target))


def _reachable_near(
    sight: SightMap, distances: DistanceField, target: Point
) -> tuple[FloatArray, FloatArray]:
    """Gives the middles of reachable cells around a point, and their clearance in metres."""
    grid = sight.grid
    cell = grid.cell_at(target)
    reach = math.ceil(LARGEST_OFF_M / grid.resolution_m)
    # Farther obstacles than this do not matter for standing comfortably.
    wide = reach + math.ceil((distances.radius_m + COMFORT_M) / grid.resolution_m)
    top, left = max(cell.row - wide, 0), max(cell.col - wide, 0)
    window = grid.crop(
        slice(top, max(cell.row + wide + 1, 0)), slice(left, max(cell.col + wide + 1, 0))
    )
    rows, cols = np.nonzero(window.free)
    if not rows.size:
        return np.empty((0, 2)), np.empty(0)
    points = window.points_at(rows, cols)
    is_near = np.hypot(points[:, 0] - target.x, points[:, 1] - target.y) <= LARGEST_OFF_M
    is_near &= np.isfinite(distances.distances_at(rows + top, cols + left))
    return points[is_near], clearance_m(window)[rows, cols][is_near].astype(np.float64)


def find_fronts(sight: SightMap, target: Point, seen_from: Sequence[Point]) -> list[Point]:
    """Gives, for each who saw the thing, the last floor before it on the line there.

    Its middle may lie deep in its own body, where nobody can look.
    """
    if not seen_from:
        return [target]
    starts = np.array([(place.x, place.y) for place in seen_from])
    ways = np.arctan2(target.y - starts[:, 1], target.x - starts[:, 0])
    in_grid = ways - sight.grid.origin.yaw_rad
    far_m = np.hypot(target.x - starts[:, 0], target.y - starts[:, 1])
    near_m = sight.cast(sight.obstacle_off, sight.grid.fractional_cells_at(starts), in_grid)
    # What is seen over furniture has its front behind it.
    is_over = near_m < far_m - BODY_M
    until_m = np.where(is_over, far_m, np.minimum(near_m, far_m)) - _STEP_BACK_M
    return [
        _last_floor(
            sight.grid, Point(x, y), Point(x + far * math.cos(way), y + far * math.sin(way))
        )
        for (x, y), far, way in zip(starts.tolist(), until_m.tolist(), ways.tolist(), strict=True)
    ]


def _last_floor(grid: OccupancyGrid, start: Point, end: Point) -> Point:
    """Finds the last floor on the line from one point to another; the end where there is none."""
    n_steps = max(math.ceil(start.distance_to(end) / grid.resolution_m), 1)
    shares = np.linspace(1.0, 0.0, n_steps + 1)[:, None]
    points = np.array([[end.x, end.y]]) * shares + np.array([[start.x, start.y]]) * (1.0 - shares)
    rows, cols = grid.cells_at(points)
    is_inside = (rows >= 0) & (rows < grid.n_rows) & (cols >= 0) & (cols < grid.n_cols)
    values = np.where(is_inside, grid.cells[rows * is_inside, cols * is_inside], UNKNOWN)
    floor = np.flatnonzero((values >= 0) & (values <= FREE_MAX))
    return Point(*points[floor[0]].tolist()) if floor.size else end


def _sees(sight: SightMap, front: Point, points: FloatArray) -> FloatArray:
    """True for points with nothing between them and the front of a thing."""
    away = np.array([[front.x, front.y]]) - points
    in_grid = np.arctan2(away[:, 1], away[:, 0]) - sight.grid.origin.yaw_rad
    near_m = sight.cast(
        sight.obstacle_off, sight.grid.fractional_cells_at(points), in_grid, begin_m=0.0
    )
    return np.asarray(near_m >= np.hypot(away[:, 0], away[:, 1]) - _STEP_BACK_M)
