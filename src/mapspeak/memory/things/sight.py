"""What can be seen from where on a map, and what a laser knows better than the map.

Rays end at walls, and may pass over furniture. Everything is counted in cells of the map, in the
frame of the grid, so that a map that is turned and shifted in the world gives the same answers.

Where a beam of the laser ends at what the map has, it says nothing that the map does not, and
counts for nothing: on a fresh map a laser changes no place. Elsewhere the map is corrected, for
this one look: cells that beams ended in are as likely as walls and furniture, those behind are seen
over, and what the map has in front of the end is less likely. The laser looks at one height alone,
so that it rules nothing out. The same beam seen from twenty places is no twenty proofs: of what
several looks say of a cell, that counts which makes it likeliest, once (`find_log_priors`).
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Pose
from mapspeak.memory.laserfan import LaserFan
from mapspeak.memory.things.thing import NOISE, Stance
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.rooms import build_cleared
from mapspeak.spatial.visibility import measure_sight

N_RAYS = 240
LATTICE_M = 0.2
"""The side of the cells in which a thing is looked for; finer than any view can tell."""
FURNITURE_M = 2.5
"""What is no longer than this and touches no wall stands free, and one may see over it."""
ROW_M = 6.0
"""Nor is a row of it at a wall longer: one sees over pallets and benches that rooms end at."""
HIDDEN_M = 1.0
"""Of a wall, furniture on both sides hides no longer piece."""
BODY_M = 0.3
"""A thing's middle lies up to so far behind the surface that the robot has met."""
SURFACE_M = BODY_M + LATTICE_M / math.sqrt(2)
"""A thing's surface is met at most so far before the middle of a lattice cell that it may be in."""
OWN_M = 0.2
"""The robot's own place is no obstacle, even where the map has one by now."""

Clearance = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SightMap:
    """A map made ready for looking around in it; compared by identity.

    Attributes:
        obstacle_off: Cells to the nearest obstacle or unknown cell, from each.
        wall_off: The same where what stands free does not count.
        factor: How many cells of the map make the side of one of the lattice.
        log_priors: How likely a thing is in each lattice cell before any view, as a logarithm, by
            its stance.
        rows: Of the place that stands for each lattice cell: the middle of its obstacles.
        cols: The same, in fractional cells of the map.
    """

    grid: OccupancyGrid
    obstacle_off: Clearance
    wall_off: Clearance
    factor: int
    log_priors: Mapping[Stance, FloatArray]
    rows: FloatArray
    cols: FloatArray

    def cast(
        self,
        off: Clearance,
        places: FloatArray,
        angles: FloatArray,
        *,
        begin_m: float | FloatArray = OWN_M,
        reach_m: float | FloatArray | None = None,
    ) -> FloatArray:
        """Return how far one sees, in metres, from each place along its angle.

        Args:
            places: Fractional cells, shape (n, 2).
            angles: In the frame of the grid, shape (n,).
            begin_m: Nearer obstacles do not count; one number, or one for each ray.
            reach_m: Farther ones do not, either; as far as anybody names things where None.
        """
        size_m = self.grid.resolution_m
        reach_m = NOISE.reach_m if reach_m is None else reach_m
        reached = measure_sight(off, places, angles, begin=begin_m / size_m, reach=reach_m / size_m)
        return reached * size_m


def build_sight_map(grid: OccupancyGrid) -> SightMap:
    """Make a map ready: what blocks sight, and where things may stand."""
    # Nobody sees into furniture, so that its inside is unknown, too.
    cleared = build_cleared(grid, block_m=ROW_M)
    walls = grid.occupied & ~_small_parts(grid, grid.occupied) & ~cleared
    # A row may be long; what nobody has seen in it yet may be anything but its inside.
    inside = _small_parts(grid, grid.unknown) | _small_parts(grid, grid.unknown & cleared)
    blocked = walls | (grid.unknown & ~inside)
    blocked |= _run_on(blocked, grid)
    factor = max(round(LATTICE_M / grid.resolution_m), 1)
    shares, rows, cols = _summarise(grid.occupied, factor)
    on_floor = min(NOISE.floor_per_m * factor * grid.resolution_m, 1.0)
    has_wall, has_any = _summarise(walls, factor)[0] > 0, shares > 0
    has_free = _summarise(grid.occupied & ~walls, factor)[0] > 0
    misplaced = NOISE.misplaced_ratio
    return SightMap(
        grid=grid,
        obstacle_off=_off(grid.occupied | grid.unknown),
        wall_off=_off(blocked),
        factor=factor,
        log_priors={
            Stance.ANYWHERE: np.log(np.where(has_any, 1.0, on_floor)),
            Stance.ON_WALL: np.log(
                np.where(has_wall, 1.0, np.where(has_any, misplaced, on_floor * misplaced))
            ),
            Stance.FREE: np.log(np.where(has_free, 1.0, np.where(has_any, misplaced, on_floor))),
        },
        rows=rows,
        cols=cols,
    )


