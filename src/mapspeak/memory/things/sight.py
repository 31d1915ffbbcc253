"""What can be seen from where on a map: rays that end at walls, and may pass over furniture.

Everything is counted in cells of the map, in the frame of the grid, so that a map that is turned
and shifted in the world gives the same answers.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Pose
from mapspeak.memory.things.thing import NOISE, NoiseModel
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.visibility import measure_sight

N_RAYS = 240
LATTICE_M = 0.2
"""The side of the cells in which a thing is looked for; finer than any view can tell."""
FURNITURE_M = 2.5
"""What is no longer than this and touches no wall stands free, and one may see over it."""
BODY_M = 0.3
"""A thing's middle lies up to so far behind the surface that the robot has met."""
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
        log_prior: How likely a thing is in each lattice cell before any view, as a logarithm.
        rows: Of the place that stands for each lattice cell: the middle of its obstacles.
        cols: The same, in fractional cells of the map.
    """

    grid: OccupancyGrid
    obstacle_off: Clearance
    wall_off: Clearance
    factor: int
    log_prior: FloatArray
    rows: FloatArray
    cols: FloatArray
    noise: NoiseModel

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
            off: `obstacle_off` or `wall_off`.
            places: Fractional cells, shape (n, 2).
            angles: In the frame of the grid, shape (n,).
            begin_m: Nearer obstacles do not count; one number, or one for each ray.
            reach_m: Farther ones do not, either; as far as anybody names things where None.
        """
        size_m = self.grid.resolution_m
        reach_m = self.noise.reach_m if reach_m is None else reach_m
        reached = measure_sight(off, places, angles, begin=begin_m / size_m, reach=reach_m / size_m)
        return reached * size_m


def build_sight_map(grid: OccupancyGrid, *, noise: NoiseModel = NOISE) -> SightMap:
    """Make a map ready: what blocks sight, and where things may stand."""
    # Nobody sees into furniture, so that its inside is unknown, too.
    blocked = (grid.occupied & ~_small_parts(grid, grid.occupied)) | (
        grid.unknown & ~_small_parts(grid, grid.unknown)
    )
    factor = max(round(LATTICE_M / grid.resolution_m), 1)
    shares, rows, cols = _summarise(grid.occupied, factor)
    on_floor = math.log(min(noise.floor_per_m * factor * grid.resolution_m, 1.0))
    return SightMap(
        grid=grid,
        obstacle_off=_off(grid.occupied | grid.unknown),
        wall_off=_off(blocked),
        factor=factor,
        log_prior=np.where(shares > 0, 0.0, on_floor),
        rows=rows,
        cols=cols,
        noise=noise,
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
