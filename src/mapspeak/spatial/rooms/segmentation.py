"""A raster cut into rooms: at its narrow places, and at wide openings between wall ends.

Such openings are too wide, beside the rooms behind, for clearances to see.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import IntArray
from mapspeak.spatial.rooms.basins import (
    Basins,
    Passes,
    build_basins,
    describe_passes,
    find_passes,
)
from mapspeak.spatial.rooms.borders import PlaceGraph
from mapspeak.spatial.rooms.floor import Floor, build_floor, cut_away
from mapspeak.spatial.rooms.joining import (
    join_places,
    judge_left,
    load_judge,
    number_by_area,
)
from mapspeak.spatial.rooms.raster import (
    SETTINGS,
    Affine,
    Picture,
    Places,
    Raster,
    Truths,
    find_cells,
)
from mapspeak.spatial.rooms.room_map import RoomMap

_APART_M = 0.4
"""Openings nearer than this to each other, one behind the other, are one doorway."""
_DRIFT_RATIO = 0.25
"""A wall that leaves its line by more than this share of the way does not run along it."""

Spot = tuple[float, float]
Opening = tuple[int, int, int]
"""Row, first column, and the column behind the last."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Doorway:
    """An opening between two jambs, given as columns and rows of the raster.

    Attributes:
        roots: Where the solid pieces begin of which the jambs are the ends.
    """

    start: Spot
    end: Spot
    roots: tuple[Spot, Spot]
    width_m: float

    def beside(self, cells: float) -> tuple[int, int]:
        """Return the row and the column that many cells off the middle, at right angles."""
        across, along = self.end[0] - self.start[0], self.end[1] - self.start[1]
        share = cells / math.hypot(across, along)
        col = (self.start[0] + self.end[0]) / 2 - share * along
        row = (self.start[1] + self.end[1]) / 2 + share * across
        return round(row), round(col)


def find_doorways(raster: Raster, floor: Floor) -> list[Doorway]:
    """Return the wide openings in line with walls along the rows, or the columns.

    One jamb is the end of something thin that runs on in line; the other is such an end too, or
    the corner of a wall.
    """
    jamb = floor.wall | floor.obstacle
    margin = round(max(SETTINGS.stub_m, SETTINGS.tip_m) / raster.cell_size_m) + 2
    pictures = [
        np.pad(picture, margin)
        for picture in (jamb, floor.wall, floor.solid, floor.floor & (1 - jamb))
    ]
    sideways = [np.asarray(cv2.transpose(picture), np.uint8) for picture in pictures]
    back = np.array([[1.0, 0.0, -margin], [0.0, 1.0, -margin]])
    rows = _find_along_rows(pictures, back, raster)
    cols = _find_along_rows(sideways, back[:, [1, 0, 2]], raster)
    return rows + cols


def _find_along_rows(pictures: list[Picture], back: Affine, raster: Raster) -> list[Doorway]:
    jamb, wall, solid, floor = pictures
    row, first, stop = _find_gaps(floor, jamb, raster)
    jambs = _Jambs(wall, solid, raster.cell_size_m)
    left_end, right_end = jambs.is_end(row, first - 1, -1), jambs.is_end(row, stop, 1)
    left_corner, right_corner = jambs.is_corner(row, first - 1, -1), jambs.is_corner(row, stop, 1)
    chosen = (left_end & (right_end | right_corner)) | (right_end & left_corner)
    openings = _choose_narrowest(
        row[chosen], first[chosen], stop[chosen], round(_APART_M / raster.cell_size_m)
    )
    longest = round(SETTINGS.wall_length_m / raster.cell_size_m)
    return [_doorway(opening, solid, longest, back, raster.cell_size_m) for opening in openings]


def _find_gaps(floor: Picture, jamb: Picture, raster: Raster) -> tuple[Places, Places, Places]:
    """Return row, first column and the column behind the last of floor between jambs."""
    # The margin is no floor, so that changes come in pairs and no run goes on in the next row.
    change = np.flatnonzero(floor.ravel()[1:] != floor.ravel()[:-1]) + 1
    first, stop = change[::2], change[1::2]
    width_m = (stop - first) * raster.cell_size_m
    cells = jamb.ravel()
    chosen = (width_m > SETTINGS.leaf_width_m) & (width_m <= SETTINGS.door_width_m)
    chosen &= (cells[first - 1] & cells[stop]) > 0
    row, first_col = np.divmod(first[chosen], floor.shape[1])
    return row, first_col, first_col + (stop - first)[chosen]


