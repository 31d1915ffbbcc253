"""Coverage of a building by a map: by the paper's ratio, by place, and without a reference."""

from dataclasses import dataclass

import numpy as np

from mapspeak.errors import MapError
from mapspeak.spatial.grid import Mask, OccupancyGrid

_BLOCK_CELLS = 1_000_000
"""Cells are looked up in blocks, so that a large map needs little memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Coverage:
    """A map compared with a reference of the same frame, both judged by their free floor.

    Attributes:
        paper_ratio: Free area of the map over free area of the reference, regardless of place; can
            exceed 1.
        recall: Share of the reference's free floor that is free on the map.
        precision: Share of the map's free floor that is free in the reference; 1 for a map that
            shows none.
    """

    paper_ratio: float
    recall: float
    precision: float
    free_area_m2: float


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownArea:
    """Coverage of a map without a reference.

    Attributes:
        known_ratio: Share of the array that is free or occupied.
        open_border_m: Length of the border along which free floor meets the unknown, within the
            array or at its edge; 0 when there is nothing left to see.
    """

    free_area_m2: float
    occupied_area_m2: float
    known_ratio: float
    open_border_m: float


def measure_coverage(
    grid: OccupancyGrid, reference: OccupancyGrid, *, reachable: Mask | None = None
) -> Coverage:
    """Compare the free floor of a map with that of a reference.

    The two may differ in origin, size, yaw and resolution: each cell is looked up in the other map
    by the position of its centre.

    Args:
        grid: The map to judge.
        reference: A complete map of the same building, in the same frame.
        reachable: The cells of the reference that count, such as those a robot can reach or see;
            None for all free cells.

    Raises:
        MapError: The mask has another shape, or no cell of the reference counts.
    """
    truth = reference.free
    if reachable is not None:
        if reachable.shape != truth.shape:
            raise MapError(
                f"The reachable cells are {reachable.shape}, the reference is {truth.shape}.",
                hint="Give one truth value for each cell of the reference.",
            )
        truth = truth & reachable
    if not truth.any():
        raise MapError(
            "The reference has no free floor to compare with.",
            hint="Give a reference map with free cells that can be reached.",
        )
    free = grid.free
    free_area_m2 = np.count_nonzero(free) * grid.resolution_m**2
    reference_m2 = np.count_nonzero(truth) * reference.resolution_m**2
    return Coverage(
        paper_ratio=free_area_m2 / reference_m2,
        recall=_share_found(truth, reference, free, grid),
        precision=_share_found(free, grid, truth, reference) if free.any() else 1.0,
        free_area_m2=free_area_m2,
    )


def measure_known_area(grid: OccupancyGrid) -> KnownArea:
    """Return how much a map shows and how long its border to the unknown is."""
    cell_area_m2 = grid.resolution_m**2
    n_known = np.count_nonzero(~grid.unknown)
    return KnownArea(
        free_area_m2=np.count_nonzero(grid.free) * cell_area_m2,
        occupied_area_m2=np.count_nonzero(grid.occupied) * cell_area_m2,
        known_ratio=n_known / grid.cells.size if grid.cells.size else 0.0,
        open_border_m=_count_open_sides(grid) * grid.resolution_m,
    )


def _share_found(
    wanted: Mask, wanted_grid: OccupancyGrid, found: Mask, found_grid: OccupancyGrid
) -> float:
    """Return the share of the wanted cells whose middle lies in a found cell of the other grid."""
    rows, cols = np.nonzero(wanted)
    n_found = 0
    for start in range(0, rows.size, _BLOCK_CELLS):
        block = slice(start, start + _BLOCK_CELLS)
        points = wanted_grid.points_at(rows[block], cols[block])
        n_found += int(np.count_nonzero(found_grid.look_up(found, points, outside=False)))
    return n_found / rows.size


def _count_open_sides(grid: OccupancyGrid) -> int:
    """Return the number of sides of free cells that face an unknown cell or no cell."""
    free = np.pad(grid.free, 1)
    unknown = np.pad(grid.unknown, 1, constant_values=True)
    along_rows = (free[:-1] & unknown[1:]) | (unknown[:-1] & free[1:])
    along_cols = (free[:, :-1] & unknown[:, 1:]) | (unknown[:, :-1] & free[:, 1:])
    return int(np.count_nonzero(along_rows)) + int(np.count_nonzero(along_cols))
