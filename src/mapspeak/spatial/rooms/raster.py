"""The raster on which rooms are found: cropped to the known, near one cell size for every map.

It is turned where the walls do not run along the rows and columns of the map.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.spatial.grid import FREE_MAX, UNKNOWN, FloatArray, OccupancyGrid
from mapspeak.spatial.rooms.directions import find_main_direction


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomSettings:
    """One setting for every building; no field needs to change from map to map.

    Attributes:
        cell_size_m: The raster on which rooms are found, whatever the map's resolution.
        wall_length_m: A straight run of occupied cells this long, in a main direction, is wall.
        oblique_length_m: The same for any other direction.
        wall_reach_m: Shorter runs in line with a wall belong to it, up to this far from its ends.
        wall_piece_m: The shortest run that can be such a piece.
        wall_thickness_m: Where an obstacle is this thick, it is no such piece.
        island_size_m: An obstacle that can be walked around is wall only if it is larger.
        block_depth_m: Furniture is at least this deep.
        block_ratio: With the wall behind it, it is this many times as thick as the map's walls.
        block_thickness_m: One of its sides is at most this long.
        block_length_m: The floor around it is at most this far, along the walls and square to
            them.
        pocket_area_m2: Unseen areas up to this size inside a room count as floor.
        smoothing_m: Standard deviation of the smoothing of clearances.
        door_width_m: The widest opening between wall ends that is looked at as a door.
        leaf_width_m: A narrower one shows in the clearances.
        stub_m: The shortest piece of wall, in line with such an opening, that is a jamb of it.
        tip_m: The thickest such piece.
        keep_share: So much surer must be what divides otherwise than on the map before.
        room_area_m2: Smaller regions belong to their neighbour.
        part_area_m2: The same for a region that is hardly seen yet.
        least_clearance_m: Half the width that a region must have somewhere.
        half_seen_share: Least unseen share of the outline of such a region.
    """

    cell_size_m: float = 0.05
    wall_length_m: float = 1.2
    oblique_length_m: float = 2.4
    wall_reach_m: float = 2.0
    wall_piece_m: float = 0.2
    wall_thickness_m: float = 0.5
    island_size_m: float = 2.0
    block_depth_m: float = 0.35
    block_ratio: float = 2.0
    block_thickness_m: float = 1.3
    block_length_m: float = 3.0
    pocket_area_m2: float = 2.0
    smoothing_m: float = 0.1
    door_width_m: float = 3.5
    leaf_width_m: float = 1.0
    stub_m: float = 0.5
    tip_m: float = 0.25
    keep_share: float = 0.2
    room_area_m2: float = 1.5
    part_area_m2: float = 0.5
    least_clearance_m: float = 0.2
    half_seen_share: float = 0.1


SETTINGS = RoomSettings()

Picture = NDArray[np.uint8]
Numbers = NDArray[np.int16] | NDArray[np.int32]
Places = NDArray[np.intp]
Truths = NDArray[np.bool_]
Affine = NDArray[np.float64]

UPRIGHT_DEG = 0.6
"""Walls this near to the rows and columns of the map need no turn."""
_LEAST_COVER, _HALF_COVER = 64, 128
"""Least cover, of 255, by the map's cells for a cell to be set: of what is thin, and else."""

MAX_GRID_CELLS = 120_000_000
MAX_RASTER_CELLS = 5_000_000
MAX_SIDE_CELLS = 32_000
"""OpenCV counts the rows and columns of what it warps in 16 bits."""
MAX_UPSCALING = 4


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Raster:
    """The known part of a map at a working resolution, turned so that its walls are upright.

    A frame of one unseen cell around it stands for all that lies beyond.

    Attributes:
        free: 1 where a robot can be, else 0.
        occupied: 1 on obstacles, else 0.
        cell_size_m: The side of one raster cell.
        there: From (col, row) of the grid to that of the raster; a cell's centre lies at +0.5.
    """

    free: Picture
    occupied: Picture
    cell_size_m: float
    there: Affine
    grid: OccupancyGrid

    @property
    def cell_area_m2(self) -> float:
        """The area of one raster cell."""
        return self.cell_size_m**2

    @property
    def turn_rad(self) -> float:
        """Rotation of the raster against the grid."""
        return math.atan2(self.there[1, 0], self.there[0, 0])

    def point_at(self, row: float, col: float) -> Point:
        """Return the place of a point of the raster; a cell's centre lies at +0.5, +0.5."""
        return Point(*self.points_at(np.array([row]), np.array([col]))[0].tolist())

    def points_at(self, rows: FloatArray, cols: FloatArray) -> FloatArray:
        """Return the places of points of the raster, in metres, shape (n, 2)."""
        across, along = cv2.invertAffineTransform(self.there) @ (cols, rows, np.ones(len(rows)))
        return self.grid.points_at(along - 0.5, across - 0.5)

    def on_grid(self, numbers: NDArray[np.int32]) -> NDArray[np.int16]:
        """Return the number of each cell of the grid, 0 outside of the raster."""
        return _sample(numbers, _between_centres(self.there), self.grid.cells.shape)

    def of_grid(self, numbers: NDArray[np.int16]) -> NDArray[np.int16]:
        """Return the number of the grid's cell that each cell of the raster lies in."""
        there = _between_centres(np.asarray(cv2.invertAffineTransform(self.there), np.float64))
        return _sample(numbers, there, self.free.shape)


