"""How much computing and memory it takes to draw a map as a PNG, in one thread, and its size."""

import statistics
import time
import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import cv2
import numpy as np

from benchmarks.figure import Figure
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.picture import (
    LegendEntry,
    LegendSample,
    Line,
    LineStyle,
    MapLayers,
    MapPicture,
    Mark,
    PictureRegion,
    RegionLayer,
    Shape,
    Zoom,
    draw_map,
    draw_robot_pose,
)

__all__ = ["measure"]

N_RUNS = 7
N_CROWDED_MARKS = 100
HUGE_CELLS = 10_000
ROOM_CELLS = 120
RESOLUTION_M = 0.05
TURNED = Pose(-3.0, 7.0, 0.4)


def measure() -> Iterator[Figure]:
    """Return the median CPU time and the size of each kind of picture, and the memory at worst."""
    n_threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        for n_cells in (1000, 4000):
            yield from _measure_size(n_cells)
        yield from _measure_crowd()
        yield from _measure_huge()
    finally:
        cv2.setNumThreads(n_threads)


def _measure_size(n_cells: int) -> Iterator[Figure]:
    size = f"{n_cells} x {n_cells}"
    grid, turned = _building(n_cells, Pose(0.0, 0.0)), _building(n_cells, TURNED)
    robot = Pose(grid.width_m / 2, grid.height_m / 2, 0.7)
    layers = _layers(grid, robot)
    yield from _figures(f"{size}, map", lambda: draw_map(grid))
    yield from _figures(f"{size}, all layers", lambda: draw_map(grid, layers=layers))
    yield from _figures(f"{size}, turned", lambda: draw_map(turned))
    yield from _figures(f"{size}, paper", lambda: draw_robot_pose(grid, robot))


def _measure_crowd() -> Iterator[Figure]:
    """Measure a map with more labels than find room without being moved, and its legend."""
    grid = _building(1000, Pose(0.0, 0.0))
    robot = Pose(grid.width_m / 2, grid.height_m / 2, 0.7)
    layers = _layers(grid, robot)
    crowd = replace(
        layers,
        marks=_marks(grid, N_CROWDED_MARKS),
        legend=(
            LegendEntry(sample=LegendSample.PLAIN_REGION, text="room"),
            LegendEntry(sample=LegendSample.HATCHED_REGION, text="corridor"),
            LegendEntry(sample=Shape.CIRCLE, text="place"),
            LegendEntry(sample=LineStyle.DASHED, text="path"),
            LegendEntry(sample=LegendSample.ROBOT, text="robot"),
        ),
    )
    zoom = Zoom(centre=robot.point, radius_m=6.0)
    name = f"1000 x 1000, {N_CROWDED_MARKS} marks and legend"
    yield from _figures(name, lambda: draw_map(grid, layers=crowd))
    yield from _figures(
        "1000 x 1000, closer look, robot up",
        lambda: draw_map(grid, layers=crowd, zoom=zoom, up_rad=robot.yaw_rad),
    )


def _measure_huge() -> Iterator[Figure]:
    """Measure time and the memory that drawing takes besides the map and its labels."""
    part = _building(1000, Pose(0.0, 0.0)).cells
    n_parts = HUGE_CELLS // 1000
    for name, origin in (("", Pose(0.0, 0.0)), (", turned", TURNED)):
        grid = OccupancyGrid(
            cells=np.tile(part, (n_parts, n_parts)), resolution_m=RESOLUTION_M, origin=origin
        )
        layers = _layers(grid, Pose(grid.width_m / 2, grid.height_m / 2))
        what = f"{HUGE_CELLS} x {HUGE_CELLS}{name}, all layers"
        yield from _figures(what, partial(draw_map, grid, layers=layers))
        tracemalloc.start()
        draw_map(grid, layers=layers)
        _, peak_bytes = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        yield Figure(name=f"{what}: memory", value=peak_bytes / 1e6, unit="MB")


def _figures(name: str, draw: Callable[[], MapPicture]) -> Iterator[Figure]:
    n_bytes = len(draw().png)
    times_ms = []
    for _ in range(N_RUNS):
        started_s = time.process_time()
        draw()
        times_ms.append((time.process_time() - started_s) * 1e3)
    yield Figure(name=name, value=statistics.median(times_ms), unit="ms")
    yield Figure(name=f"{name}: PNG", value=n_bytes / 1000, unit="kB")


def _building(n_cells: int, origin: Pose) -> OccupancyGrid:
    """Return rooms of 6 x 6 m with doors, furniture, and unknown ground around them."""
    generator = np.random.default_rng(n_cells)
    cells = np.zeros((n_cells, n_cells), dtype=np.int8)
    cells[generator.random(cells.shape) < 0.01] = 100
    door = slice(ROOM_CELLS // 2 - 10, ROOM_CELLS // 2 + 10)
    for wall in range(0, n_cells, ROOM_CELLS):
        cells[wall : wall + 2, :] = cells[:, wall : wall + 2] = 100
    for wall in range(ROOM_CELLS, n_cells - ROOM_CELLS, ROOM_CELLS):
        for room in range(0, n_cells - ROOM_CELLS, ROOM_CELLS):
            passage = slice(room + door.start, room + door.stop)
            cells[wall : wall + 2, passage] = cells[passage, wall : wall + 2] = 0
    rim = n_cells // 25
    cells[:rim] = cells[-rim:] = -1
    cells[:, :rim] = cells[:, -rim:] = -1
    return OccupancyGrid(cells=cells, resolution_m=RESOLUTION_M, origin=origin)


def _layers(grid: OccupancyGrid, robot: Pose) -> MapLayers:
    """Return up to 64 rooms, 30 marks, a path across the map and the robot."""
    n_across = min(8, grid.n_cols // ROOM_CELLS)
    block = grid.n_cols // n_across
    block_of = (np.arange(grid.n_cols) // block).astype(np.uint16)
    labels = block_of[:, np.newaxis] * np.uint16(n_across) + block_of + np.uint16(1)
    labels[~grid.free] = 0
    regions = tuple(
        PictureRegion(
            label=label, text=f"R{label} {block * RESOLUTION_M:.1f} m2", is_hatched=label % 9 == 0
        )
        for label in range(1, n_across**2 + 1)
    )
    marks = _marks(grid, 30)
    path = Line(points=tuple(mark.point for mark in marks[:8]), style=LineStyle.DASHED)
    return MapLayers(regions=RegionLayer(labels, regions), lines=(path,), marks=marks, robot=robot)


def _marks(grid: OccupancyGrid, n_marks: int) -> tuple[Mark, ...]:
    places = np.random.default_rng(3).uniform(0.1, 0.9, (n_marks, 2)) * grid.width_m
    return tuple(
        Mark(point=Point(float(x), float(y)), label=f"W{number}")
        for number, (x, y) in enumerate(places, start=1)
    )
