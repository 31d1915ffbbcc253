"""What is not floor, as a picture along whose rows and columns the walls run."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.rooms.raster import Picture

Numbers = NDArray[np.int16] | NDArray[np.int32]
Places = NDArray[np.intp]
Truths = NDArray[np.bool_]
Affine = NDArray[np.float64]

_UPRIGHT_DEG = 0.6
"""A map whose walls are this near to its rows and columns need not be turned."""


def turn_upright(
    free: Picture, occupied: Picture, wall: Picture, angle_deg: float
) -> tuple[Picture, ...]:
    """Return all three so turned that walls of this direction run along rows and columns."""
    if _is_upright(angle_deg):
        return free, occupied, wall
    there, size = _find_turn(free.shape, angle_deg)
    turned = [
        np.asarray(cv2.warpAffine(part, there, size, flags=cv2.INTER_NEAREST), np.uint8)
        for part in (free, occupied, wall)
    ]
    # What is one cell thick falls apart when it is turned.
    solid, closed_wall = (
        np.asarray(cv2.morphologyEx(part, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)), np.uint8)
        for part in turned[1:]
    )
    return turned[0] & (1 - solid), solid, closed_wall


def turn_back(picture: Picture, shape: tuple[int, int], angle_deg: float) -> Picture:
    """Return a picture that was found on turned ones as it lies on those of this shape."""
    if _is_upright(angle_deg):
        return picture
    there, _ = _find_turn(shape, angle_deg)
    flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(picture, there, shape[::-1], flags=flags), np.uint8)


def _is_upright(angle_deg: float) -> bool:
    return abs((angle_deg + 45.0) % 90.0 - 45.0) <= _UPRIGHT_DEG


def _find_turn(shape: tuple[int, ...], angle_deg: float) -> tuple[Affine, tuple[int, int]]:
    high, wide = shape
    middle = (wide / 2, high / 2)
    there = np.asarray(cv2.getRotationMatrix2D(middle, angle_deg, 1.0), np.float64)
    radians = math.radians(angle_deg)
    cosine, sine = abs(math.cos(radians)), abs(math.sin(radians))
    across, along = math.ceil(wide * cosine + high * sine), math.ceil(wide * sine + high * cosine)
    there[:, 2] += np.array([(across - wide) / 2, (along - high) / 2])
    return there, (across, along)


def open_box(picture: Picture, high: int, wide: int) -> Picture:
    """Return where a box of so many cells fits; what lies outside of the picture is not set."""
    box = np.ones((high, wide), np.uint8)
    return np.asarray(
        cv2.morphologyEx(
            picture, cv2.MORPH_OPEN, box, borderType=cv2.BORDER_CONSTANT, borderValue=(0,)
        ),
        np.uint8,
    )


def widen(picture: Picture, cells: int) -> Picture:
    """Return what is set, and what is so near to it."""
    side = 2 * cells + 1
    return np.asarray(cv2.dilate(picture, np.ones((side, side), np.uint8)), np.uint8)


def is_near(picture: Picture, cells: int, axis: int) -> Truths:
    """Return True where something is set at most so many cells away along an axis."""
    return np.asarray(cv2.dilate(picture, line_along(2 * cells + 1, axis)) > 0)


def is_short(solid: Picture, most: int, axis: int) -> Truths:
    """Return True in what is solid for at most so many cells along an axis, between floor."""
    high, wide = (most, 0) if axis == 0 else (0, most)
    framed = cv2.copyMakeBorder(solid, high, high, wide, wide, cv2.BORDER_CONSTANT, value=1)
    line = line_along(most + 1, axis)
    # A line of an even number of cells has no middle: go by its ends.
    cells = cv2.erode(framed, line, anchor=(0, 0), borderValue=(1,))
    long = cv2.dilate(cells, line, anchor=(line.shape[1] - 1, line.shape[0] - 1))
    inside = long[high : high + solid.shape[0], wide : wide + solid.shape[1]]
    return np.asarray((solid > 0) & (inside == 0))


def line_along(cells: int, axis: int) -> Picture:
    """Return a line of so many cells."""
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


def take_lines(picture: Picture, lines: Places, axis: int) -> Picture:
    """Return these lines of a picture along an axis: columns along 0, rows along 1."""
    return np.take(picture, lines, axis=1 - axis)


def put_lines(picture: Picture, found: Truths, lines: Places, axis: int) -> None:
    """Set in these lines of a picture what was found in them."""
    here = (slice(None), lines) if axis == 0 else (lines, slice(None))
    picture[here] |= found.astype(np.uint8)


def last_place(is_set: Truths, axis: int, *, none: int) -> Numbers:
    """Return for each cell the place of the last cell set up to it, along an axis."""
    here = places(is_set.shape, axis)
    marked = np.where(is_set, here, here.dtype.type(none))
    return np.asarray(np.maximum.accumulate(marked, axis=axis))


def places(shape: tuple[int, ...], axis: int) -> Numbers:
    """Return the rows, or the columns, of all cells, to be broadcast."""
    # Small numbers are accumulated faster; the places of no cell are negative.
    n = shape[axis]
    is_small = 3 * n < np.iinfo(np.int16).max
    here: Numbers = np.arange(n, dtype=np.int16) if is_small else np.arange(n, dtype=np.int32)
    return here.reshape((-1, 1) if axis == 0 else (1, -1))


def drop_specks(free: Picture, least: float) -> Picture:
    """Return the floor without parts of fewer cells."""
    _, label, stats, _ = cv2.connectedComponentsWithStats(free, connectivity=4)
    is_kept = stats[:, cv2.CC_STAT_AREA] >= least
    is_kept[0] = False
    return np.asarray(is_kept[label], np.uint8)


def drop_small(solid: Picture, least: float) -> Picture:
    """Return what is solid without what is smaller across and has floor all around."""
    framed = cv2.copyMakeBorder(solid, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=1)
    _, label, stats, _ = cv2.connectedComponentsWithStats(framed, connectivity=8)
    across = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    is_kept = across >= least
    is_kept[0] = False
    return np.asarray(is_kept[label[1:-1, 1:-1]], np.uint8)


def find_fixed(solid: Picture) -> Picture:
    """Return what hangs together with the outside of the picture."""
    framed = cv2.copyMakeBorder(solid, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=1)
    _, label = cv2.connectedComponents(framed, connectivity=8)
    return np.asarray(label[1:-1, 1:-1] == label[0, 0], np.uint8)
