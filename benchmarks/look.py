"""How much computing one look_at_map takes, in one thread: rooms, distances, frontiers, PNG."""

import statistics
import time
from collections.abc import Callable, Iterator
from typing import TypeVar

import cv2
import numpy as np

from benchmarks.figure import Figure
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMap
from mapspeak.server.reports.mappicture import draw_world
from mapspeak.server.text.world.look import MapLook, view_of
from mapspeak.server.text.world.tables import describe_world
from mapspeak.spatial import UNKNOWN, OccupancyGrid
from mapspeak.worldmodel.model import WorldModel

__all__ = ["draw_building", "measure"]

T = TypeVar("T")

N_RUNS = 5
RESOLUTION_M = 0.05
ROOM_CELLS = 120
HALL_CELLS = 44
DOOR_CELLS = 18
WALL_CELLS = 3
RADIUS_M = 0.25
SEEN_RATIO = 0.7
STEP_M = 0.6


def measure() -> Iterator[Figure]:
    """Return the median CPU time of a whole look and of its parts, for two sizes of map."""
    n_threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        for n_cells in (1000, 4000):
            yield from _measure_size(n_cells)
    finally:
        cv2.setNumThreads(n_threads)


def _measure_size(n_cells: int) -> Iterator[Figure]:
    times_ms: dict[str, list[float]] = {}
    for run in range(N_RUNS):
        world = _look(draw_building(n_cells, seed=run), _stand(n_cells), None, times_ms, "")
        here = world.robot
        moved = Pose(here.x + STEP_M, here.y, here.yaw_rad)
        _look(world.grid, moved, world, times_ms, "only the pose changed, ")
    for what, runs_ms in times_ms.items():
        yield Figure(
            name=f"{n_cells} x {n_cells}, {what}", value=statistics.median(runs_ms), unit="ms"
        )
    world = _look(draw_building(n_cells, seed=0), _stand(n_cells), None, {}, "")
    text = describe_world(view_of(world, MapLook()))
    picture = draw_world(view_of(world, MapLook()))
    yield Figure(name=f"{n_cells} x {n_cells}, text", value=len(text) / 1000, unit="k characters")
    yield Figure(name=f"{n_cells} x {n_cells}, PNG", value=len(picture.png) / 1000, unit="kB")


def _look(
    grid: OccupancyGrid,
    robot: Pose,
    previous: WorldModel | None,
    times_ms: dict[str, list[float]],
    prefix: str,
) -> WorldModel:
    """Look at a map as the tool does, and notes how long each part took."""
    memory = SemanticMap()
    started_s = time.process_time()
    world = WorldModel(grid, robot, memory, radius_m=RADIUS_M, previous=previous)
    parts: dict[str, Callable[[], object]] = {
        "rooms": lambda: world.rooms,
        "distances": lambda: world.distances,
        "frontiers": lambda: world.frontiers,
        "tables": lambda: describe_world(view_of(world, MapLook())),
        "picture": lambda: draw_world(view_of(world, MapLook())),
    }
    for name, compute in parts.items():
        part_started_s = time.process_time()
        compute()
        _note(times_ms, f"{prefix}{name}", part_started_s)
    _note(times_ms, f"{prefix}the whole look", started_s)
    return world


def _note(times_ms: dict[str, list[float]], what: str, started_s: float) -> None:
    times_ms.setdefault(what, []).append((time.process_time() - started_s) * 1e3)


def draw_building(n_cells: int, *, seed: int) -> OccupancyGrid:
    """Return rooms along corridors with furniture, of which a part has not been seen yet."""
    generator = np.random.default_rng(seed)
    cells = np.zeros((n_cells, n_cells), dtype=np.int8)
    pitch = 2 * ROOM_CELLS + HALL_CELLS
    for row in range(0, n_cells, pitch):
        for col in range(0, n_cells, ROOM_CELLS):
            for room in (row, row + ROOM_CELLS + HALL_CELLS):
                _furnish(cells[room : room + ROOM_CELLS, col : col + ROOM_CELLS], generator)
    for row in range(0, n_cells, pitch):
        hall = (row + ROOM_CELLS, row + ROOM_CELLS + HALL_CELLS)
        for wall in (row, *hall):
            cells[wall : wall + WALL_CELLS, :] = 100
        for col in range(0, n_cells, ROOM_CELLS):
            cells[row : hall[0], col : col + WALL_CELLS] = 100
            cells[hall[1] : row + pitch, col : col + WALL_CELLS] = 100
        for col in range(0, n_cells, ROOM_CELLS):
            door = slice(col + 51, col + 51 + DOOR_CELLS)
            is_through = col // ROOM_CELLS % 4 == 1
            for wall in (row, *hall) if is_through else hall:
                cells[wall : wall + WALL_CELLS, door] = 0
    cells[:3] = cells[-3:] = 100
    cells[:, :3] = cells[:, -3:] = 100
    return OccupancyGrid(cells=_hide(cells, generator), resolution_m=RESOLUTION_M)


def _furnish(room: np.ndarray, generator: np.random.Generator) -> None:
    """Put three things of 0.3 to 1 m into the corners of a room of 6 x 6 m."""
    for _ in range(3):
        row, col = generator.choice((10, 78), size=2) + generator.integers(0, 10, size=2)
        height, width = generator.integers(6, 20, size=2)
        room[row : row + height, col : col + width] = 100


def _hide(cells: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Make whole patches of the far part unknown, with ragged edges as a LiDAR leaves them."""
    n_cells = cells.shape[0]
    coarse = generator.random((n_cells // 100 + 2, n_cells // 100 + 2), dtype=np.float32)
    waves = cv2.resize(coarse, (n_cells, n_cells), interpolation=cv2.INTER_CUBIC)
    along = np.linspace(0, 1, n_cells, dtype=np.float32)
    is_seen = (along[:, None] + 0.25 * (waves - 0.5)) < SEEN_RATIO
    return np.where(is_seen, cells, UNKNOWN).astype(np.int8)


def _stand(n_cells: int) -> Pose:
    """Return a place in the corridor nearest to the middle of what is seen."""
    pitch = 2 * ROOM_CELLS + HALL_CELLS
    row = (n_cells // 3 // pitch) * pitch + ROOM_CELLS + HALL_CELLS // 2
    return Pose(n_cells / 2 * RESOLUTION_M, row * RESOLUTION_M, 0.7)
