"""The figures of the benchmark."""

import statistics
from collections.abc import Iterator

import cv2
import numpy as np

from benchmarks.figure import Figure
from benchmarks.rooms.drawn import DEVELOPED_ON, HELD_OUT, draw_worlds, drawn_figures, ship_worlds
from benchmarks.rooms.people import (
    find_labelled_maps,
    list_labelled_maps,
    score_figures,
    score_map,
    timed_rooms,
)
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import find_rooms

__all__ = ["measure"]

N_RUNS = 3
ROOM_CELLS = 120
RESOLUTION_M = 0.05


def measure() -> Iterator[Figure]:
    """Return the median CPU time for drawn buildings of three sizes, and the scores."""
    cv2.setNumThreads(1)
    for n_cells in (1000, 2000, 4000):
        grid = _building(n_cells)
        times_ms = [timed_rooms(grid)[1] for _ in range(N_RUNS)]
        name = f"{n_cells} x {n_cells}, {len(find_rooms(grid).regions)} rooms"
        yield Figure(name=name, value=statistics.median(times_ms), unit="ms")
    maps = find_labelled_maps()
    if maps is not None:
        yield from score_figures([score_map(folder) for folder in list_labelled_maps(maps)])
    yield from drawn_figures("shipped worlds", ship_worlds())
    yield from drawn_figures("drawn worlds, at hand", draw_worlds(DEVELOPED_ON))
    yield from drawn_figures("drawn worlds, held out", draw_worlds(HELD_OUT))


def _building(n_cells: int) -> OccupancyGrid:
    """Return rooms of 6 x 6 m, each with a door to the next, and scattered furniture."""
    generator = np.random.default_rng(n_cells)
    cells = np.zeros((n_cells, n_cells), dtype=np.int8)
    cells[generator.random(cells.shape) < 0.002] = 100
    for wall in range(0, n_cells, ROOM_CELLS):
        cells[wall : wall + 3, :] = cells[:, wall : wall + 3] = 100
    for wall in range(ROOM_CELLS, n_cells, ROOM_CELLS):
        for room in range(0, n_cells, ROOM_CELLS):
            door = slice(room + ROOM_CELLS // 2 - 9, room + ROOM_CELLS // 2 + 9)
            cells[wall : wall + 3, door] = cells[door, wall : wall + 3] = 0
    return OccupancyGrid(cells=cells, resolution_m=RESOLUTION_M)
