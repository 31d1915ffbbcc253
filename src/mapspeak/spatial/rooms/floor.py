"""The floor that rooms are cut from: what a robot could drive on if the furniture were gone.

Walls differ from furniture in that they run straight, far, and in line.
"""

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import Mask, OccupancyGrid
from mapspeak.spatial.paths.lattice import measure_away
from mapspeak.spatial.rooms.directions import find_wall_directions
from mapspeak.spatial.rooms.furniture import find_blocks
from mapspeak.spatial.rooms.raster import (
    SETTINGS,
    Picture,
    Raster,
    build_raster,
    close_gaps,
    drop_specks,
    find_boxes,
    find_cells,
    find_touching,
    is_short,
    label_parts,
    widen,
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Floor:
    """The floor of a raster, and the walls around it.

    Attributes:
        floor: 1 on floor, furniture and small unseen pockets, else 0.
        wall: 1 on wall, else 0.
        obstacle: 1 on obstacles that cannot be walked around, wall or not, else 0.
        solid: 1 where nothing is free, furniture left out, else 0.
        directions_deg: The main directions of the walls, from 0 to 90 degrees.
        clearance_m: Distance of each floor cell from cells that are not floor.
    """

    floor: Picture
    wall: Picture
    obstacle: Picture
    solid: Picture
    directions_deg: list[float]
    clearance_m: NDArray[np.float32]


def build_floor(raster: Raster, *, block_m: float = SETTINGS.block_length_m) -> Floor:
    """Return the floor with its furniture cleared away, where it is no longer than told."""
    directions = find_wall_directions(raster.occupied)
    wall, obstacle = find_walls(raster, directions)
    block, behind = find_blocks(raster, wall, longest_m=block_m)
    wall, obstacle = (part & (1 - block) | behind for part in (wall, obstacle))
    free = raster.free | block
    occupied = (raster.occupied & (1 - block)) | behind
    floor = free | (occupied & (1 - wall))
    floor |= _find_pockets(floor, wall, SETTINGS.pocket_area_m2 / raster.cell_area_m2)
    # Drop unconnected parts that are too small for a room.
    floor = drop_specks(floor, SETTINGS.room_area_m2 / raster.cell_area_m2)
    return Floor(
        floor=floor,
        wall=wall,
        obstacle=obstacle,
        solid=1 - free,
        directions_deg=directions,
        clearance_m=_clearance(floor, raster.cell_size_m),
    )


def build_cleared(grid: OccupancyGrid, *, block_m: float) -> Mask:
    """Return True for the cells of a map that are floor, furniture or small unseen pockets.

    Args:
        block_m: What is longer is no furniture.
    """
    raster = build_raster(grid)
    return raster.on_grid(build_floor(raster, block_m=block_m).floor.astype(np.int32)) > 0


def cut_away(floor: Floor, cut: Picture, cell_size_m: float) -> Floor:
    """Return the floor without the cells that are set, and its clearances; the walls stay."""
    if not cut.any():
        return floor
    rest = floor.floor & (1 - cut)
    return replace(floor, floor=rest, clearance_m=_clearance(rest, cell_size_m))


def _clearance(floor: Picture, cell_size_m: float) -> NDArray[np.float32]:
    """Return the distance from each cell's centre to the edge of the nearest cell off the floor."""
    to_edge = np.maximum(measure_away(floor == 0) - 0.5, 0.0) * cell_size_m
    return np.asarray(to_edge, dtype=np.float32)


def _find_pockets(floor: Picture, wall: Picture, largest: float) -> Picture:
    """Return the small unseen areas inside that border on floor more than on wall."""
    unseen = (1 - floor) & (1 - wall)
    n, label = label_parts(unseen, connectivity=4)
    small = np.bincount(label.ravel(), minlength=n) < largest
    small[0] = small[label[0, 0]] = False
    border = np.zeros(n)
    at_wall = np.zeros(n)
    for here, there in ((np.s_[:-1, :], np.s_[1:, :]), (np.s_[:, :-1], np.s_[:, 1:])):
        places = find_cells(unseen[here] != unseen[there])
        # One of the two is in a pocket, and at most the other is wall.
        pocket = label[here][places] + label[there][places]
        border += np.bincount(pocket, minlength=n)
        weights = wall[here][places] | wall[there][places]
        at_wall += np.bincount(pocket, weights=weights, minlength=n)
    is_pocket = small & (at_wall <= border / 2)
    return np.take(is_pocket.view(np.uint8), label)


OBLIQUE_STEP_DEG = 7.5
_SIEVE, _FEW_CELLS = 5, 2000
"""Every so many cells of a line are tried first; then so many cells are looked at one by one."""
SLENDER_RATIO = 0.37
"""Area over the square of the diagonal: 0.5 for a square, 0.39 for a disc, 0.3 for 3 to 1."""


def find_walls(raster: Raster, directions_deg: list[float]) -> tuple[Picture, Picture]:
    """Return 1 where an obstacle is wall, and 1 where it cannot be a free-standing island.

    Wall is a long run in a main direction, or in line with one, and one of half that length that
    leads on from a wall.

    A run of twice that length is wall in any direction, and so are long curved walls. An
    obstacle thicker than a wall, such as a cupboard, is not part of a wall that it is in line with.
    """
    size_m = raster.cell_size_m
    occupied = raster.occupied
    thick = widen(occupied, 1)
    large, slender = _sort_obstacles(raster.free, SETTINGS.island_size_m / size_m)
    can_be_piece = _find_thinner(occupied, SETTINGS.wall_thickness_m / size_m) & (large | slender)
    can_be_stub = _find_thinner(occupied, SETTINGS.tip_m / size_m + 1) & (large | slender)
    wall = np.zeros_like(occupied)
    shorter: dict[float, Picture] = {}
    for angle_deg in directions_deg:
        for turned_deg in (angle_deg, angle_deg + 90):
            long_run = _open(thick, SETTINGS.wall_length_m / size_m, turned_deg) & occupied & large
            piece = _open(thick, SETTINGS.wall_piece_m / size_m, turned_deg) & can_be_piece
            reach = _line(2 * SETTINGS.wall_reach_m / size_m, turned_deg)
            in_line = np.asarray(cv2.dilate(long_run, reach), np.uint8)
            wall |= long_run | (piece & in_line)
            half = _open(thick, SETTINGS.wall_length_m / 2 / size_m, turned_deg)
            shorter[turned_deg] = half & can_be_stub
    any_way = np.zeros_like(occupied)
    for turned_deg in np.arange(0.0, 180.0, OBLIQUE_STEP_DEG).tolist():
        any_way |= _open(thick, SETTINGS.oblique_length_m / size_m, turned_deg)
    obstacle = occupied & large
    wall |= any_way & obstacle
    return wall | _find_short_walls(shorter, wall, raster), obstacle


def _find_short_walls(shorter: dict[float, Picture], wall: Picture, raster: Raster) -> Picture:
    """Return the runs that lead on from a wall.

    With floor on both sides they lead to a wall at their other end too, or to a door between: what
    just sticks out of a wall into a room is a desk.

    Args:
        shorter: The thin runs in each direction, in degrees.
    """
    runs = np.bitwise_or.reduce([*shorter.values(), np.zeros_like(wall)])
    short = find_touching(runs, wall) & (1 - wall)
    n, number = label_parts(short, connectivity=8)
    if n == 1:
        return short
    end = widen(wall, 1)
    for angle_deg, along in shorter.items():
        if (mine := along & short).any():
            end |= mine & _find_doors(wall | along, angle_deg, raster)
    thick = round(SETTINGS.tip_m / raster.cell_size_m) + 1
    solid = 1 - raster.free
    parts_floor = is_short(solid, thick, 0) | is_short(solid, thick, 1)
    n_cells, n_parting = (
        np.bincount(number.ravel()[np.flatnonzero(cells)], minlength=n)
        for cells in (short, parts_floor & (short > 0))
    )
    _, contact = label_parts(short & end, connectivity=8)
    cells = np.flatnonzero(contact)
    pairs = np.unique(contact.ravel()[cells] * np.int64(n) + number.ravel()[cells])
    n_ends = np.bincount(pairs % n, minlength=n)
    is_wall = (2 * n_parting <= n_cells) | (n_ends > 1)
    is_wall[0] = False
    return np.take(is_wall.view(np.uint8), number)


def _find_doors(wall: Picture, angle_deg: float, raster: Raster) -> Picture:
    """Return the floor between walls in line along a direction, and the cells at its ends."""
    # Narrower gaps are cracks; what is farther off than two leaves is across a room.
    crack, opening = (
        close_gaps(wall, _line(width_m / raster.cell_size_m, angle_deg))
        for width_m in (2 * SETTINGS.least_clearance_m, 2 * SETTINGS.leaf_width_m)
    )
    door = opening & (1 - crack) & raster.free
    return np.asarray(cv2.dilate(door, _line(2, angle_deg)), np.uint8)


def _find_thinner(occupied: Picture, cells: float) -> Picture:
    """Return the obstacles that no disc of this many cells across fits into."""
    side = max(round(cells), 1)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    return occupied & (1 - np.asarray(cv2.morphologyEx(occupied, cv2.MORPH_OPEN, disc), np.uint8))


def _open(picture: Picture, length: float, angle_deg: float) -> Picture:
    kernel = _line(length, angle_deg)
    # A line is nowhere that some cells of it are not; most directions match next to nothing.
    some = kernel * (np.cumsum(kernel).reshape(kernel.shape) % _SIEVE == 0)
    cells = np.flatnonzero(np.asarray(cv2.erode(picture, some)).view(np.bool_))
    if cells.size > _FEW_CELLS:
        core = cv2.erode(picture, kernel, borderType=cv2.BORDER_CONSTANT, borderValue=(0,))
        return np.asarray(cv2.dilate(core, kernel), np.uint8)
    high, wide = (side // 2 for side in kernel.shape)
    framed = np.pad(picture, ((high, high), (wide, wide)))
    rows, cols = np.divmod(cells, picture.shape[1])
    middles = (rows + high) * framed.shape[1] + cols + wide
    steps = (np.nonzero(kernel)[0] - high) * framed.shape[1] + np.nonzero(kernel)[1] - wide
    is_line = framed.ravel()[middles[:, np.newaxis] + steps].all(axis=1)
    opened = np.zeros_like(framed)
    opened.ravel()[middles[is_line, np.newaxis] - steps] = 1
    return opened[high : high + picture.shape[0], wide : wide + picture.shape[1]]


def _line(length: float, angle_deg: float) -> Picture:
    half = math.ceil(length / 2)
    picture = np.zeros((2 * half + 1, 2 * half + 1), np.uint8)
    dx = math.cos(math.radians(angle_deg)) * length / 2
    dy = math.sin(math.radians(angle_deg)) * length / 2
    ends = [(round(half + sign * dx), round(half + sign * dy)) for sign in (-1, 1)]
    cv2.line(picture, ends[0], ends[1], 1)
    # OpenCV's steps differ from one end to the other; what is opened is to stay in its place.
    picture |= picture[::-1, ::-1]
    # OpenCV is far faster with a full row or column than with a square that holds one.
    wide, high = (max(abs(end[axis] - half) for end in ends) for axis in (0, 1))
    return picture[half - high : half + high + 1, half - wide : half + wide + 1].copy()


def _sort_obstacles(free: Picture, largest_island: float) -> tuple[Picture, Picture]:
    """Return 1 on obstacles too large to be islands of furniture, and 1 on slender islands.

    An island is an obstacle that can be driven around. A piece of wall is slender; a pillar, a
    chair and a box are not.
    """
    n, label = label_parts(1 - free, connectivity=8)
    low, high = find_boxes(label, n)
    across = np.hypot(*(high - low))
    is_large = across >= largest_island
    is_slender = np.bincount(label.ravel(), minlength=n) <= SLENDER_RATIO * across**2
    is_large[0] = is_slender[0] = False
    large, slender = (np.take(kept.view(np.uint8), label) for kept in (is_large, is_slender))
    return large, slender
