"""The raster on which rooms are found: cropped to the known, near one cell size for every map."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.spatial.grid import FREE_MAX, UNKNOWN, FloatArray, OccupancyGrid


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
        block_depth_m: Furniture is at least so deep.
        block_ratio: And with the wall behind it so many times as thick as the map's walls are.
        block_thickness_m: One of its sides is at most so long.
        block_length_m: The floor around it is at most this far, along the walls and square to
            them.
        direction_ratio: A main direction has at least this share of the strongest one's edges.
        pocket_area_m2: Unseen areas up to this size inside a room count as floor.
        smoothing_m: Standard deviation of the smoothing of clearances.
        same_width_ratio: Neighbouring places whose clearances differ less are one place.
        door_width_m: The widest narrow place that can divide two rooms.
        door_ratio: A narrow place in a wall divides if its half width is at most this share of
            the clearance of the narrower side.
        gap_ratio: The same for a narrow place with no wall in line with it.
        least_door_m: A narrower place is a gap beside furniture, or a door that is hardly open.
        leaf_width_m: Doors up to this width divide however wide the places behind them are.
        wide_ratio: A wider one divides if its half width is also at most this share of the
            clearance of the wider side.
        stub_m: The shortest piece of wall that makes an opening wider than a leaf, in line with
            it, a door whatever the clearances.
        tip_m: The thickest such piece.
        frame_m: The length of wall in line with a narrow place that makes it fully a door.
        mouth_width_m: The widest end of a corridor that opens straight into a wider place.
        mouth_ratio: Clearance of such a corridor over that of the wider place, at most.
        mouth_elongation: Area over the square of its width that makes it a corridor.
        mouth_area_m2: The smallest such corridor.
        room_area_m2: Smaller regions belong to their neighbour.
        niche_area_m2: The same for a region whose border has no wall in line with it.
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
    direction_ratio: float = 0.2
    pocket_area_m2: float = 2.0
    smoothing_m: float = 0.1
    same_width_ratio: float = 0.8
    door_width_m: float = 2.4
    door_ratio: float = 0.8
    gap_ratio: float = 0.5
    least_door_m: float = 0.6
    leaf_width_m: float = 1.0
    wide_ratio: float = 0.6
    stub_m: float = 0.3
    tip_m: float = 0.25
    frame_m: float = 2.5
    mouth_width_m: float = 3.0
    mouth_ratio: float = 0.5
    mouth_elongation: float = 3.0
    mouth_area_m2: float = 4.0
    room_area_m2: float = 1.5
    niche_area_m2: float = 4.0


Picture = NDArray[np.uint8]

MAX_GRID_CELLS = 120_000_000
MAX_RASTER_CELLS = 5_000_000
MAX_UPSCALING = 4


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Raster:
    """The known part of a map at a working resolution.

    Attributes:
        free: 1 where a robot can be, else 0.
        occupied: 1 where something stands, else 0.
        cell_size_m: The side of one raster cell.
        first_row: The row of the grid at which the raster begins.
        first_col: The column of the grid at which the raster begins.
        scale: Raster cells per grid cell along one side; below 1 when the raster is coarser.
    """

    free: Picture
    occupied: Picture
    cell_size_m: float
    first_row: int
    first_col: int
    scale: float
    grid: OccupancyGrid

    @property
    def cell_area_m2(self) -> float:
        """The area of one raster cell."""
        return self.cell_size_m**2

    def point_at(self, row: float, col: float) -> Point:
        """Return the place of a point of the raster; a cell's centre lies at +0.5, +0.5."""
        rows = np.array([self.first_row + row / self.scale - 0.5])
        cols = np.array([self.first_col + col / self.scale - 0.5])
        xy: FloatArray = self.grid.points_at(rows, cols)
        return Point(float(xy[0, 0]), float(xy[0, 1]))


def find_cells(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the rows and columns of the cells that are set, row by row; nonzero is far slower."""
    places = np.flatnonzero(mask)
    rows, cols = np.divmod(places, mask.shape[1]) if places.size else (places, places)
    return rows, cols


def build_raster(grid: OccupancyGrid, *, cell_size_m: float) -> Raster:
    """Return the known part of a map in cells of about the wanted size.

    Raises:
        MapError: The map has more cells than can be handled.
    """
    if grid.cells.size > MAX_GRID_CELLS:
        raise MapError(
            f"The map has {grid.cells.size} cells, more than {MAX_GRID_CELLS}.",
            hint="Ask for a part of it, or for a map at a coarser resolution.",
        )
    is_known = grid.cells >= 0
    rows, cols = _extent(np.any(is_known, axis=1)), _extent(np.any(is_known, axis=0))
    known = grid.cells[rows, cols]
    shrink, grow = _factors(known.size, grid.resolution_m, cell_size_m)
    if known.size == 0:
        known = np.full((1, 1), UNKNOWN, np.int8)
    free = _resize((known >= 0) & (known <= FREE_MAX), shrink=shrink, grow=grow, full=True)
    occupied = _resize(known > FREE_MAX, shrink=shrink, grow=grow, full=False)
    free &= 1 - occupied
    return Raster(
        free=free,
        occupied=occupied,
        cell_size_m=grid.resolution_m * shrink / grow,
        first_row=rows.start,
        first_col=cols.start,
        scale=grow / shrink,
        grid=grid,
    )


def _extent(used: NDArray[np.bool_]) -> slice:
    places = np.flatnonzero(used)
    return slice(int(places[0]), int(places[-1]) + 1) if places.size else slice(0, 0)


def _factors(n_cells: int, resolution_m: float, cell_size_m: float) -> tuple[int, int]:
    """Return by how much to shrink and to grow; one of the two is 1."""
    shrink = max(1, round(cell_size_m / resolution_m))
    while n_cells / shrink**2 > MAX_RASTER_CELLS:
        shrink += 1
    grow = min(MAX_UPSCALING, max(1, round(resolution_m / cell_size_m)))
    while grow > 1 and n_cells * grow**2 > MAX_RASTER_CELLS:
        grow -= 1
    return (shrink, 1) if shrink > 1 else (1, grow)


def _resize(mask: NDArray[np.bool_], *, shrink: int, grow: int, full: bool) -> Picture:
    """Resize a mask; a shrunk cell is set when any of its cells is, or for `full` half of them."""
    picture = mask.astype(np.uint8)
    if grow > 1:
        return np.repeat(np.repeat(picture, grow, axis=0), grow, axis=1)
    if shrink == 1:
        return picture
    high, wide = (-(-side // shrink) for side in picture.shape)
    padded = np.zeros((high * shrink, wide * shrink), np.uint8)
    padded[: picture.shape[0], : picture.shape[1]] = picture
    share = cv2.resize(padded * np.uint8(255), (wide, high), interpolation=cv2.INTER_AREA)
    return (share >= (127 if full else 1)).astype(np.uint8)
