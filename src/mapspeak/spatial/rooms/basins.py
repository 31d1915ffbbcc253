"""Basins of clearance, and the passes between them.

Every cell belongs to the peak of clearance that steepest ascent leads to. Where two basins touch,
the highest way over is a pass: a door, a gap beside furniture, or nothing at all.
"""

import itertools
import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.rooms.floor import Floor
from mapspeak.spatial.rooms.raster import Picture, find_cells, label_parts
from mapspeak.spatial.visibility import cast_rays

Heights = NDArray[np.float32]
BasinLabels = NDArray[np.int32]

RISES_M = (0.3, 0.6, 1.0, 1.5)
"""Distances from a pass, on both sides, at which clearance is sampled."""
HALF_WIDTH, CONTACT, WALL, GAP, FIRST, RISE = range(6)
"""Columns of `Passes.values`; from RISE on the sampled clearances, FIRST's side first."""
_REACH_M = 1.5
_SLACK_RATIO = 1.3
_SLACK_M = 0.3
_WIDEST_M = 6.0
_RAY_CELLS_AT_ONCE = 500_000


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Basins:
    """The basins of a map of heights, which are clearances in metres.

    Attributes:
        labels: For each floor cell the number of its basin, from 1; 0 elsewhere.
        ascent: For each cell of the flat picture the steepest higher neighbour, or itself.
        peaks: The flat cells of floor that no neighbour is higher than.
    """

    heights: Heights
    labels: BasinLabels
    ascent: IntArray
    peaks: IntArray


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Passes:
    """The ways between touching basins.

    Attributes:
        pairs: The numbers of two basins, the lower first, shape (n, 2).
        values: In metres but for FIRST, the lower of the two numbers; shape (n, 14).
    """

    pairs: IntArray
    values: FloatArray


def build_basins(heights: Heights, floor: Picture) -> Basins:
    """Divide the floor into the basins of its peaks."""
    steepest = _find_steepest(heights) * floor
    steps = np.array([down * floor.shape[1] + right for down, right in ((0, 0), *_NEIGHBOURS)])
    ascent = np.take(steps, steepest.ravel(), mode="clip")
    ascent += np.arange(floor.size)
    peaks = floor & (steepest == 0)
    _, peak_label = label_parts(peaks, connectivity=8)
    # Cells off the floor lead nowhere, and are no peaks.
    labels = np.take(peak_label, _follow(ascent)).reshape(floor.shape)
    found = np.flatnonzero(peaks.view(np.bool_))
    return Basins(heights=heights, labels=labels, ascent=ascent, peaks=found)


_NEIGHBOURS = tuple(way for way in itertools.product((-1, 0, 1), repeat=2) if any(way))
"""The steps down and right to the cells around one."""