def look_around(sight: SightMap, poses: list[Pose]) -> tuple[FloatArray, FloatArray]:
    """Return how far one sees from places to all sides: to the first obstacle, and to a wall.

    Both have the shape (places, N_RAYS), in metres; ray 0 looks along the rows of the grid.
    """
    xy = np.array([(pose.x, pose.y) for pose in poses]).reshape(-1, 2)
    places = np.repeat(sight.grid.fractional_cells_at(xy), N_RAYS, axis=0)
    angles = np.tile(np.arange(N_RAYS) * (math.tau / N_RAYS), len(poses))
    near = sight.cast(sight.obstacle_off, places, angles)
    far = sight.cast(sight.wall_off, places, angles, begin_m=near)
    return near.reshape(-1, N_RAYS), far.reshape(-1, N_RAYS)


def _small_parts(grid: OccupancyGrid, mask: Mask) -> Mask:
    """Return True in those parts of a mask that are no longer than furniture."""
    n, labels, boxes, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=8)
    sides = boxes[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]] * grid.resolution_m
    is_small = np.hypot(sides[:, 0], sides[:, 1]) <= FURNITURE_M
    is_small[0] = False
    return np.asarray(is_small[labels]) if n > 1 else np.zeros(grid.cells.shape, dtype=np.bool_)


def _run_on(blocked: Mask, grid: OccupancyGrid) -> Mask:
    """Return True where a wall runs on in line behind what stands at it on both sides."""
    n_cells, found = round(HIDDEN_M / grid.resolution_m) | 1, np.zeros_like(blocked)
    for line in (np.ones((1, n_cells), np.uint8), np.ones((n_cells, 1), np.uint8)):
        found |= cv2.morphologyEx(blocked.view(np.uint8), cv2.MORPH_CLOSE, line) > 0
    return found & ~grid.free


def _off(blocked: Mask) -> Clearance:
    """Return cells to the nearest blocked cell; what lies off the array is blocked."""
    padded = np.pad(blocked, 1, constant_values=True)
    off = cv2.distanceTransform(
        np.logical_not(padded).view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE
    )
    return np.ascontiguousarray(off[1:-1, 1:-1], dtype=np.float32)


