"""Out of a pocket: a robot that has got into a place gets out of it the way it came.

A gap that a robot has just fitted through may look too narrow in the map's next state, by one cell
on each side. Behind it the robot would seem shut in for ever, and everything else out of reach.
"""

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.grid import Mask
from mapspeak.spatial.paths.lattice import Lattice, build_narrow_lattice, with_passable
from mapspeak.spatial.paths.start import find_seeds
from mapspeak.spatial.paths.trace import descend
from mapspeak.spatial.paths.wavefront import Costs, spread

__all__ = ["POCKET_M2", "open_pocket"]

POCKET_M2 = 5.0
"""A robot that can go nowhere but on so little floor may be in a pocket."""
FINE_RATIO = 0.2
"""Of the radius: on a map of larger cells one of them is no mere doubt about a gap."""


def open_pocket(lattice: Lattice, costs: Costs, start: Point, *, radius_m: float) -> Lattice:
    """Gives the lattice with the narrowest gap opened that keeps a robot from most of the floor.

    Args:
        lattice: The map's, for the robot's radius.
        costs: What can be reached on it, from the start.
        start: Where the robot is.
        radius_m: Of the robot.

    Returns:
        The same lattice where no gap that lacks less than one cell on each side leads out, and on
        a coarse map.
    """
    cell_m = lattice.grid.resolution_m
    if cell_m > FINE_RATIO * radius_m:
        return lattice
    narrow = build_narrow_lattice(lattice, radius_m - cell_m)
    seeds = find_seeds(narrow, start, radius_m=radius_m)
    if seeds is None:
        return lattice
    ways = spread(narrow.moves, None, seeds)
    beyond = _find_largest(lattice, np.isfinite(ways).reshape(narrow.moves.shape), costs)
    if beyond is None:
        return lattice
    nearest = int(np.where(beyond.ravel(), ways, np.inf).argmin())
    gap = np.zeros(narrow.passable.size, dtype=np.uint8)
    gap[descend(narrow.moves, None, ways, nearest)] = 1
    # A way that goes round a corner needs the cells on both sides of its diagonal steps.
    wide = cv2.dilate(gap.reshape(narrow.passable.shape), np.ones((3, 3), np.uint8)) > 0
    return with_passable(lattice, lattice.passable | (wide & narrow.passable))


def _find_largest(lattice: Lattice, is_reached: Mask, costs: Costs) -> Mask | None:
    """Gives the largest piece of passable floor that is reached through narrow gaps only."""
    here = np.isfinite(costs).reshape(lattice.moves.shape)
    here = here.repeat(lattice.factor, axis=0).repeat(lattice.factor, axis=1)
    n_rows, n_cols = lattice.passable.shape
    left = (lattice.passable & is_reached & ~here[:n_rows, :n_cols]).astype(np.uint8)
    n_pieces, pieces, stats, _ = cv2.connectedComponentsWithStats(left, connectivity=4)
    if n_pieces < 2:
        return None
    largest = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    is_more = stats[largest, cv2.CC_STAT_AREA] > np.count_nonzero(here)
    return np.asarray(pieces == largest) if is_more else None
