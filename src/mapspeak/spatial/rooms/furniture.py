"""Tell furniture from walls: it is thicker than they are, and short.

A block stands free, or with its back to a wall, with floor at its other sides. If a wall continues
in line behind a block, that part is wall, and the block ends there.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.rooms.raster import (
    SETTINGS,
    Picture,
    Raster,
    Truths,
    close_gaps,
    drop_small,
    drop_specks,
    find_boxes,
    find_fixed,
    find_touching,
    is_near,
    is_short,
    label_parts,
    line_along,
    open_box,
    run_lengths,
    widen,
)

_SPECK_M2 = 0.5
"""Free specks up to this size in or beside a block do not count as free."""
_RIM_M = 0.15
"""Crumbs this near to a block belong to it: the rim of a plant, the legs of a chair."""
_CRUMB_M = 1.0
"""Remains of an obstacle without its blocks are crumbs if smaller across than this."""
_FILLED_RATIO = 0.7
"""Least share that a block at a wall fills of its rectangle, square to the walls."""
_SEEN_RATIO = 0.5
"""Least share of that rectangle's sides towards floor where an obstacle was seen."""
_WHOLE_RATIO = 0.85
"""Obstacles at a wall longer than this share of the limit may go on: they are not blocks."""

_STUB_M = 0.3
"""The shortest piece of wall, ending at a block, that runs on behind it."""

Counts = NDArray[np.intp]
Numbers = NDArray[np.int32]


def find_blocks(raster: Raster, wall: Picture, *, longest_m: float) -> tuple[Picture, Picture]:
    """Return 1 on furniture with its inside, and 1 on the walls behind it.

    Args:
        wall: 1 on presumed wall; only wall continues behind furniture.
        longest_m: The floor around furniture is at most this far, along the walls and square to
            them.
    """
    solid = 1 - drop_specks(raster.free, _SPECK_M2 / raster.cell_area_m2)
    joined = find_fixed(solid)
    cells = _Sizes(solid, joined, raster.cell_size_m, longest_m)
    if cells.thin >= cells.thick:
        return np.zeros_like(solid), np.zeros_like(solid)
    bump = open_box(_find_bumps(solid, cells), cells.thin, cells.thin)
    if not bump.any():
        return bump, bump
    behind = _continue_walls(solid, bump, wall, cells)
    piece = open_box(bump & (1 - behind), cells.depth, cells.depth)
    rest = solid & (1 - piece)
    fixed = drop_small(rest, cells.crumb)
    block = _choose_blocks(piece, fixed, raster.occupied, solid, cells)
    crumb = rest & (1 - fixed)
    block |= find_touching(crumb & (1 - joined), block)
    block |= widen(block, cells.rim) & crumb
    side = 2 * cells.tip + 1
    # Nothing sees what lies between two blocks, so that no bump begins there.
    behind &= (bump & widen(block, cells.tip)) | close_gaps(block, np.ones((side, side), np.uint8))
    return block, behind & (1 - block)


class _Sizes:
    """Lengths in raster cells.

    Attributes:
        thin: Blocks are at least this thick, wall behind them included.
        depth: Blocks are at least this thick without that wall.
        thick: Blocks are at most this thick in at least one direction.
        long: Largest distance to the floor beside a block.
        tip: Largest distance from the middle of a wall to floor.
    """

    def __init__(
        self, solid: Picture, fixed: Picture, cell_size_m: float, longest_m: float
    ) -> None:
        self.depth = round(SETTINGS.block_depth_m / cell_size_m) | 1
        self.thick = round(SETTINGS.block_thickness_m / cell_size_m) | 1
        wall = SETTINGS.block_ratio * _find_wall_thickness(
            solid, fixed, self.thick, 2 * SETTINGS.oblique_length_m / cell_size_m
        )
        self.thin = max(round(SETTINGS.block_depth_m / cell_size_m) + 2, round(wall)) | 1
        self.long = round(longest_m / cell_size_m)
        self.stub = round(_STUB_M / cell_size_m) | 1
        self.tip = round(SETTINGS.tip_m / cell_size_m)
        self.rim = round(_RIM_M / cell_size_m)
        self.crumb = _CRUMB_M / cell_size_m


def _find_wall_thickness(solid: Picture, fixed: Picture, most: int, least: float) -> float:
    """Return how thick walls mostly are, in cells: what has floor on two sides and is fixed."""
    found = []
    for axis in (0, 1):
        first, length = run_lengths(solid, axis)
        is_fixed = np.ascontiguousarray(fixed.T if axis == 0 else fixed).ravel()[first] > 0
        found.append(length[is_fixed & (length <= most)])
    all_of_them = np.concatenate(found)
    # This little may be all furniture, in a room without inner walls.
    return float(np.median(all_of_them)) if all_of_them.size >= least else 0.0


def _find_bumps(solid: Picture, cells: _Sizes) -> Picture:
    """Return 1 where the floor is near along the row and along the column, or on both sides."""
    floor = 1 - solid
    bump = is_near(floor, cells.long, 0) & is_near(floor, cells.long, 1)
    for axis in (0, 1):
        bump |= is_short(solid, cells.thick, axis)
    return np.asarray(bump, np.uint8) & solid


