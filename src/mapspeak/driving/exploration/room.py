"""Whether a robot can stand at a place, as far as the map around it tells."""

import math

from mapspeak.geometry import Point
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import clearance_m

__all__ = ["has_room_at"]


def has_room_at(grid: OccupancyGrid, point: Point, *, radius_m: float) -> bool:
    """True where a robot of that radius can stand on known floor."""
    cell = grid.cell_at(point)
    if not grid.contains(cell) or not grid.free[cell.row, cell.col]:
        return False
    reach = math.ceil(radius_m / grid.resolution_m) + 1
    top, left = max(cell.row - reach, 0), max(cell.col - reach, 0)
    near = grid.crop(slice(top, cell.row + reach + 1), slice(left, cell.col + reach + 1))
    return bool(clearance_m(near)[cell.row - top, cell.col - left] >= radius_m)