def _summarise(occupied: Mask, factor: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return, for each lattice cell, its number of occupied cells and the middle of them."""
    n_rows, n_cols = (-(-size // factor) for size in occupied.shape)
    room = (n_rows * factor - occupied.shape[0], n_cols * factor - occupied.shape[1])
    padded = np.pad(occupied, ((0, room[0]), (0, room[1]))).astype(np.float64)
    blocks = padded.reshape(n_rows, factor, n_cols, factor)
    n_occupied = blocks.sum(axis=(1, 3))
    inside = np.arange(factor) + 0.5
    rows = np.einsum("aibj,i->ab", blocks, inside)
    cols = np.einsum("aibj,j->ab", blocks, inside)
    is_some, count = n_occupied > 0, np.maximum(n_occupied, 1)
    rows = np.where(is_some, rows / count, factor / 2) + factor * np.arange(n_rows)[:, None]
    cols = np.where(is_some, cols / count, factor / 2) + factor * np.arange(n_cols)
    return n_occupied, rows, cols


def bearing_index(angles: FloatArray) -> IntArray:
    """Return the ray nearest to each angle of the grid's frame."""
    return np.asarray(np.round(angles * (N_RAYS / math.tau)), dtype=np.intp) % N_RAYS


_BESIDE = (np.arange(N_RAYS)[:, None] + np.arange(-2, 3)) % N_RAYS
"""For each ray those of the map that a line of sight may be, 1.5 degrees apart: a heading is no
better known."""


def find_farthest_beside(far_m: FloatArray) -> FloatArray:
    """Return the farthest of what is met along each ray and those beside it.

    Args:
        far_m: By ray; or a row for each place.
    """
    return np.asarray(far_m[..., _BESIDE].max(axis=-1))


def find_far_with_another(far_m: FloatArray) -> FloatArray:
    """Return how far one sees along each ray and one next to it, too: through no mere slit.

    Args:
        far_m: By ray.
    """
    beside_m = np.maximum(np.roll(far_m, 1), np.roll(far_m, -1))
    return np.asarray(np.minimum(far_m, beside_m))


def are_opposite(looks: FloatArray, views: FloatArray) -> Mask:
    """Return True for each look (row) and point that is on no side from which the point was seen.

    Args:
        looks: The way from each point to each look, shape (looks, n, 2).
        views: The way from each point to where it was seen from, shape (n, m, 2).
    """
    return np.asarray((np.einsum("lnk,nmk->lnm", looks, views) < 0.0).all(axis=2))


_LEAST_MET = 0.05
"""Cells that a beam hardly ended in are left out."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LaserUpdate:
    """What a look with the laser says of the cells it speaks of.

    Attributes:
        cells: Flat indices into the lattice, rising: cells where the map is wrong.
        log_priors: How likely a thing is in each before any view, as a logarithm.
    """

    cells: IntArray
    log_priors: FloatArray


def correct_by_laser(
    sight: SightMap,
    pose: Pose,
    fan: LaserFan,
    *,
    near_m: FloatArray,
    cells: IntArray,
    angles: FloatArray,
    ranges_m: FloatArray,
    seen: FloatArray,
) -> tuple[LaserUpdate | None, FloatArray]:
    """Return what a fan knows better than the map, and how likely one sees each cell with it.

    Args:
        near_m: How far one sees on the map to the first obstacle, by ray.
        cells: Lattice cells in sight around the direction that was told, rising.
        angles: Where they are, in the frame of the grid.
        seen: How likely one sees each by the map alone.
    """
    ahead = pose.yaw_rad - sight.grid.origin.yaw_rad
    is_new, is_through, end_m = _compare(sight, pose, fan, ahead, near_m)
    is_update = is_new | is_through
    if not is_update.any():
        return None, seen
    off = np.remainder(angles - ahead - fan.first_rad + fan.step_rad / 2, math.tau)
    number = (off / fan.step_rad).astype(np.intp)
    inside = np.flatnonzero(number < len(is_update))
    inside = inside[is_update[number[inside]]]
    beam, far_m, cells = number[inside], ranges_m[inside], cells[inside]
    behind_m = far_m - end_m[beam]
    log_priors = sight.log_priors[Stance.ANYWHERE].ravel()[cells]
    met = np.exp(-0.5 * (behind_m / NOISE.laser_m) ** 2) * (NOISE.laser_met_ratio * is_new[beam])
    likelier = np.log(np.exp(log_priors) + (1 - np.exp(log_priors)) * met)
    is_passed = is_through[beam] & (behind_m < -NOISE.laser_update_m) & (log_priors == 0.0)
    told = np.where(is_passed, math.log(NOISE.laser_through_ratio), likelier)
    kept = is_passed | (met > _LEAST_MET)
    seen = seen.copy()
    seen[inside] = np.where(behind_m <= BODY_M, 1.0, NOISE.seen_over_ratio)
    return LaserUpdate(cells=cells[kept], log_priors=told[kept]), seen


def find_log_priors(
    sight: SightMap, cells: IntArray, updates: Iterable[LaserUpdate | None], stance: Stance
) -> FloatArray:
    """Return how likely a thing is in rising lattice cells before any view, as a logarithm."""
    logs = sight.log_priors[stance].ravel()[cells]
    told = [each for each in updates if each is not None and each.cells.size]
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
) -> tuple[Mask, Mask, FloatArray]:
    """Lay a fan over the map; return three values for each beam.

    The first is True where it ended at nothing that the map has; the second where it passed what
    the map has, and so did the one beside it; the third is where it ended, or how far it met
    nothing.
    """
    met_m = np.array([math.nan if each is None else each for each in fan.ranges_m])
    angles = ahead + fan.first_rad + fan.step_rad * np.arange(len(met_m), dtype=np.float64)
    is_end = np.isfinite(met_m)
    end_m = np.where(np.isinf(met_m), fan.reach_m or 0.0, met_m)
    # An edge of what stands there may lie on either side of a beam.
    beside_m = find_farthest_beside(near_m)[bearing_index(angles)]
    update_m = NOISE.laser_update_m
    is_past = (end_m > beside_m + update_m) & (beside_m < NOISE.reach_m)
    # One beam alone has slipped past a corner or through a gap that the map has closed.
    has_past_beside = np.zeros_like(is_past)
    has_past_beside[1:] |= is_past[:-1]
    has_past_beside[:-1] |= is_past[1:]
    is_new = is_end & (_off_m(sight, pose, angles, np.where(is_end, end_m, 0.0)) > update_m)
    return is_new, is_past & has_past_beside, np.where(np.isnan(end_m), 0.0, end_m)


def _off_m(sight: SightMap, pose: Pose, angles: FloatArray, ends_m: FloatArray) -> FloatArray:
    """Return how far from anything on the map beams end; nothing of those that end off the map."""
    grid = sight.grid
    start = grid.fractional_cells_at(np.array([[pose.x, pose.y]]))
    ways = np.stack([np.sin(angles), np.cos(angles)], axis=1)
    at = np.floor(start + ways * (ends_m / grid.resolution_m)[:, None])
    is_inside = np.asarray(((at >= 0) & (at < grid.cells.shape)).all(axis=1))
    rows, cols = np.where(is_inside[:, None], at, 0).astype(np.intp).T
    return np.where(is_inside, sight.obstacle_off[rows, cols] * grid.resolution_m, 0.0)
