"""Basins merged into rooms: a border stays only where a person would draw one."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.rooms.basins import BasinLabels, Heights, Saddle
from mapspeak.spatial.rooms.frames import Frames
from mapspeak.spatial.rooms.settings import RoomSettings

MAX_ROOMS = int(np.iinfo(np.int16).max)
"""As many as the labels can tell apart; smaller rooms than these are left out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Border:
    """A saddle that divides two places, and the metres of wall in line with it."""

    saddle: Saddle
    wall_m: float


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
        """Gives the place a basin belongs to by now."""
        while self._parent[basin] != basin:
            self._parent[basin] = self._parent[self._parent[basin]]
            basin = self._parent[basin]
        return basin

    def sides(self, saddle: Saddle) -> tuple[int, int]:
        """Gives the two places at a saddle, the narrower first."""
        one, other = self.place(saddle.first), self.place(saddle.second)
        return (one, other) if self.clearance_m[one] <= self.clearance_m[other] else (other, one)

    def join(self, narrow: int, wide: int) -> None:
        """Makes the narrower place part of the wider one."""
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
    settings: RoomSettings,
) -> NDArray[np.int32]:
    """Gives room numbers from 1, the largest room first; 0 where no room is."""
    forest = _plant(basins, clearance_m, standing_m, cell_area_m2)
    _join_equal_widths(forest, saddles, settings.same_width_ratio)
    borders = _join_open_borders(forest, saddles, frames, settings)
    _absorb_small(forest, borders, settings)
    return _number_by_area(basins, forest, settings.room_area_m2)


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
    """Joins the many peaks of one room or corridor, so that it is judged as a whole."""
    for saddle in saddles:
        narrow, wide = forest.sides(saddle)
        clearance_m = forest.clearance_m[narrow]
        if saddle.is_doorway:
            continue
        is_open = saddle.height >= same_ratio * clearance_m
        if narrow != wide and is_open and clearance_m >= same_ratio * forest.clearance_m[wide]:
            forest.join(narrow, wide)


def _join_open_borders(
    forest: _Forest, saddles: list[Saddle], frames: Frames, settings: RoomSettings
) -> list[_Border]:
    """Joins across every saddle that divides nothing, from the highest down; gives the others."""
    borders = []
    for saddle in saddles:
        narrow, wide = forest.sides(saddle)
        if narrow == wide:
            continue
        if saddle.is_doorway:
            borders.append(_Border(saddle=saddle, wall_m=settings.frame_m))
            continue
        # Taking furniture away may open a place, but makes no doors by widening what is beside.
        clearance_m, wide_m = forest.standing_m[narrow], forest.clearance_m[wide]
        if _is_narrow(clearance_m, wide_m, saddle, settings):
            wall_m = frames.measure(saddle.row, saddle.col, saddle.height)
            if saddle.height <= _door_ratio(wall_m, settings) * clearance_m:
                borders.append(_Border(saddle=saddle, wall_m=wall_m))
                continue
        if _is_mouth(forest, narrow, wide, saddle, settings):
            borders.append(_Border(saddle=saddle, wall_m=0.0))
        else:
            forest.join(narrow, wide)
    return borders


def _is_narrow(clearance_m: float, wide_m: float, saddle: Saddle, settings: RoomSettings) -> bool:
    """True where a door could be, if there is enough wall in line with it.

    A place that is hardly narrower than both sides, such as a corridor beside a pillar, is none.
    """
    width_m = 2 * saddle.height
    is_leaf = width_m <= settings.leaf_width_m or saddle.height <= settings.wide_ratio * wide_m
    is_door_wide = is_leaf and width_m <= settings.door_width_m
    return is_door_wide and saddle.height <= settings.door_ratio * clearance_m


def _door_ratio(wall_m: float, settings: RoomSettings) -> float:
    """Gives how narrow a door must be: the more wall is in line with it, the less."""
    share = min(wall_m / settings.frame_m, 1.0)
    return settings.gap_ratio + share * (settings.door_ratio - settings.gap_ratio)


def _is_mouth(
    forest: _Forest, narrow: int, wide: int, saddle: Saddle, settings: RoomSettings
) -> bool:
    """True where a corridor opens into a much wider place without getting narrower."""
    clearance_m, area_m2 = forest.clearance_m[narrow], forest.area_m2[narrow]
    return (
        2 * saddle.height <= settings.mouth_width_m
        and clearance_m <= settings.mouth_ratio * forest.clearance_m[wide]
        and area_m2 >= settings.mouth_elongation * (2 * clearance_m) ** 2
        and area_m2 >= settings.mouth_area_m2
    )


def _absorb_small(forest: _Forest, borders: list[_Border], settings: RoomSettings) -> None:
    """Joins what is too small for a room across its widest border, until nothing is."""
    changed = True
    while changed:
        changed = False
        for border in borders:
            narrow, wide = forest.sides(border.saddle)
            area_m2 = min(forest.area_m2[narrow], forest.area_m2[wide])
            if narrow != wide and area_m2 < _least_area(border, settings):
                forest.join(narrow, wide)
                changed = True


def _least_area(border: _Border, settings: RoomSettings) -> float:
    """Gives how large a place behind this border must be: a niche has no door frame."""
    is_framed = border.wall_m >= settings.frame_m / 2
    is_framed &= 2 * border.saddle.height >= settings.least_door_m
    return settings.room_area_m2 if is_framed else settings.niche_area_m2


def _number_by_area(basins: BasinLabels, forest: _Forest, room_area_m2: float) -> NDArray[np.int32]:
    places = [forest.place(basin) for basin in range(len(forest.area_m2))]
    rooms = {place for place in places[1:] if forest.area_m2[place] >= room_area_m2}
    ordered = sorted(rooms, key=lambda place: (-forest.area_m2[place], place))
    number = {place: rank for rank, place in enumerate(ordered[:MAX_ROOMS], start=1)}
    table = np.array([0] + [number.get(place, 0) for place in places[1:]], np.int32)
    return table[basins]