# --- walls behind ----------------------------------------------------------------------------


def _continue_walls(solid: Picture, bump: Picture, seen_wall: Picture, cells: _Sizes) -> Picture:
    """Return 1 where walls that end at bumps run on in line, within them and between."""
    wall = np.zeros_like(solid)
    for axis in (0, 1):
        stub = _find_stubs(solid, bump, seen_wall, axis, cells)
        is_beside = is_near(bump, cells.tip, 1 - axis).any(axis=axis)
        lines = np.flatnonzero(stub.any(axis=axis) & is_beside)
        if lines.size:
            s, through = (np.take(part, lines, axis=1 - axis) > 0 for part in (stub, solid))
            here = (slice(None), lines) if axis == 0 else (lines, slice(None))
            wall[here] |= _run_on(s, through, axis, cells.long)
    return wall


def _run_on(stub: Truths, through: Truths, axis: int, longest: int) -> Truths:
    """Return the cells to go through that lead from a stub along an axis, in either direction."""
    found = np.zeros_like(stub)
    place = np.arange(stub.shape[axis]).reshape((-1, 1) if axis == 0 else (1, -1))
    for flipped in (False, True):
        s, t = (np.flip(part, axis) if flipped else part for part in (stub, through))
        last_stub = np.maximum.accumulate(np.where(s, place, -longest - 1), axis=axis)
        last_other = np.maximum.accumulate(np.where(s | t, -longest - 1, place), axis=axis)
        leads = t & (last_other <= last_stub) & (place - last_stub <= longest)
        found |= np.flip(leads, axis) if flipped else leads
    return found


def _find_stubs(
    solid: Picture, bump: Picture, seen_wall: Picture, axis: int, cells: _Sizes
) -> Picture:
    """Return pieces of thin wall along an axis.

    A piece must hold presumed wall that runs that way for twice the length, unlike the shadow of a
    chair, or a speck on a wall.
    """
    across = 1 - axis
    seen = open_box(widen(seen_wall, 1), *line_along(2 * cells.stub + 1, axis).shape)
    # What is widened so that runs bear a step aside is not to be longer for it.
    held = seen & solid & np.asarray(cv2.dilate(seen_wall, line_along(3, across)), np.uint8)
    for _ in range(cells.thin):
        held = np.asarray(cv2.dilate(held, line_along(3, across)), np.uint8) & solid
    long = open_box(solid & (1 - bump), *line_along(cells.stub, axis).shape)
    is_thin = is_short(solid, cells.thin, across).astype(np.uint8)
    return np.asarray(long & held & is_thin, np.uint8)


# --- choice ----------------------------------------------------------------------------------


def _choose_blocks(
    piece: Picture, fixed: Picture, occupied: Picture, solid: Picture, cells: _Sizes
) -> Picture:
    """Return the pieces that are furniture."""
    n, numbers = label_parts(piece, connectivity=4)
    floor = 1 - solid
    # The cells in and beside each piece have its number.
    grown = cv2.dilate(numbers.astype(np.float32), np.ones((3, 3), np.uint8))
    around = np.asarray(grown, np.int32)
    n_contact = np.bincount(around[fixed > 0], minlength=n)
    is_at_wall = _fills_rectangle(numbers, n, cells) & (n_contact >= cells.depth)
    rim = numbers * widen(floor, 1)
    n_rim, n_seen = (np.bincount(each.ravel(), minlength=n) for each in (rim, rim * occupied))
    is_block = (n_contact == 0) | (is_at_wall & (n_seen >= _SEEN_RATIO * n_rim))
    is_block &= _count_sides(around, n, floor, piece, cells) == 1
    is_block[numbers[open_box(piece, cells.thick, cells.thick) > 0]] = False
    is_block[0] = False
    return np.asarray(is_block[numbers], np.uint8)


def _count_sides(around: Numbers, n: int, floor: Picture, piece: Picture, cells: _Sizes) -> Counts:
    """Return how many stretches of floor that do not hang together near by each piece borders on.

    A piece with two of them divides them, as walls do.
    """
    near = widen(piece, cells.tip) & floor
    _, stretch = label_parts(near, connectivity=4)
    here = (near > 0) & (around > 0)
    pairs, counts = np.unique(stretch[here] * np.int64(n) + around[here], return_counts=True)
    least = max(cells.rim, 1)
    return np.bincount(pairs[counts >= least] % n, minlength=n)


def _fills_rectangle(label: Numbers, n: int, cells: _Sizes) -> Truths:
    """Return True for each piece that fills the rectangle around it and is not too long."""
    low, high = find_boxes(label, n)
    spans = high - low
    is_whole = np.maximum(*spans) < _WHOLE_RATIO * cells.long
    filled = np.bincount(label.ravel(), minlength=n) >= _FILLED_RATIO * spans[0] * spans[1]
    return np.asarray(is_whole & filled)
