"""The floor that rooms are cut from: what a robot could drive on if the furniture were gone."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.rooms.furniture import find_blocks
from mapspeak.spatial.rooms.raster import Picture, Raster, find_cells
from mapspeak.spatial.rooms.settings import RoomSettings
from mapspeak.spatial.rooms.walls import find_wall_directions, find_walls


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Floor:
    """The floor of a raster, and the walls around it.

    Attributes:
        floor: 1 on floor, furniture and small unseen pockets, else 0.
        wall: 1 on wall, else 0.
        obstacle: 1 on what stands and cannot be walked around, wall or not, else 0.
        solid: 1 where nothing is free, furniture left out, else 0.
        directions_deg: The main directions of the walls, from 0 to 90 degrees.
        clearance_m: How far each floor cell is from what is not floor.
        standing_m: The same with the furniture in its place; None where no block was left out.
    """

    floor: Picture
    wall: Picture
    obstacle: Picture
    solid: Picture
    directions_deg: list[float]
    clearance_m: NDArray[np.float32]
    standing_m: NDArray[np.float32] | None


def build_floor(raster: Raster, settings: RoomSettings) -> Floor:
    """Gives the floor with its furniture cleared away."""
    directions = find_wall_directions(raster.occupied, least_ratio=settings.direction_ratio)
    wall, obstacle = find_walls(raster, directions, settings)
    pocket = settings.pocket_area_m2 / raster.cell_area_m2
    block, behind = find_blocks(raster, wall, directions[0] if directions else 0.0, settings)
    standing_m = None
    if block.any():
        with_blocks = _clear(raster.free, raster.occupied, wall, pocket)
        standing_m = _clearance(with_blocks, raster.cell_size_m)
    wall, obstacle = (part & (1 - block) | behind for part in (wall, obstacle))
    free = raster.free | block
    occupied = (raster.occupied & (1 - block)) | behind
    floor = _clear(free, occupied, wall, pocket)
    floor = _drop_crumbs(floor, settings.room_area_m2 / raster.cell_area_m2)
    return Floor(
        floor=floor,
        wall=wall,
        obstacle=obstacle,
        solid=1 - free,
        directions_deg=directions,
        clearance_m=_clearance(floor, raster.cell_size_m),
        standing_m=standing_m,
    )


def _clear(free: Picture, occupied: Picture, wall: Picture, largest_pocket: float) -> Picture:
    """Gives the floor under all that is no wall, small unseen pockets included."""
    floor = free | (occupied & (1 - wall))
    return floor | _find_pockets(floor, wall, largest_pocket)


def cut_away(floor: Floor, cut: Picture, cell_size_m: float) -> Floor:
    """Gives the floor without the cells that are set, and its clearances; the walls stay."""
    rest = floor.floor & (1 - cut)
    return replace(floor, floor=rest, clearance_m=_clearance(rest, cell_size_m))


def _drop_crumbs(floor: Picture, smallest: float) -> Picture:
    """Gives the floor without parts that nothing joins and that are too small for a room."""
    _, label, stats, _ = cv2.connectedComponentsWithStats(floor, connectivity=4)
    is_kept = stats[:, cv2.CC_STAT_AREA] >= smallest
    is_kept[0] = False
    return np.asarray(is_kept[label], np.uint8)


def _clearance(floor: Picture, cell_size_m: float) -> NDArray[np.float32]:
    """Gives the way from each cell's centre to the edge of the nearest cell that is no floor."""
    framed = cv2.copyMakeBorder(floor, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    cells = cv2.distanceTransform(framed, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    to_edge = np.maximum(cells[1:-1, 1:-1] - 0.5, 0.0) * cell_size_m
    return np.ascontiguousarray(to_edge, dtype=np.float32)


def _find_pockets(floor: Picture, wall: Picture, largest: float) -> Picture:
    """Gives the small unseen areas that border on floor more than on wall."""
    unseen = (1 - floor) & (1 - wall)
    n, label, stats, _ = cv2.connectedComponentsWithStats(unseen, connectivity=4)
    small = stats[:, cv2.CC_STAT_AREA] < largest
    small[0] = False
    border = np.zeros(n)
    at_wall = np.zeros(n)
    for here, there in _NEIGHBOURS:
        rows, cols = find_cells((unseen[here] > 0) & (unseen[there] == 0))
        pocket = label[here][rows, cols]
        border += np.bincount(pocket, minlength=n)
        at_wall += np.bincount(pocket, weights=wall[there][rows, cols], minlength=n)
    is_pocket = small & (at_wall <= border / 2)
    return np.asarray(is_pocket[label], np.uint8)


_NEIGHBOURS = (
    (np.s_[:-1, :], np.s_[1:, :]),
    (np.s_[1:, :], np.s_[:-1, :]),
    (np.s_[:, :-1], np.s_[:, 1:]),
    (np.s_[:, 1:], np.s_[:, :-1]),
)
"""The cells that have a neighbour below, above, right and left; and those neighbours."""