class _Jambs:
    """Tells what stands at the ends of a gap.

    Args:
        wall: 1 on walls.
        solid: 1 where nothing is free.
    """

    def __init__(self, wall: Picture, solid: Picture, cell_size_m: float) -> None:
        self._wall, self._solid = wall > 0, solid > 0
        self._stub = max(round(SETTINGS.stub_m / cell_size_m), 1)
        self._tip = max(round(SETTINGS.tip_m / cell_size_m), 1)

    def is_end(self, row: Places, col: Places, step: int) -> Truths:
        """Return True at the end of something thin that runs on in the direction of the step."""
        is_end = np.ones(row.size, bool)
        up, down = self._extent(row, col)
        at_first = up - down
        for further in range(self._stub):
            up, down = self._extent(row, col + step * further)
            # Twice the way from the middle of the wall here to that at the jamb.
            drift = np.abs(up - down - at_first)
            is_end &= self._solid[row, col + step * further] & (up + down < self._tip)
            is_end &= drift <= 2 * _DRIFT_RATIO * self._stub
        return is_end

    def is_corner(self, row: Places, col: Places, step: int) -> Truths:
        """Return True where a wall ends above or below."""
        up, down = self._extent(row, col + step)
        return self._wall[row, col] & (np.minimum(up, down) <= self._tip)

    def _extent(self, row: Places, col: Places) -> tuple[Places, Places]:
        """Return how many solid cells follow above and below; one more than a tip has, at most."""
        extents = []
        for way in (-1, 1):
            is_solid = self._solid[row, col]
            n = np.zeros(row.size, np.intp)
            for further in range(1, self._tip + 2):
                is_solid = is_solid & self._solid[row + way * further, col]
                n += is_solid
            extents.append(n)
        return extents[0], extents[1]


def _choose_narrowest(row: Places, first: Places, stop: Places, reach: int) -> list[Opening]:
    """Return the narrowest of openings that lie one behind the other."""
    kept: list[Opening] = []
    for i in np.lexsort((first, row, stop - first)).tolist():
        here = int(row[i]), int(first[i]), int(stop[i])
        is_behind = any(
            abs(here[0] - other[0]) <= reach and here[1] < other[2] and other[1] < here[2]
            for other in kept
        )
        if not is_behind:
            kept.append(here)
    return kept


def _doorway(
    opening: Opening, solid: Picture, longest: int, back: Affine, cell_size_m: float
) -> Doorway:
    row, first, stop = opening
    left = _run(solid[row, max(first - longest, 0) : first][::-1])
    right = _run(solid[row, stop : stop + longest])
    root, start, end, other_root = (
        (float(x), float(y))
        for x, y in (
            back @ (col, row, 1.0) for col in (first - left, first - 1, stop, stop + right - 1)
        )
    )
    width_m = (stop - first) * cell_size_m
    return Doorway(start=start, end=end, roots=(root, other_root), width_m=width_m)


def _run(solid: Picture) -> int:
    """Return how many cells are solid before the first that is not."""
    return int(np.argmin(solid)) if not solid.all() else solid.size


Labels = NDArray[np.int32]

_CUT_CELLS = 2
"""Basins would leak through a thinner line that runs askew."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Segmentation:
    """Room numbers on a raster.

    Attributes:
        floor: The floor of it, without furniture.
        labels: 0 for no room, else from 1, the largest room first.
        doubts: How sure it is that nothing divides two rooms, 0 to 1; the smaller number first.
    """

    raster: Raster
    floor: Floor
    labels: Labels
    doubts: Mapping[tuple[int, int], float]


def segment(raster: Raster, previous: RoomMap | None = None) -> Segmentation:
    """Divide the floor of a raster into rooms, rather as on the map before than otherwise."""
    floor = build_floor(raster)
    doorways = find_doorways(raster, floor)
    cut = draw_cuts(doorways, floor.floor)
    basins, passes = find_borders(raster, floor, doorways, cut)
    graph = PlaceGraph(basins, passes, raster)
    judge = load_judge()
    before = None if previous is None else _find_before(raster, basins, previous)
    join_places(graph, judge, before)
    number = number_by_area(graph)
    doubts = {
        (min(pair), max(pair)): share
        for places, share in judge_left(graph, judge).items()
        if 0 not in (pair := number[list(places)].tolist())
    }
    labels = fill_cuts(number[basins.labels], cut)
    return Segmentation(raster=raster, floor=floor, labels=labels, doubts=doubts)


def _find_before(raster: Raster, basins: Basins, previous: RoomMap) -> IntArray:
    """Return the region of an earlier map in which each basin's peak lies, 0 for none."""
    rows, cols = np.divmod(basins.peaks, basins.labels.shape[1])
    before = np.zeros(int(basins.labels.max(initial=0)) + 1, np.intp)
    points = raster.points_at(rows + 0.5, cols + 0.5)
    before[basins.labels[rows, cols]] = previous.grid.look_up(previous.labels, points, outside=0)
    return before


