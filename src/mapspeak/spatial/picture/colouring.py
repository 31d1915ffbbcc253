"""Colours of regions: the same from picture to picture, and different next to each other."""

import math

import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import OccupancyGrid
from mapspeak.spatial.picture.marks import Region, RegionLayer
from mapspeak.spatial.picture.palette import Colour

__all__ = ["AUTOMATIC_COLOURS", "colour_regions"]


AUTOMATIC_COLOURS = (
    Colour.SKY,
    Colour.ORANGE,
    Colour.GREEN,
    Colour.PURPLE,
    Colour.YELLOW,
    Colour.VERMILION,
)

_LATTICE_M = 0.2
_NEIGHBOUR_M = (0.2, 0.6, 1.2)
"""Regions that far apart, as on both sides of a wall, look like neighbours."""


def colour_regions(layer: RegionLayer, grid: OccupancyGrid) -> dict[int, Colour]:
    """Gives the colour of each region's label, different from that of the regions near by.

    A colour depends on the region's key, and on the neighbours with a lower key only where they
    have that colour already. All is found in the whole map and in metres, so that a closer look or
    another region elsewhere changes no colour.
    """
    neighbours = _find_neighbours(layer.labels, grid)
    chosen = {region.label: region.colour for region in layer.regions if region.colour is not None}
    for region in sorted(layer.regions, key=lambda region: (_key(region), region.label)):
        if region.label not in chosen:
            near = neighbours.get(region.label, set())
            taken = {chosen[label] for label in near if label in chosen}
            chosen[region.label] = _pick_colour(_key(region), taken)
    return chosen


def _key(region: Region) -> int:
    return region.label if region.key is None else region.key


def _pick_colour(key: int, taken: set[Colour]) -> Colour:
    """Gives the first colour not taken, beginning at one that depends on the key alone."""
    start = key % len(AUTOMATIC_COLOURS)
    turned = AUTOMATIC_COLOURS[start:] + AUTOMATIC_COLOURS[:start]
    return next((colour for colour in turned if colour not in taken), turned[0])


def _find_neighbours(labels: NDArray[np.uint16], grid: OccupancyGrid) -> dict[int, set[int]]:
    """Gives, for each label, those that come near it along a row or a column of cells."""
    step = max(1, round(_LATTICE_M / grid.resolution_m))
    first_row, first_col = _lattice_start(grid, step)
    lattice = np.ascontiguousarray(labels[first_row::step, first_col::step])
    found: dict[int, set[int]] = {}
    for n in {max(1, round(apart_m / (step * grid.resolution_m))) for apart_m in _NEIGHBOUR_M}:
        for one, other in ((lattice[:-n], lattice[n:]), (lattice[:, :-n], lattice[:, n:])):
            for a, b in _different_pairs(one, other):
                found.setdefault(a, set()).add(b)
                found.setdefault(b, set()).add(a)
    return found


def _lattice_start(grid: OccupancyGrid, step: int) -> tuple[int, int]:
    """Gives the first row and column of a lattice that stays where it is as a map grows."""
    origin = grid.origin
    cos, sin = math.cos(origin.yaw_rad), math.sin(origin.yaw_rad)
    along_x = (cos * origin.x + sin * origin.y) / grid.resolution_m
    along_y = (cos * origin.y - sin * origin.x) / grid.resolution_m
    return -round(along_y) % step, -round(along_x) % step


def _different_pairs(one: NDArray[np.uint16], other: NDArray[np.uint16]) -> list[list[int]]:
    """Gives each pair of different labels, neither 0, that stand in the same place."""
    differ = (one != other) & (one > 0) & (other > 0)
    joint = np.unique(one[differ].astype(np.uint32) << 16 | other[differ])
    return [[int(pair >> 16), int(pair & 0xFFFF)] for pair in joint]
