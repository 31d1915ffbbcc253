"""A world out of a map: walls from its occupied cells, no objects.

Any mapped building can be driven in this way. Unknown parts of the map are closed
off by a wall: what would be seen there is not known.
"""

from collections.abc import Iterable, Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.simulator.worlds.world import BODY_RADIUS_M, World, WorldWall
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.paths import clearance_m

WALL_HEIGHT_M = 2.6

Mask = NDArray[np.bool_]


def build_map_world(grid: OccupancyGrid, *, name: str, start: Pose | None = None) -> World:
    """Build a world whose floor is that of a map; its frame is the map's.

    Args:
        start: Where the robot stands at first; None for where it has most room.

    Raises:
        MapError: The map has no floor on which the robot fits.
    """
    floor = find_floor(grid)
    if not floor.any():
        raise MapError(
            f"The map {name} has no free floor on which the robot, {BODY_RADIUS_M} m in radius,"
            " fits.",
            hint="Use a map with free cells, and look at its resolution and thresholds.",
        )
    return World(
        name=name,
        title=f"The building of the map {name}.",
        walls=tuple(_raise_walls(grid)),
        objects=(),
        rooms=(),
        start=_roomiest(grid, floor) if start is None else start,
    )


def find_floor(grid: OccupancyGrid) -> Mask:
    """Find the largest floor of a map on which the robot can come from anywhere to anywhere."""
    solid = _find_solid(grid)
    closed = OccupancyGrid(
        cells=np.where(solid | ~grid.free, 100, 0).astype(np.int8),
        resolution_m=grid.resolution_m,
        origin=grid.origin,
    )
    # One cell more than the radius, because clearances end at the centres of cells.
    is_clear = closed.free & (clearance_m(closed) >= BODY_RADIUS_M + grid.resolution_m)
    n_labels, labels, statistics, _ = cv2.connectedComponentsWithStats(
        is_clear.view(np.uint8), connectivity=4
    )
    if n_labels < 2:
        return np.zeros(grid.cells.shape, dtype=np.bool_)
    return np.asarray(labels == 1 + int(statistics[1:, cv2.CC_STAT_AREA].argmax()))


def _roomiest(grid: OccupancyGrid, floor: Mask) -> Pose:
    room = np.where(floor, clearance_m(grid), -1.0)
    row, col = np.unravel_index(int(np.argmax(room)), room.shape)
    middle = grid.point_at(Cell(int(row), int(col)))
    return Pose(middle.x, middle.y, grid.origin.yaw_rad)


def _find_solid(grid: OccupancyGrid) -> Mask:
    """Return True where the map has a wall, and where floor ends without one."""
    free = np.pad(grid.free, 1).view(np.uint8)
    beside_floor = cv2.dilate(free, np.ones((3, 3), dtype=np.uint8)) > 0
    is_rim = (beside_floor & (free == 0))[1:-1, 1:-1]
    edge = np.zeros(grid.cells.shape, dtype=np.bool_)
    edge[[0, -1], :] = edge[:, [0, -1]] = True
    return np.asarray(grid.occupied | is_rim | (edge & grid.free))


def _raise_walls(grid: OccupancyGrid) -> Iterator[WorldWall]:
    """Return a wall for each rectangle of solid cells."""
    size_m = grid.resolution_m
    for rows, cols in _cover(_find_surface(grid)):
        middle = (rows.start + rows.stop) / 2 * size_m
        yield WorldWall(
            start=grid.origin.transform(Point(cols.start * size_m, middle)),
            end=grid.origin.transform(Point(cols.stop * size_m, middle)),
            thickness_m=(rows.stop - rows.start) * size_m,
            height_m=WALL_HEIGHT_M,
        )


def _find_surface(grid: OccupancyGrid) -> Mask:
    """Return the solid cells that anything can touch or see: those near floor."""
    near = cv2.dilate(grid.free.view(np.uint8), np.ones((5, 5), dtype=np.uint8)) > 0
    return np.asarray(_find_solid(grid) & near)


def _cover(solid: Mask) -> Iterator[tuple[slice, slice]]:
    """Cover cells with rectangles: runs along the rows, joined where they lie on each other."""
    open_ones: dict[tuple[int, int], int] = {}
    for row in range(solid.shape[0] + 1):
        runs = set(_runs(solid[row])) if row < solid.shape[0] else set()
        for run in [run for run in open_ones if run not in runs]:
            yield slice(open_ones.pop(run), row), slice(*run)
        for run in runs:
            open_ones.setdefault(run, row)


def _runs(line: Mask) -> Iterable[tuple[int, int]]:
    """Return from where to where the true cells of a line go."""
    ends = np.flatnonzero(np.diff(np.concatenate(([False], line, [False])).astype(np.int8)))
    return zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True)
