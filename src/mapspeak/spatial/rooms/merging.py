"""Basins of clearance, merged into rooms: a border stays only where a person would draw one.

Every cell belongs to the peak of clearance that steepest ascent leads to. The wall in line with a
narrow place tells a door from a gap beside furniture.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import IntArray
from mapspeak.spatial.rooms.floor import Floor
from mapspeak.spatial.rooms.raster import SETTINGS, Picture, find_cells
from mapspeak.spatial.visibility import cast_rays

MAX_ROOMS = int(np.iinfo(np.int16).max)
"""As many as the labels can tell apart; smaller rooms than these are left out."""
_REACH_M = 1.5
_SLACK_RATIO = 1.3
_SLACK_M = 0.3
Lines = NDArray[np.bool_]
Heights = NDArray[np.float32]
BasinLabels = NDArray[np.int32]


@dataclass(frozen=True, slots=True, kw_only=True)
class Saddle:
    """The highest pass between two touching basins.

    Attributes:
        height: In the unit of the height map.
        first: The basin with the lower number.
        second: The basin with the higher number.
        is_doorway: True between two wall ends, where the height map has been cut.
    """

    height: float
    first: int
    second: int
    row: int
    col: int
    is_doorway: bool = False


def build_basins(height: Heights, floor: Picture) -> BasinLabels:
    """Return for each floor cell the number of its basin, from 1; 0 elsewhere."""
    step = _steepest_steps(height).ravel()
    peaks = floor & (step == 0).reshape(floor.shape)
    _, peak_label = cv2.connectedComponents(peaks, connectivity=8)
    summit = _follow(np.arange(floor.size) + step)
    basins = np.asarray(peak_label, np.int32).ravel()[summit].reshape(floor.shape)
    basins[floor == 0] = 0
    return basins


def _steepest_steps(height: Heights) -> NDArray[np.int32]:
    """Return for each cell the step in the flat array to its steepest higher neighbour, or 0."""
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


def _follow(pointer: IntArray) -> IntArray:
    """Follow every pointer to its end by doubling."""
    while True:
        further = np.take(pointer, pointer, mode="clip")
        if np.array_equal(further, pointer):
            return pointer
        pointer = further


def find_saddles(basins: BasinLabels, height: Heights) -> list[Saddle]:
    """Return the highest pass between each two touching basins, highest first."""
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


class Frames:
    """Measures how much wall continues the line across a narrow place."""

    def __init__(self, floor: Floor, cell_size_m: float) -> None:
        self._cell_size_m = cell_size_m
        self._wall = cv2.dilate(floor.wall, np.ones((3, 3), np.uint8))
        angles_deg = [angle + turn for angle in floor.directions_deg for turn in (0, 90)]
        one_way = np.radians(np.array(angles_deg))
        self._angles_rad = np.concatenate([one_way, one_way + np.pi])

    def measure(self, row: int, col: int, clearance_m: float) -> float:
        """Return the metres of wall on both sides of a place, in the best main direction.

        A direction counts only if the gap along it is about as wide as the place is narrow; on
        each side at most 1.5 m are looked at.
        """
        if self._angles_rad.size == 0:
            return 0.0
        widest_m = 2 * clearance_m * _SLACK_RATIO + _SLACK_M
        gap_m, wall_m = self._look(row, col, widest_m)
        n = len(gap_m) // 2
        is_gap = gap_m[:n] + gap_m[n:] <= widest_m
        return float(np.where(is_gap, wall_m[:n] + wall_m[n:], 0.0).max())

    def _look(
        self, row: int, col: int, widest_m: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return, each way, how far the first wall is and how much wall there is from there on."""
        n_beyond = round(_REACH_M / self._cell_size_m)
        lines = self._lines(row, col, round(widest_m / self._cell_size_m) + n_beyond)
        first = lines.argmax(axis=1)
        n_wall = np.zeros((lines.shape[0], lines.shape[1] + 1), np.intp)
        np.cumsum(lines, axis=1, out=n_wall[:, 1:])
        way = np.arange(len(lines))
        last = np.minimum(first + n_beyond, lines.shape[1])
        gap_m = np.where(lines.any(axis=1), first * self._cell_size_m, np.inf)
        return gap_m, (n_wall[way, last] - n_wall[way, first]) * self._cell_size_m

    def _lines(self, row: int, col: int, n_steps: int) -> Lines:
        steps = np.arange(1.0, max(n_steps, 2))
        start = np.array([[row + 0.5, col + 0.5]])
        rays = cast_rays(self._wall.shape, start, angles_rad=self._angles_rad, steps=steps)
        is_wall: Lines = (self._wall.ravel()[rays.cells[0]] > 0) & rays.is_inside[0]
        return is_wall


