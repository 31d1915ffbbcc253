"""What one view says of where its thing is: a likelihood over the cells in sight.

Likelihoods are ratios to that of a view that says nothing: a direction any way round, and a range
anywhere within reach. So 1 is no news, and what a view does not speak of needs no cell.
"""

import math
from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Pose
from mapspeak.semantic.laserfan import LaserFan
from mapspeak.semantic.things.news import LaserNews, read_news
from mapspeak.semantic.things.sight import BODY_M, SightMap, bearing_index
from mapspeak.semantic.waypoint import Landmark
from mapspeak.spatial.grid import FloatArray, IntArray

__all__ = ["Outlook", "ViewLikelihood", "build_outlook", "weigh_view"]

_FARTHEST_SIGMAS = 3.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outlook:
    """The lattice cells in sight of a place; arrays of one length but for the two by ray.

    Attributes:
        cells: Flat indices into the lattice, rising.
        angles: Where they are, in the frame of the grid.
        ranges_m: How far they are.
        sight: How likely one sees that far: 1, or less behind what one may see over.
        near_m: To the first obstacle, by ray.
        far_m: To the first wall, by ray.
    """

    cells: IntArray
    angles: FloatArray
    ranges_m: FloatArray
    sight: FloatArray
    near_m: FloatArray
    far_m: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ViewLikelihood:
    """The cells that a view speaks of, and how much more likely each is than without it.

    Attributes:
        cells: Flat indices into the lattice, rising.
        ratios: How much more likely.
        news: What the laser knew better than the map, wherever the thing is; None for nothing.
    """

    cells: IntArray
    ratios: FloatArray
    news: LaserNews | None = None


def build_outlook(sight: SightMap, pose: Pose, near_m: FloatArray, far_m: FloatArray) -> Outlook:
    """Finds the lattice cells in sight of a place.

    Args:
        sight: The map.
        pose: Where one looks from.
        near_m: How far one sees to the first obstacle, by ray.
        far_m: How far to the first wall, by ray.
    """
    res_m, factor = sight.grid.resolution_m, sight.factor
    row, col = sight.grid.fractional_cells_at(np.array([[pose.x, pose.y]]))[0].tolist()
    reach = (float(far_m.max()) + BODY_M) / res_m
    sizes, places = sight.rows.shape, (row, col)
    low, high = (
        [
            int(np.clip(round_to((at + side) / factor), 0, size))
            for at, size in zip(places, sizes, strict=True)
        ]
        for round_to, side in ((np.floor, -reach), (np.ceil, reach))
    )
    window = (slice(low[0], high[0]), slice(low[1], high[1]))
    down, right = sight.rows[window] - row, sight.cols[window] - col
    ranges_m, angles = np.hypot(down, right) * res_m, np.arctan2(down, right)
    rays = bearing_index(angles)
    is_near, is_far = ranges_m <= near_m[rays] + BODY_M, ranges_m <= far_m[rays] + BODY_M
    rows, cols = np.nonzero(is_far)
    return Outlook(
        cells=(rows + low[0]) * sight.rows.shape[1] + cols + low[1],
        angles=angles[is_far],
        ranges_m=ranges_m[is_far],
        sight=np.where(is_near[is_far], 1.0, sight.noise.seen_over_ratio),
        near_m=near_m,
        far_m=far_m,
    )


def weigh_view(
    sight: SightMap, outlook: Outlook, pose: Pose, landmark: Landmark
) -> ViewLikelihood | None:
    """Gives what a landmark's direction and range say; None where it has neither."""
    if landmark.bearing_rad is None and landmark.range_m is None:
        return None
    cells, ratios, ranges_m = outlook.cells, outlook.sight, outlook.ranges_m
    news = None
    if landmark.bearing_rad is not None:
        sigma = sight.noise.bearing_rad
        ahead = pose.yaw_rad + landmark.bearing_rad - sight.grid.origin.yaw_rad
        off = np.abs(np.remainder(outlook.angles - ahead + math.pi, math.tau) - math.pi)
        near = np.flatnonzero(off <= _FARTHEST_SIGMAS * sigma)
        bell = np.exp(-0.5 * (off[near] / sigma) ** 2) * (math.sqrt(math.tau) / sigma)
        cells, ratios, ranges_m = cells[near], ratios[near], ranges_m[near]
        if landmark.laser is not None:
            news, ratios = _correct(sight, outlook, pose, landmark.laser, near)
        ratios = ratios * bell
    if landmark.range_m is not None:
        ratios = ratios * _weigh_range(sight, ranges_m, landmark.range_m)
    return ViewLikelihood(cells=cells, ratios=ratios, news=news)


def _correct(
    sight: SightMap, outlook: Outlook, pose: Pose, fan: LaserFan, near: IntArray
) -> tuple[LaserNews | None, FloatArray]:
    """Gives what the laser knows better, and how likely one sees as far as each cell with it."""
    seen = outlook.sight[near]
    found = read_news(
        sight,
        pose,
        fan,
        near_m=outlook.near_m,
        cells=outlook.cells[near],
        angles=outlook.angles[near],
        ranges_m=outlook.ranges_m[near],
    )
    if found is None:
        return None, seen
    seen[found.changed] = found.sight
    return found.news, seen


def _weigh_range(sight: SightMap, ranges_m: FloatArray, told_m: float) -> FloatArray:
    noise = sight.noise
    sigma = noise.range_m + noise.range_ratio * ranges_m
    bell = np.exp(-0.5 * ((told_m - ranges_m) / sigma) ** 2) / (sigma * math.sqrt(math.tau))
    wrong = noise.wrong_range_ratio
    return np.asarray((1 - wrong) * bell * noise.reach_m + wrong, dtype=np.float64)