def _find_steepest(heights: Heights) -> Picture:
    """Return for each cell which neighbour is the steepest higher one, from 1, or 0 for none."""
    rows, cols = heights.shape
    framed = cv2.copyMakeBorder(heights, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    steepest = np.zeros_like(heights)
    number = np.zeros(heights.shape, np.uint8)
    slope = np.empty_like(heights)
    for each, (down, right) in enumerate(_NEIGHBOURS, start=1):
        there = framed[1 + down : 1 + down + rows, 1 + right : 1 + right + cols]
        np.subtract(there, heights, out=slope)
        slope *= np.float32(1 / math.hypot(down, right))
        # The last to be steeper than all before has the highest number.
        np.maximum(number, (slope > steepest) * np.uint8(each), out=number)
        np.maximum(steepest, slope, out=steepest)
    return number


def _follow(pointer: IntArray) -> IntArray:
    """Follow every pointer to its end by doubling."""
    while True:
        further = np.take(pointer, pointer, mode="clip")
        if np.array_equal(further, pointer):
            return pointer
        pointer = further


def find_passes(basins: Basins, floor: Floor, cell_size_m: float) -> Passes:
    """Return the highest way between each two touching basins."""
    cells = _find_contacts(basins.labels)
    pairs = basins.labels.ravel()[cells]
    level = basins.heights.ravel()[cells].min(axis=0)
    order = np.lexsort((cells[0], -level, pairs[1], pairs[0]))
    is_new = np.ones(order.size, bool)
    is_new[1:] = (np.diff(pairs[:, order]) != 0).any(axis=0)
    highest = order[is_new]
    n_contacts = np.diff(np.append(np.flatnonzero(is_new), order.size))
    half_m = level[highest].astype(np.float64)
    return describe_passes(
        basins,
        floor,
        cells[:, highest],
        half_m=half_m,
        contact_m=n_contacts * cell_size_m,
        cell_size_m=cell_size_m,
    )


def _find_contacts(labels: BasinLabels) -> IntArray:
    """Return the flat cells on both sides of where basins touch, the lower number's first."""
    parts = []
    n_cols = labels.shape[1]
    for here, there, step in (
        (np.s_[:-1, :], np.s_[1:, :], n_cols),
        (np.s_[:, :-1], np.s_[:, 1:], 1),
    ):
        one, other = labels[here], labels[there]
        rows, cols = find_cells((one != other) & (one > 0) & (other > 0))
        cell = rows * n_cols + cols
        parts.append(np.stack([cell, cell + step]))
    cells = np.concatenate(parts, axis=1)
    first, second = labels.ravel()[cells]
    return np.where(first < second, cells, cells[::-1])


def describe_passes(
    basins: Basins,
    floor: Floor,
    cells: IntArray,
    *,
    half_m: FloatArray,
    contact_m: FloatArray,
    cell_size_m: float,
) -> Passes:
    """Return passes with the walls and the clearances around them.

    Args:
        cells: A flat cell on each side of each pass, the lower basin's first, shape (2, n).
        half_m: Half of the width of each pass.
        contact_m: How far its two basins touch.
    """
    pairs = basins.labels.ravel()[cells].T.astype(np.intp)
    values = np.zeros((len(pairs), RISE + 2 * len(RISES_M)))
    values[:, HALF_WIDTH], values[:, CONTACT], values[:, FIRST] = half_m, contact_m, pairs[:, 0]
    values[:, [WALL, GAP]] = _measure_walls(floor, cells[0], half_m, cell_size_m)
    values[:, RISE:] = _climb(basins, cells, cell_size_m)
    return Passes(pairs=pairs, values=values)


def _climb(basins: Basins, cells: IntArray, cell_size_m: float) -> FloatArray:
    """Return the clearances on the way up on both sides, shape (n, 2 * len(RISES_M))."""
    heights = basins.heights.ravel()
    n_steps = [round(rise_m / cell_size_m) for rise_m in RISES_M]
    found = []
    for here in cells:
        way = [here]
        for _ in range(n_steps[-1]):
            way.append(basins.ascent[way[-1]])
        found += [heights[way[n]] for n in n_steps]
    return np.stack(found, axis=1).astype(np.float64)


def _measure_walls(
    floor: Floor, cells: IntArray, half_m: FloatArray, cell_size_m: float
) -> FloatArray:
    """Return the metres of wall in line with each pass, and of the gap between; shape (n, 2).

    The wall that continues the line across a narrow place tells a door from a gap beside
    furniture. Of the main directions the best counts, if the gap along it is about as wide as the
    pass; on each side at most 1.5 m of wall are looked at.
    """
    widest_m = 2 * half_m * _SLACK_RATIO + _SLACK_M
    found = np.stack([np.zeros_like(widest_m), widest_m], axis=1)
    if not floor.directions_deg:
        return found
    one_way = np.radians([angle + turn for angle in floor.directions_deg for turn in (0, 90)])
    angles_rad = np.concatenate([one_way, one_way + np.pi])
    wall = cv2.dilate(floor.wall, np.ones((3, 3), np.uint8)) > 0
    n_beyond = round(_REACH_M / cell_size_m)
    narrow = np.flatnonzero(2 * half_m <= _WIDEST_M)
    narrow = narrow[np.argsort(widest_m[narrow], kind="stable")]
    for part in _split_by_reach(narrow, widest_m / cell_size_m + n_beyond, angles_rad.size):
        steps = np.arange(1.0, max(round(widest_m[part[-1]] / cell_size_m) + n_beyond, 2))
        starts = np.stack(np.divmod(cells[part], wall.shape[1]), axis=1) + 0.5
        rays = cast_rays(wall.shape, starts, angles_rad=angles_rad, steps=steps)
        lines = wall.ravel()[rays.cells] & rays.is_inside
        found[part] = _choose_line(lines, widest_m[part], n_beyond, cell_size_m)
    return found


def _split_by_reach(places: IntArray, n_steps: FloatArray, n_rays: int) -> list[IntArray]:
    """Split places, the shortest rays first, so that the rays of a part fit into memory."""
    ends = np.cumsum(n_steps[places] * n_rays) // _RAY_CELLS_AT_ONCE
    return [part for part in np.split(places, np.flatnonzero(np.diff(ends)) + 1) if part.size]


def _choose_line(
    lines: NDArray[np.bool_], widest_m: FloatArray, n_beyond: int, cell_size_m: float
) -> FloatArray:
    """Return wall and gap of the direction with most wall, shape (n, 2).

    Args:
        lines: True on wall, shape (n, rays, steps); the second half of the rays goes the other way.
    """
    first = lines.argmax(axis=2)
    n_wall = np.zeros((*lines.shape[:2], lines.shape[2] + 1), np.int32)
    np.cumsum(lines, axis=2, out=n_wall[:, :, 1:])
    ends = np.stack([first, np.minimum(first + n_beyond, lines.shape[2])], axis=2)
    wall_m = np.diff(np.take_along_axis(n_wall, ends, axis=2))[:, :, 0] * cell_size_m
    gap_m = np.where(lines.any(axis=2), first * cell_size_m, np.inf)
    n = first.shape[1] // 2
    gap_m = gap_m[:, :n] + gap_m[:, n:]
    is_gap: Mask = gap_m <= widest_m[:, None]
    wall_m = np.where(is_gap, wall_m[:, :n] + wall_m[:, n:], 0.0)
    gap_m = np.where(is_gap, gap_m, widest_m[:, None])
    best = wall_m.argmax(axis=1)[:, None]
    return np.concatenate([np.take_along_axis(part, best, axis=1) for part in (wall_m, gap_m)], 1)