def _sample(numbers: Numbers, there: Affine, shape: tuple[int, ...]) -> NDArray[np.int16]:
    """Return the numbers at the cells of a picture of this shape, 0 outside."""
    if 0 in shape:
        return np.zeros(shape, np.int16)
    flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(numbers.astype(np.int16), there, shape[::-1], flags=flags))


def find_cells(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the rows and columns of the cells that are set, row by row; nonzero is far slower."""
    places = np.flatnonzero(mask)
    return np.divmod(places, mask.shape[1]) if places.size else (places, places)


_ASK_FOR_LESS = "Ask for a part of it, or for a map at a coarser resolution."


def build_raster(grid: OccupancyGrid) -> Raster:
    """Return the known part of a map in cells of about the size set, its walls upright.

    Raises:
        MapError: The map has more cells than can be handled.
    """
    n = grid.cells.size
    if n > MAX_GRID_CELLS:
        raise MapError(f"The map has {n} cells, more than {MAX_GRID_CELLS}.", hint=_ASK_FOR_LESS)
    if max(grid.cells.shape) > MAX_SIDE_CELLS:
        raise MapError(
            f"One side of the map has {max(grid.cells.shape)} cells, more than {MAX_SIDE_CELLS}.",
            hint=_ASK_FOR_LESS,
        )
    is_known = grid.cells >= 0
    rows, cols = _extent(np.any(is_known, axis=1)), _extent(np.any(is_known, axis=0))
    shrink, grow = _factors(grid.cells[rows, cols].shape, grid.resolution_m)
    known = np.pad(grid.cells[rows, cols], shrink, constant_values=UNKNOWN)
    cell_size_m = grid.resolution_m * shrink / grow
    free, occupied = (
        np.asarray(mask, np.uint8)
        for mask in ((known >= 0) & (known <= FREE_MAX), known > FREE_MAX)
    )
    there = _shift(cols.start - shrink, rows.start - shrink)
    off_deg = find_main_direction(_resize(occupied, shrink=shrink, grow=grow, full=False))
    if abs(off_deg) > UPRIGHT_DEG:
        turn, size = _find_turn(known.shape, off_deg, grow, shrink)
        free = (_turn(free, turn, size, shrink) >= _HALF_COVER).astype(np.uint8)
        occupied = _settle(_turn(occupied, turn, size, shrink), _LEAST_COVER)
        used = (free | occupied) > 0
        rows, cols = _extent(np.any(used, axis=1)), _extent(np.any(used, axis=0))
        free, occupied = (np.pad(part[rows, cols], 1) for part in (free, occupied))
        there = _shift(cols.start - 1, rows.start - 1) @ turn @ there
    else:
        free = _resize(free, shrink=shrink, grow=grow, full=True)
        occupied = _resize(occupied, shrink=shrink, grow=grow, full=False)
        there = np.diag([grow / shrink, grow / shrink, 1.0]) @ there
    return Raster(
        free=free & (1 - occupied),
        occupied=occupied,
        cell_size_m=cell_size_m,
        there=there[:2],
        grid=grid,
    )


def _shift(col: int, row: int) -> Affine:
    """Return the transform to a picture that begins at that column and row."""
    return np.array([[1.0, 0.0, -col], [0.0, 1.0, -row], [0.0, 0.0, 1.0]])


def _find_turn(
    shape: tuple[int, ...], angle_deg: float, grow: int, shrink: int
) -> tuple[Affine, tuple[int, int]]:
    """Return the transform to a picture with walls of this direction upright, and its size.

    The frame of unseen cells, as many as the picture is shrunk by, is left behind.
    """
    high, wide = (side - shrink for side in shape)
    cosine, sine = (grow / shrink * part(math.radians(angle_deg)) for part in (math.cos, math.sin))
    turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    corners = np.array([(x, y, 1) for x in (shrink, wide) for y in (shrink, high)]) @ turn.T
    turn[:2, 2] = -corners.min(axis=0)[:2]
    across, along = np.ceil(np.ptp(corners, axis=0)[:2]).astype(int).tolist()
    return turn, (across, along)


def _turn(part: Picture, turn: Affine, size: tuple[int, int], shrink: int) -> Picture:
    """Return how far, of 255, each cell of a picture turned, and shrunk, is covered."""
    cover: cv2.typing.MatLike = part * np.uint8(255)
    if shrink > 1:
        # About as wide as the new cells.
        cover = cv2.GaussianBlur(cover, (0, 0), shrink / math.sqrt(12))
    cover = cv2.warpAffine(cover, _between_centres(turn), size, flags=cv2.INTER_LINEAR)
    return np.asarray(cover, np.uint8)


def _settle(cover: Picture, least: int) -> Picture:
    """Return the cells of obstacles as thick as they are, with what is thin left whole.

    Cells covered by less than half are set where they join others, or where nothing else is.
    """
    square = np.ones((3, 3), np.uint8)
    half = (cover >= _HALF_COVER).astype(np.uint8)
    joins = np.asarray(cv2.morphologyEx(half, cv2.MORPH_CLOSE, square)) > 0
    is_alone = np.asarray(cv2.dilate(half, square)) == 0
    is_thin = (cover >= least) & (joins | is_alone)
    return np.asarray(half | is_thin, np.uint8)


def _between_centres(there: Affine) -> Affine:
    """Return a transform between pictures for OpenCV, with (0, 0) in the middle of a cell."""
    moved = there[:2].copy()
    moved[:, 2] += there[:2, :2] @ (0.5, 0.5) - 0.5
    return moved


def _extent(used: NDArray[np.bool_]) -> slice:
    """Return the part from the first set place to the last; of none the first place."""
    places = np.flatnonzero(used)
    return slice(int(places[0]), int(places[-1]) + 1) if places.size else slice(0, 1)


def _factors(shape: tuple[int, ...], resolution_m: float) -> tuple[int, int]:
    """Return by how much to shrink and to grow; one of the two is 1."""
    n_cells = math.prod(shape)
    shrink = max(1, round(SETTINGS.cell_size_m / resolution_m))
    while n_cells / shrink**2 > MAX_RASTER_CELLS:
        shrink += 1
    grow = min(MAX_UPSCALING, max(1, round(resolution_m / SETTINGS.cell_size_m)))
    while grow > 1 and (n_cells * grow**2 > MAX_RASTER_CELLS or max(shape) * grow > MAX_SIDE_CELLS):
        grow -= 1
    return (shrink, 1) if shrink > 1 else (1, grow)


def _resize(picture: Picture, *, shrink: int, grow: int, full: bool) -> Picture:
    """Resize a picture; a shrunk cell is set when half of its cells are, and for what is thin any.

    Args:
        full: True to lose what is thin.
    """
    if grow > 1:
        return np.repeat(np.repeat(picture, grow, axis=0), grow, axis=1)
    if shrink == 1:
        return picture
    high, wide = (-(-side // shrink) for side in picture.shape)
    padded = np.zeros((high * shrink, wide * shrink), np.uint8)
    padded[: picture.shape[0], : picture.shape[1]] = picture
    share = cv2.resize(padded * np.uint8(255), (wide, high), interpolation=cv2.INTER_AREA)
    return (share >= 127).astype(np.uint8) if full else _settle(np.asarray(share, np.uint8), 1)


def open_box(picture: Picture, high: int, wide: int) -> Picture:
    """Return where a box of this many cells fits; cells outside of the picture are not set."""
    box = np.ones((high, wide), np.uint8)
    return np.asarray(
        cv2.morphologyEx(
            picture, cv2.MORPH_OPEN, box, borderType=cv2.BORDER_CONSTANT, borderValue=(0,)
        ),
        np.uint8,
    )


def close_gaps(picture: Picture, shape: Picture) -> Picture:
    """Return the set cells, and gaps between them that a shape does not fit into."""
    side = max(shape.shape)
    # Beyond the picture nothing is set, which OpenCV takes for set when it erodes.
    closed = cv2.morphologyEx(np.pad(picture, side), cv2.MORPH_CLOSE, shape)
    return np.asarray(closed[side:-side, side:-side], np.uint8)


def widen(picture: Picture, cells: int) -> Picture:
    """Return the set cells, and those near them."""
    side = 2 * cells + 1
    return np.asarray(cv2.dilate(picture, np.ones((side, side), np.uint8)), np.uint8)


def is_near(picture: Picture, cells: int, axis: int) -> Truths:
    """Return True where a cell within a distance in cells along an axis is set."""
    return np.asarray(cv2.dilate(picture, line_along(2 * cells + 1, axis)) > 0)


def is_short(solid: Picture, most: int, axis: int) -> Truths:
    """Return True in solid runs up to a length in cells along an axis, between floor."""
    high, wide = (most, 0) if axis == 0 else (0, most)
    framed = cv2.copyMakeBorder(solid, high, high, wide, wide, cv2.BORDER_CONSTANT, value=1)
    line = line_along(most + 1, axis)
    # A line of an even number of cells has no middle: go by its ends.
    cells = cv2.erode(framed, line, anchor=(0, 0), borderValue=(1,))
    long = cv2.dilate(cells, line, anchor=(line.shape[1] - 1, line.shape[0] - 1))
    inside = long[high : high + solid.shape[0], wide : wide + solid.shape[1]]
    return np.asarray((solid > 0) & (inside == 0))


def line_along(cells: int, axis: int) -> Picture:
    """Return a line of this many cells."""
    return np.ones((cells, 1) if axis == 0 else (1, cells), np.uint8)


def run_lengths(solid: Picture, axis: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return where the solid runs between floor begin, in the flat picture, and their lengths.

    Along columns the flat picture is that of the transposed one.
    """
    lines = np.ascontiguousarray(solid.T if axis == 0 else solid)
    framed = np.pad(lines, ((0, 0), (1, 1)))
    change = np.flatnonzero(framed.ravel()[1:] != framed.ravel()[:-1])
    first, stop = change[::2], change[1::2]
    row, col = np.divmod(first, framed.shape[1])
    ends = (col > 0) & (col + stop - first < lines.shape[1])
    return (row * lines.shape[1] + col)[ends], (stop - first)[ends]


def label_parts(picture: Picture, *, connectivity: int) -> tuple[int, NDArray[np.int32]]:
    """Return the number of each cell's part, 0 where nothing is set, and how many numbers."""
    n, label = cv2.connectedComponents(picture, connectivity=connectivity)
    return n, np.asarray(label, np.int32)


def find_boxes(label: NDArray[np.int32], n: int) -> tuple[Places, Places]:
    """Return where the box around each of n numbers begins and stops, (rows, columns) of (2, n)."""
    framed: NDArray[np.int32] = np.pad(label, ((0, 0), (1, 1)))
    rows, cols = find_cells(framed[:, 1:] != framed[:, :-1])
    low, high = np.full((2, n), max(label.shape)), np.zeros((2, n), np.intp)
    for number in (framed[rows, cols], framed[rows, cols + 1]):
        for axis, (first, last) in enumerate(((rows, rows + 1), (cols, cols))):
            np.minimum.at(low[axis], number, first)
            np.maximum.at(high[axis], number, last)
    return low, high


def drop_specks(free: Picture, least: float) -> Picture:
    """Return the floor without parts of fewer cells."""
    n, label = label_parts(free, connectivity=4)
    is_kept = np.bincount(label.ravel(), minlength=n) >= least
    is_kept[0] = False
    return np.take(is_kept.view(np.uint8), label)


def drop_small(solid: Picture, least: float) -> Picture:
    """Return solid cells without smaller pieces that have floor all around."""
    n, label = label_parts(solid, connectivity=8)
    low, high = find_boxes(label, n)
    is_kept = np.hypot(*(high - low)) >= least
    is_kept[0] = False
    return np.take(is_kept.view(np.uint8), label)


def find_touching(picture: Picture, others: Picture) -> Picture:
    """Return the parts of a picture that touch set cells of another."""
    n, label = label_parts(picture, connectivity=8)
    touches = np.zeros(n, np.uint8)
    touches[label[widen(others, 1) > 0]] = 1
    touches[0] = 0
    return np.asarray(touches[label], np.uint8)


def find_fixed(solid: Picture) -> Picture:
    """Return the cells connected to the frame of the raster, which is solid."""
    _, label = label_parts(solid, connectivity=8)
    return np.asarray(label == label[0, 0], np.uint8)
