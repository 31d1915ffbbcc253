"""What the laser knows better than the map: where there is something new, and what is gone.

Where a beam ends at what the map has, it says nothing that the map does not, and counts for
nothing: on a fresh map a laser changes no place. Elsewhere the map is corrected, for this one look:
cells that beams ended in are as likely as walls and furniture, those behind are seen over, and what
the map has in front of the end is less likely. The laser looks at one height alone, so that it
rules nothing out.

The same beam seen from twenty places is no twenty proofs: of what several looks say of a cell, that
counts which makes it likeliest, once (`find_log_priors`).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Pose
from mapspeak.memory.laserfan import LaserFan
from mapspeak.memory.things.sight import BODY_M, N_RAYS, SightMap, bearing_index
from mapspeak.spatial.grid import FloatArray, IntArray, Mask

_BESIDE = range(-2, 3)
"""Rays of the map that a beam may be, 1.5 degrees apart: a heading is no better known."""
_LEAST_MET = 0.05
"""Cells that a beam hardly ended in are left out."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LaserNews:
    """What a look with the laser says of the cells it speaks of.

    Attributes:
        cells: Flat indices into the lattice, rising: cells where the map is wrong.
        log_priors: How likely a thing is in each before any view, as a logarithm.
    """

    cells: IntArray
    log_priors: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Correction:
    """How a laser corrects the map for one look.

    Attributes:
        changed: The numbers of the cells in directions where it is.
        sight: How likely one sees each of these: what counts instead of `Outlook.sight`.
    """

    news: LaserNews
    changed: IntArray
    sight: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Beams:
    """A fan over the map, by beam.

    Attributes:
        is_new: It ended where the map has nothing.
        is_through: It passed what the map has, and so did the one beside it.
        end_m: Where it ended, or how far it met nothing.
    """

    is_new: Mask
    is_through: Mask
    end_m: FloatArray


def read_news(
    sight: SightMap,
    pose: Pose,
    fan: LaserFan,
    *,
    near_m: FloatArray,
    cells: IntArray,
    angles: FloatArray,
    ranges_m: FloatArray,
) -> Correction | None:
    """Return how a fan corrects the map; None where the map is right.

    Args:
        near_m: How far one sees on the map to the first obstacle, by ray.
        cells: Lattice cells in sight around the direction that was told, rising.
        angles: Where they are, in the frame of the grid.
        ranges_m: How far they are.
    """
    ahead = pose.yaw_rad - sight.grid.origin.yaw_rad
    beams = _compare(sight, pose, fan, ahead, near_m)
    is_news = beams.is_new | beams.is_through
    if not is_news.any():
        return None
    off = np.remainder(angles - ahead - fan.first_rad + fan.step_rad / 2, math.tau)
    number = (off / fan.step_rad).astype(np.intp)
    inside = np.flatnonzero(number < len(is_news))
    inside = inside[is_news[number[inside]]]
    beam, far_m, cells = number[inside], ranges_m[inside], cells[inside]
    behind_m = far_m - beams.end_m[beam]
    log_priors = sight.log_prior.ravel()[cells]
    noise = sight.noise
    met = np.exp(-0.5 * (behind_m / noise.laser_m) ** 2) * (
        noise.laser_met_ratio * beams.is_new[beam]
    )
    likelier = np.log(np.exp(log_priors) + (1 - np.exp(log_priors)) * met)
    is_passed = beams.is_through[beam] & (behind_m < -noise.laser_news_m) & (log_priors == 0.0)
    told = np.where(is_passed, math.log(noise.laser_through_ratio), likelier)
    kept = is_passed | (met > _LEAST_MET)
    return Correction(
        news=LaserNews(cells=cells[kept], log_priors=told[kept]),
        changed=inside,
        sight=np.where(behind_m <= BODY_M, 1.0, noise.seen_over_ratio),
    )


def find_log_priors(
    sight: SightMap, cells: IntArray, news: Iterable[LaserNews | None]
) -> FloatArray:
    """Return how likely a thing is in cells before any view, by the map and what corrects it.

    Args:
        cells: Of the lattice, rising.
        news: Of all views of a thing.
    """
    logs = sight.log_prior.ravel()[cells]
    told = [each for each in news if each is not None and each.cells.size]
    if not told:
        return logs
    best = np.full(len(cells), -np.inf)
    for each in told:
        at = np.minimum(np.searchsorted(cells, each.cells), len(cells) - 1)
        is_there = cells[at] == each.cells
        np.maximum.at(best, at[is_there], each.log_priors[is_there])
    return np.where(np.isfinite(best), best, logs)


def _compare(
    sight: SightMap, pose: Pose, fan: LaserFan, ahead: float, near_m: FloatArray
) -> _Beams:
    met_m = np.array([math.nan if each is None else each for each in fan.ranges_m])
    angles = ahead + fan.first_rad + fan.step_rad * np.arange(len(met_m), dtype=np.float64)
    is_end = np.isfinite(met_m)
    end_m = np.where(np.isinf(met_m), fan.reach_m or 0.0, met_m)
    rays = bearing_index(angles)
    # An edge of what stands there may lie on either side of a beam.
    beside_m = np.max([near_m[(rays + step) % N_RAYS] for step in _BESIDE], axis=0)
    news_m = sight.noise.laser_news_m
    is_past = (end_m > beside_m + news_m) & (beside_m < sight.noise.reach_m)
    # One beam alone has slipped past a corner or through a gap that the map has closed.
    has_past_beside = np.zeros_like(is_past)
    has_past_beside[1:] |= is_past[:-1]
    has_past_beside[:-1] |= is_past[1:]
    return _Beams(
        is_new=is_end & (_off_m(sight, pose, angles, np.where(is_end, end_m, 0.0)) > news_m),
        is_through=is_past & has_past_beside,
        end_m=np.where(np.isnan(end_m), 0.0, end_m),
    )


def _off_m(sight: SightMap, pose: Pose, angles: FloatArray, ends_m: FloatArray) -> FloatArray:
    """Return how far from anything on the map beams end; nothing of those that end off the map."""
    grid = sight.grid
    start = grid.fractional_cells_at(np.array([[pose.x, pose.y]]))
    ways = np.stack([np.sin(angles), np.cos(angles)], axis=1)
    at = np.floor(start + ways * (ends_m / grid.resolution_m)[:, None])
    is_inside = np.asarray(((at >= 0) & (at < grid.cells.shape)).all(axis=1))
    rows, cols = np.where(is_inside[:, None], at, 0).astype(np.intp).T
    return np.where(is_inside, sight.obstacle_off[rows, cols] * grid.resolution_m, 0.0)