def find_borders(
    raster: Raster, floor: Floor, doorways: list[Doorway], cut: Picture
) -> tuple[Basins, Passes]:
    """Return the basins of a floor that has been cut at its doorways, and the ways between them."""
    size_m = raster.cell_size_m
    cut_floor = cut_away(floor, cut, size_m)
    heights = _smooth(cut_floor.clearance_m, cut_floor.floor, SETTINGS.smoothing_m / size_m)
    basins = build_basins(heights, cut_floor.floor)
    passes = find_passes(basins, floor, size_m), _find_passes_at(doorways, basins, floor, size_m)
    return basins, Passes(
        pairs=np.concatenate([part.pairs for part in passes]),
        values=np.concatenate([part.values for part in passes]),
    )


def _smooth(clearance_m: NDArray[np.float32], floor: Picture, sigma: float) -> NDArray[np.float32]:
    smooth = cv2.GaussianBlur(clearance_m, (0, 0), sigma, borderType=cv2.BORDER_CONSTANT)
    return np.where(floor > 0, smooth, np.float32(0))


def draw_cuts(doorways: list[Doorway], floor: Picture) -> Picture:
    """Return 1 on the floor between the jambs, and on jambs that were taken for furniture."""
    cut = np.zeros_like(floor)
    for doorway in doorways:
        start, end = ([round(at) for at in root] for root in doorway.roots)
        cv2.line(cut, start, end, 1, thickness=_CUT_CELLS)
    return cut & floor


def _find_passes_at(
    doorways: list[Doorway], basins: Basins, floor: Floor, cell_size_m: float
) -> Passes:
    """Return the ways across the cuts, which no basin leads through."""
    cells: list[tuple[int, int]] = []
    half_m = []
    for doorway in doorways:
        one, other = (_first_cell(doorway, basins.labels, side) for side in (-1, 1))
        numbers = _number_at(basins.labels, one), _number_at(basins.labels, other)
        if 0 != numbers[0] != numbers[1] != 0:
            flat = [row * basins.labels.shape[1] + col for row, col in (one, other)]
            cells.append((flat[0], flat[1]) if numbers[0] < numbers[1] else (flat[1], flat[0]))
            half_m.append(doorway.width_m / 2)
    widths_m = np.array(half_m, np.float64)
    return describe_passes(
        basins,
        floor,
        np.array(cells, np.intp).reshape(-1, 2).T,
        half_m=widths_m,
        contact_m=2 * widths_m,
        cell_size_m=cell_size_m,
    )


def _first_cell(doorway: Doorway, numbers: Labels, side: int) -> tuple[int, int]:
    """Return the first cell with a number on one side of a doorway that has been cut."""
    places = [doorway.beside(side * off) for off in range(1, 3 * _CUT_CELLS)]
    return next((place for place in places if _number_at(numbers, place) > 0), places[0])


def _number_at(numbers: Labels, place: tuple[int, int]) -> int:
    row, col = place
    is_inside = 0 <= row < numbers.shape[0] and 0 <= col < numbers.shape[1]
    return int(numbers[row, col]) if is_inside else 0


def fill_cuts(labels: Labels, cut: Picture) -> Labels:
    """Add the cells of a cut to the regions beside it."""
    rows, cols = find_cells(cut > 0)
    filled = labels.copy()
    for _ in range(_CUT_CELLS + 1):
        own = filled[rows, cols]
        beside = [filled[rows + down, cols + right] for down, right in _STEPS]
        filled[rows, cols] = np.where(own > 0, own, np.max(beside, axis=0))
    return filled


_STEPS = ((-1, 0), (1, 0), (0, -1), (0, 1))