_Border = tuple[Saddle, float]
"""A saddle that divides two places, and the metres of wall in line with it."""


class _Forest:
    """Basins joined into places, each with its clearance (its highest peak) and its area.

    Its clearance is given also with the furniture in its place, never more than without.
    """

    def __init__(
        self, clearance_m: list[float], standing_m: list[float], area_m2: list[float]
    ) -> None:
        self._parent = list(range(len(clearance_m)))
        self.clearance_m = clearance_m
        self.standing_m = standing_m
        self.area_m2 = area_m2

    def place(self, basin: int) -> int:
        """Return the place a basin belongs to by now."""
        while self._parent[basin] != basin:
            self._parent[basin] = self._parent[self._parent[basin]]
            basin = self._parent[basin]
        return basin

    def sides(self, saddle: Saddle) -> tuple[int, int]:
        """Return the two places at a saddle, the narrower first."""
        one, other = self.place(saddle.first), self.place(saddle.second)
        return (one, other) if self.clearance_m[one] <= self.clearance_m[other] else (other, one)

    def join(self, narrow: int, wide: int) -> None:
        """Make the narrower place part of the wider one."""
        self._parent[narrow] = wide
        self.standing_m[wide] = max(self.standing_m[wide], self.standing_m[narrow])
        self.area_m2[wide] += self.area_m2[narrow]


def merge_basins(
    basins: BasinLabels,
    clearance_m: Heights,
    standing_m: Heights,
    saddles: list[Saddle],
    *,
    frames: Frames,
    cell_area_m2: float,
) -> NDArray[np.int32]:
    """Return room numbers from 1, the largest room first; 0 where no room is."""
    forest = _plant(basins, clearance_m, standing_m, cell_area_m2)
    _join_equal_widths(forest, saddles, SETTINGS.same_width_ratio)
    borders = _join_open_borders(forest, saddles, frames)
    _absorb_small(forest, borders)
    return _number_by_area(basins, forest, SETTINGS.room_area_m2)


def _plant(
    basins: BasinLabels, clearance_m: Heights, standing_m: Heights, cell_area_m2: float
) -> _Forest:
    n = int(basins.max(initial=0)) + 1
    peak = _find_peaks(basins, clearance_m, n)
    is_same = standing_m is clearance_m
    standing = peak if is_same else np.minimum(_find_peaks(basins, standing_m, n), peak)
    area = np.bincount(basins.ravel(), minlength=n) * cell_area_m2
    return _Forest(peak.tolist(), standing.tolist(), area.tolist())


def _find_peaks(basins: BasinLabels, height: Heights, n: int) -> Heights:
    peak = np.zeros(n, np.float32)
    np.maximum.at(peak, basins.ravel(), height.ravel())
    return peak


def _join_equal_widths(forest: _Forest, saddles: list[Saddle], same_ratio: float) -> None:
    """Join the many peaks of one room or corridor, so that it is judged as a whole."""
    for saddle in saddles:
        narrow, wide = forest.sides(saddle)
        clearance_m = forest.clearance_m[narrow]
        if saddle.is_doorway:
            continue
        is_open = saddle.height >= same_ratio * clearance_m
        if narrow != wide and is_open and clearance_m >= same_ratio * forest.clearance_m[wide]:
            forest.join(narrow, wide)


