"""Where to stand to look at a thing: near it, on the side it was seen from, facing it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.memory.things.sight import BODY_M, N_RAYS, SightMap, bearing_index
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.frontiers.viewpoints import NARROW_COMFORT_M
from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.paths import DistanceField, clearance_m

BEST_OFF_M = 1.0
"""Near enough for 1.5 m, far enough to have it ahead even where its place is half a metre off."""
SPREAD_M = 0.4
"""One stands no farther beyond that, so that it is within 1.5 m on a coarse map, too."""
LARGEST_OFF_M = BEST_OFF_M + SPREAD_M
COMFORT_M = 0.15
"""How much more than its radius a robot should have around it where it is sent to stand."""
FACED_M = 1.5
FACED_RAD = math.radians(30)
"""What is so near, and so little to the side, is faced: a camera has it well in its picture."""
MISSED_M = 20.0
"""Facing all of where a thing may be is worth so many metres: the best distance hardly counts
beside it. Of 2, 6 and 20 the last faced most, in the buildings for choosing."""
HIDDEN_M = 3.0
"""Another known thing that stands before it is worth so many metres."""
OTHER_M = 0.3
"""Sight that passes another thing nearer than this may end at it."""
N_SIDES, N_FINALISTS = 8, 16
"""Lines of sight cost most, so that only so many of the best standing places are asked for them, as
many on each side of a thing: what hides it on one may not on another."""
LOOK_AGAIN_M = 1.5
"""A thing that is known no better is looked for again on arrival."""
OVERLOOK_M = 2.5
"""That look is from where most of its places are in view, and not from before it, for one that is
known no better than this: before, a drive to it itself faces it more often, 36 times in 48 against
22 (drawn buildings)."""
OVERLOOK_FAR_M = 6.0
PATH_WEIGHT = 0.1
"""So much of a metre nearer to it is worth a metre of way."""
ASIDE_M, WELL_ASIDE_RAD = 4.0, math.radians(12)
"""Directions to where a thing may be that spread so far are worth so many metres."""
BEFORE_M = 0.2
"""The side of the cells in which a thing is looked for: the floor before it is no farther."""
_STEP_BACK_M = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class Stands:
    """Where a robot may stand to face a thing from near, and what speaks against each place.

    Attributes:
        target: The middle of the thing.
        points: Shape (n, 2).
        costs_m: Shape (n,).
    """

    target: Point
    points: FloatArray
    costs_m: FloatArray

    def choose(self, distances: DistanceField) -> Pose | None:
        """Return the best pose for a robot that drives there; None where it can stand nowhere."""
        if not len(self.points):
            return None
        ways_m = distances.distances_at(*distances.grid.cells_at(self.points))
        place = Point(*self.points[int(np.argmin(self.costs_m + PATH_WEIGHT * ways_m))].tolist())
        return Pose(place.x, place.y, place.bearing_to(self.target))


def find_stands(
    sight: SightMap,
    distances: DistanceField,
    target: Point,
    seen_from: Sequence[Point],
    *,
    fronts: Sequence[Point] | None = None,
    whereabouts: FloatArray | None = None,
    others: FloatArray | None = None,
    off_m: float = BEST_OFF_M,
) -> Stands:
    """Find where a robot can stand about so far off a thing, at most 0.4 m more, in sight of it.

    A thing on a wall has floor on both sides of it; the right one is that from which it was seen.

    Args:
        distances: From any place of the same floor.
        fronts: What `find_fronts` gives for these, where it is at hand.
        whereabouts: Where it may be: points of the map frame, shape (n, 2), each as likely; the
            best place faces most of them.
        others: Where things are near it, itself too, shape (n, 2): the map may not show these.
    """
    points, clear_m = _reachable_near(sight, distances, target, off_m + SPREAD_M)
    lines = [(place, target) for place in seen_from]
    fronts = fronts or find_fronts(sight, lines) or [target]
    is_seen = _are_in_sight(sight, fronts, points)
    is_roomy = is_seen & (clear_m >= distances.radius_m + NARROW_COMFORT_M)
    kept = is_roomy if is_roomy.any() else is_seen
    points, clear_m = points[kept], clear_m[kept]
    away_m = np.hypot(points[:, 0] - target.x, points[:, 1] - target.y)
    tight_m = np.maximum(distances.radius_m + COMFORT_M - clear_m, 0.0)
    costs = np.abs(away_m - off_m) + 2 * tight_m
    if others is not None:
        costs += HIDDEN_M * _are_hidden(points, target, others)
    yaws = np.arctan2(target.y - points[:, 1], target.x - points[:, 0])
    if whereabouts is not None:
        within_m = FACED_M + off_m - BEST_OFF_M
        is_ahead = _have_ahead(points, yaws, whereabouts, within_m=within_m)
        costs += MISSED_M * (1 - is_ahead.mean(axis=1))
    best = _best_of_each_side(costs, yaws)
    costs = costs[best]
    if whereabouts is not None:
        is_seen = _have_in_sight(sight, points[best], seen_from, whereabouts)
        costs += MISSED_M * (is_ahead[best] & ~is_seen).mean(axis=1)
    return Stands(target, points[best], costs)


def _best_of_each_side(costs: FloatArray, yaws: FloatArray) -> IntArray:
    """Return the indices of the standing places of least cost, as many on each side of a thing."""
    sides = np.floor((yaws + math.pi) / (math.tau / N_SIDES)).astype(np.intp) % N_SIDES
    order = np.lexsort((costs, sides))
    starts = np.searchsorted(sides[order], np.arange(N_SIDES))
    rank = np.arange(len(order)) - starts[sides[order]]
    return np.sort(order[rank < N_FINALISTS // N_SIDES])


def find_overlook(
    sight: SightMap,
    stands: FloatArray,
    ways_m: FloatArray,
    seen_from: Sequence[Point],
    whereabouts: FloatArray,
) -> Pose | None:
    """Find the pose from which a picture shows most of where a thing may be, from near.

    Args:
        stands: Where the robot can stand, shape (n, 2).
        ways_m: How far it drives to each.
    """
    middle = np.median(whereabouts, axis=0)
    off_m = np.hypot(*(np.median(stands[:, None] - whereabouts, axis=1)).T)
    away_m = np.hypot(*(stands - middle).T)
    # From farther than it was seen already nothing more is seen of it.
    seen_m = min((math.dist((at.x, at.y), middle) for at in seen_from), default=OVERLOOK_FAR_M)
    near = np.flatnonzero(away_m <= min(seen_m, OVERLOOK_FAR_M))
    if not near.size:
        return None
    stands, ways_m, off_m = stands[near], ways_m[near], off_m[near]
    yaws = np.arctan2(middle[1] - stands[:, 1], middle[0] - stands[:, 0])
    is_ahead = _have_ahead(stands, yaws, whereabouts, within_m=OVERLOOK_FAR_M)
    costs = off_m + PATH_WEIGHT * ways_m + MISSED_M * (1 - is_ahead.mean(axis=1))
    # From the side a second direction tells how far away it is.
    bearings = np.arctan2(whereabouts[:, 1] - stands[:, 1:], whereabouts[:, 0] - stands[:, :1])
    aside_rad = np.remainder(bearings - yaws[:, None] + math.pi, math.tau) - math.pi
    costs += ASIDE_M * np.maximum(1 - aside_rad.std(axis=1) / WELL_ASIDE_RAD, 0.0)
    first = np.argsort(costs, kind="stable")[:N_FINALISTS]
    is_seen = _have_in_sight(sight, stands[first], seen_from, whereabouts)
    hidden = (is_ahead[first] & ~is_seen).mean(axis=1)
    best = int(first[np.argmin(costs[first] + MISSED_M * hidden)])
    x, y = stands[best].tolist()
    return Pose(x, y, float(yaws[best]))


def find_least_path_m(
    grid: OccupancyGrid, distances: DistanceField, target: Point, seen_from: Sequence[Point]
) -> float:
    """Return metres than which no way to a thing is shorter; `find_stands` costs more to ask.

    The way ends where one might look at the thing, or at a place that it was seen from. Infinite
    where the robot gets to none of these.
    """
    rows, cols, _ = _floor_near(grid, target, LARGEST_OFF_M)
    at = np.array([(place.x, place.y) for place in seen_from]).reshape(-1, 2)
    stand_rows, stand_cols = grid.cells_at(at)
    is_inside = grid.contains_cells(stand_rows, stand_cols)
    rows = np.concatenate([rows, stand_rows[is_inside]])
    cols = np.concatenate([cols, stand_cols[is_inside]])
    return float(distances.distances_at(rows, cols).min(initial=math.inf))


def measure_faced(
    sight: SightMap, pose: Pose, seen_from: Sequence[Point], whereabouts: FloatArray
) -> float:
    """Return share of where a thing may be that a pose faces from 1.5 m with nothing between."""
    stands, yaws = np.array([[pose.x, pose.y]]), np.array([pose.yaw_rad])
    is_ahead = _have_ahead(stands, yaws, whereabouts)
    return float((is_ahead & _have_in_sight(sight, stands, seen_from, whereabouts)).mean())


def _are_hidden(points: FloatArray, target: Point, others: FloatArray) -> Mask:
    """Return True for points from which another thing stands before a thing."""
    east, north = (target.x - points[:, :1], target.y - points[:, 1:])
    far_m = np.maximum(np.hypot(east, north), 1e-6)
    others_east, others_north = (others[:, axis] - points[:, axis, None] for axis in (0, 1))
    along_m = (others_east * east + others_north * north) / far_m
    aside_m = np.abs(others_north * east - others_east * north) / far_m
    is_before = (along_m > 0) & (along_m < far_m - OTHER_M) & (aside_m < OTHER_M)
    return np.asarray(is_before.any(axis=1))


def _have_ahead(
    stands: FloatArray, yaws: FloatArray, places: FloatArray, *, within_m: float = FACED_M
) -> Mask:
    """Return True for each viewpoint (row) and place (column) ahead of it and near."""
    east = places[:, 0] - stands[:, :1]
    north = places[:, 1] - stands[:, 1:]
    cos, sin = np.cos(yaws)[:, None], np.sin(yaws)[:, None]
    ahead, aside = east * cos + north * sin, np.abs(north * cos - east * sin)
    is_near = east * east + north * north <= within_m * within_m
    return np.asarray(is_near & (aside <= ahead * math.tan(FACED_RAD)))


def _have_in_sight(
    sight: SightMap, stands: FloatArray, seen_from: Sequence[Point], places: FloatArray
) -> Mask:
    """Return True for each standing place (row) and place (column) with nothing between them.

    What was met of a thing is the middle of a cell in a wall; what is seen of it lies before that.
    """
    viewers = np.array([(place.x, place.y) for place in seen_from]).reshape(-1, 1, 2)
    ways = viewers - places
    far_m = np.maximum(np.hypot(ways[..., 0], ways[..., 1]), 1e-6)
    before = places + BEFORE_M * (ways / far_m[..., None]).sum(axis=0) / max(len(viewers), 1)
    away = before[None] - stands[:, None]
    angles = np.arctan2(away[..., 1], away[..., 0]).ravel() - sight.grid.origin.yaw_rad
    starts = np.repeat(sight.grid.fractional_cells_at(stands), len(places), axis=0)
    away_m = np.hypot(away[..., 0], away[..., 1])
    near_m = sight.cast(sight.obstacle_off, starts, angles, begin_m=0.0, reach_m=away_m.ravel())
    return np.asarray(near_m.reshape(away_m.shape) >= away_m - _STEP_BACK_M)


def _reachable_near(
    sight: SightMap, distances: DistanceField, target: Point, within_m: float
) -> tuple[FloatArray, FloatArray]:
    """Return the middles of reachable cells around a point, and their clearance in metres."""
    rows, cols, points = _floor_near(sight.grid, target, within_m)
    is_reachable = np.isfinite(distances.distances_at(rows, cols))
    rows, cols, points = rows[is_reachable], cols[is_reachable], points[is_reachable]
    # Farther obstacles than this do not matter for standing comfortably.
    wide_m = within_m + distances.radius_m + COMFORT_M
    down, across = sight.grid.window_around(target, wide_m)
    clear_m = clearance_m(sight.grid.crop(down, across))
    return points, clear_m[rows - down.start, cols - across.start].astype(np.float64)


def _floor_near(
    grid: OccupancyGrid, target: Point, within_m: float
) -> tuple[IntArray, IntArray, FloatArray]:
    """Return the free cells from which one might look at a thing: rows, columns, and middles."""
    down, across = grid.window_around(target, within_m)
    rows, cols = np.nonzero(grid.crop(down, across).free)
    rows, cols = rows + down.start, cols + across.start
    points = grid.points_at(rows, cols)
    is_near = np.hypot(points[:, 0] - target.x, points[:, 1] - target.y) <= within_m
    return rows[is_near], cols[is_near], points[is_near]


def find_fronts(sight: SightMap, lines: Sequence[tuple[Point, Point]]) -> list[Point]:
    """Return the last floor before a thing on each line, from where it was seen to its middle.

    Its middle may lie deep in its own body, where nobody can look.
    """
    ends = np.array([(start.x, start.y, end.x, end.y) for start, end in lines]).reshape(-1, 4)
    starts, away = ends[:, :2], ends[:, 2:] - ends[:, :2]
    ways = np.arctan2(away[:, 1], away[:, 0])
    in_grid = ways - sight.grid.origin.yaw_rad
    far_m = np.hypot(away[:, 0], away[:, 1])
    near_m = sight.cast(sight.obstacle_off, sight.grid.fractional_cells_at(starts), in_grid)
    # What is seen over furniture has its front behind it.
    is_over = near_m < far_m - BODY_M
    until_m = np.where(is_over, far_m, np.minimum(near_m, far_m)) - _STEP_BACK_M
    fronts = starts + until_m[:, None] * np.stack([np.cos(ways), np.sin(ways)], axis=1)
    return [Point(x, y) for x, y in _last_floor(sight.grid, starts, fronts).tolist()]


def _last_floor(grid: OccupancyGrid, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Find the last floor on each line from a start to an end; the end where there is none."""
    away_m = np.hypot(*(ends - starts).T)
    n_steps = np.maximum(np.ceil(away_m / grid.resolution_m), 1)
    steps = np.arange(int(n_steps.max(initial=0)) + 1)
    shares = np.maximum(1.0 - steps / n_steps[:, None], 0.0)[..., None]
    points = ends[:, None] * shares + starts[:, None] * (1.0 - shares)
    is_floor = grid.look_up(grid.free, points, outside=False)
    # Where there is none the first is chosen, which is the end.
    last = np.argmax(is_floor, axis=1)
    return np.asarray(points[np.arange(len(points)), last])


def _are_in_sight(sight: SightMap, fronts: Sequence[Point], points: FloatArray) -> Mask:
    """Return True for points with nothing between them and any of the fronts of a thing.

    Sight goes both ways, and the fronts are few: one looks from each of them to all sides.
    """
    grid = sight.grid
    at = np.array(list({grid.cell_at(front): (front.x, front.y) for front in fronts}.values()))
    angles = np.arange(N_RAYS) * (math.tau / N_RAYS)
    starts = np.repeat(grid.fractional_cells_at(at), N_RAYS, axis=0)
    east, north = (np.subtract.outer(points[:, axis], at[:, axis]) for axis in (0, 1))
    away_m = np.hypot(east, north)
    free_m = sight.cast(
        sight.obstacle_off,
        starts,
        np.tile(angles, len(at)),
        begin_m=_STEP_BACK_M,
        reach_m=away_m.max(initial=0.0) + _STEP_BACK_M,
    ).reshape(len(at), N_RAYS)
    rays = bearing_index(np.arctan2(north, east) - grid.origin.yaw_rad)
    is_free = np.take_along_axis(free_m.T, rays, axis=0) >= away_m
    return np.asarray(is_free.any(axis=1))
