"""A height map cut into basins: every cell belongs to the peak that steepest ascent leads to."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.rooms.raster import Picture, find_cells

Heights = NDArray[np.float32]
BasinLabels = NDArray[np.int32]


@dataclass(frozen=True, slots=True, kw_only=True)
class Saddle:
    """The highest pass between two touching basins.

    Attributes:
        height: In the unit of the height map.
        first: The basin with the lower number.
        second: The basin with the higher number.
        row: Where the pass lies.
        col: Where the pass lies.
        is_doorway: True between two wall ends, where the height map has been cut.
    """

    height: float
    first: int
    second: int
    row: int
    col: int
    is_doorway: bool = False


def build_basins(height: Heights, floor: Picture) -> BasinLabels:
    """Gives each floor cell the number of its basin, from 1; 0 elsewhere."""
    step = _steepest_steps(height).ravel()
    peaks = floor & (step == 0).reshape(floor.shape)
    _, peak_label = cv2.connectedComponents(peaks, connectivity=8)
    summit = _follow(np.arange(floor.size, dtype=np.int32) + step)
    basins = np.asarray(peak_label, np.int32).ravel()[summit].reshape(floor.shape)
    basins[floor == 0] = 0
    return basins


def _steepest_steps(height: Heights) -> NDArray[np.int32]:
    """Gives for each cell the step in the flat array to its steepest higher neighbour, or 0."""
    rows, cols = height.shape
    framed = cv2.copyMakeBorder(height, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    steepest = np.zeros_like(height)
    step = np.zeros(height.shape, np.int32)
    slope = np.empty_like(height)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            if down == right == 0:
                continue
            there = framed[1 + down : 1 + down + rows, 1 + right : 1 + right + cols]
            np.subtract(there, height, out=slope)
            slope *= np.float32(1 / math.hypot(down, right))
            steeper = slope > steepest
            np.copyto(steepest, slope, where=steeper)
            np.copyto(step, np.int32(down * cols + right), where=steeper)
    return step


def _follow(pointer: NDArray[np.int32]) -> NDArray[np.int32]:
    """Follows every pointer to its end by doubling."""
    while True:
        further = pointer[pointer]
        if np.array_equal(further, pointer):
            return pointer
        pointer = further


def find_saddles(basins: BasinLabels, height: Heights) -> list[Saddle]:
    """Gives the highest pass between each two touching basins, highest first."""
    parts = []
    for here, there in ((np.s_[:-1, :], np.s_[1:, :]), (np.s_[:, :-1], np.s_[:, 1:])):
        one, other = basins[here], basins[there]
        rows, cols = find_cells((one != other) & (one > 0) & (other > 0))
        a, b = one[rows, cols], other[rows, cols]
        level = np.minimum(height[here][rows, cols], height[there][rows, cols])
        parts.append((level, np.minimum(a, b), np.maximum(a, b), rows, cols))
    level, first, second, rows, cols = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.lexsort((cols, rows, -level, second, first))
    is_new = np.ones(order.size, bool)
    pair = np.stack([first, second])[:, order]
    is_new[1:] = (pair[:, 1:] != pair[:, :-1]).any(axis=0)
    best = order[is_new]
    best = best[np.lexsort((cols[best], rows[best], -level[best]))]
    return [
        Saddle(
            height=float(level[i]),
            first=int(first[i]),
            second=int(second[i]),
            row=int(rows[i]),
            col=int(cols[i]),
        )
        for i in best.tolist()
    ]