def _join_open_borders(forest: _Forest, saddles: list[Saddle], frames: Frames) -> list[_Border]:
    """Join across every saddle that divides nothing, from the highest down; return the others."""
    borders = []
    for saddle in saddles:
        narrow, wide = forest.sides(saddle)
        if narrow == wide:
            continue
        if saddle.is_doorway:
            borders.append((saddle, SETTINGS.frame_m))
            continue
        # Taking furniture away may open a place, but makes no doors by widening what is beside.
        clearance_m, wide_m = forest.standing_m[narrow], forest.clearance_m[wide]
        if _is_narrow(clearance_m, wide_m, saddle):
            wall_m = frames.measure(saddle.row, saddle.col, saddle.height)
            # The more wall is in line with a door, the less narrow it must be.
            share = min(wall_m / SETTINGS.frame_m, 1.0)
            ratio = SETTINGS.gap_ratio + share * (SETTINGS.door_ratio - SETTINGS.gap_ratio)
            if saddle.height <= ratio * clearance_m:
                borders.append((saddle, wall_m))
                continue
        if _is_mouth(forest, narrow, wide, saddle):
            borders.append((saddle, 0.0))
        else:
            forest.join(narrow, wide)
    return borders


def _is_narrow(clearance_m: float, wide_m: float, saddle: Saddle) -> bool:
    """Return True where a door could be, if there is enough wall in line with it.

    A place that is hardly narrower than both sides, such as a corridor beside a pillar, is none.
    """
    width_m = 2 * saddle.height
    is_leaf = width_m <= SETTINGS.leaf_width_m or saddle.height <= SETTINGS.wide_ratio * wide_m
    is_door_wide = is_leaf and width_m <= SETTINGS.door_width_m
    return is_door_wide and saddle.height <= SETTINGS.door_ratio * clearance_m


def _is_mouth(forest: _Forest, narrow: int, wide: int, saddle: Saddle) -> bool:
    """Return True where a corridor opens into a much wider place without getting narrower."""
    clearance_m, area_m2 = forest.clearance_m[narrow], forest.area_m2[narrow]
    return (
        2 * saddle.height <= SETTINGS.mouth_width_m
        and clearance_m <= SETTINGS.mouth_ratio * forest.clearance_m[wide]
        and area_m2 >= SETTINGS.mouth_elongation * (2 * clearance_m) ** 2
        and area_m2 >= SETTINGS.mouth_area_m2
    )


def _absorb_small(forest: _Forest, borders: list[_Border]) -> None:
    """Join what is too small for a room across its widest border, until nothing is."""
    changed = True
    while changed:
        changed = False
        for saddle, wall_m in borders:
            narrow, wide = forest.sides(saddle)
            area_m2 = min(forest.area_m2[narrow], forest.area_m2[wide])
            # A niche has no door frame: it must be larger than a room.
            is_framed = wall_m >= SETTINGS.frame_m / 2
            is_framed &= 2 * saddle.height >= SETTINGS.least_door_m
            least_m2 = SETTINGS.room_area_m2 if is_framed else SETTINGS.niche_area_m2
            if narrow != wide and area_m2 < least_m2:
                forest.join(narrow, wide)
                changed = True


def _number_by_area(basins: BasinLabels, forest: _Forest, room_area_m2: float) -> NDArray[np.int32]:
    places = [forest.place(basin) for basin in range(len(forest.area_m2))]
    rooms = {place for place in places[1:] if forest.area_m2[place] >= room_area_m2}
    ordered = sorted(rooms, key=lambda place: (-forest.area_m2[place], place))
    number = {place: rank for rank, place in enumerate(ordered[:MAX_ROOMS], start=1)}
    table = np.array([0] + [number.get(place, 0) for place in places[1:]], np.int32)
    return table[basins]
