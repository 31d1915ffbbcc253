"""What a large memory costs: 10,000 places, 25,000 things, 100,000 observations.

The building is drawn: 144 rooms of 6 m, which the robot knows as its map. The server is spoken to
over stdio with the memory in one file. Beside it stand the writes of the stores alone, of a file
and of a database by a PostgreSQL server of its own. Things stand all over the building: most
are seen from one place. CPU is of the server's process with all its threads.
"""

import math
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from benchmarks.figure import Figure
from benchmarks.talking import ServerProcess
from mapspeak.geometry import Pose
from mapspeak.memory import Landmark, MemoryStore, SemanticMapStore, Waypoint
from mapspeak.memory.episodes.observation import EpisodeQuery, Observation, ObservationKind
from mapspeak.memory.episodes.store import EpisodeStore, memory_folder
from mapspeak.memory.store.records import data_of
from mapspeak.memory.store.yamlwriting import record_text
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapwriting import write_map

__all__ = ["measure"]

N_PLACES, N_THINGS, N_OBSERVATIONS = 10_000, 25_000, 100_000
N_ROOMS, ROOM_M, CELL_M = 12, 6.0, 0.05
N_ASKED = 9
KINDS = tuple(
    "sink door chair table shelf printer bench locker cabinet plant lamp clock sofa desk rack bin "  # noqa: SIM905 - shorter so
    "fridge oven tap charger ladder trolley pump valve screen mirror scale counter basket".split()
)
COLOURS = tuple("red blue green white black grey yellow brown orange old new large steel".split())  # noqa: SIM905 - likewise
START = datetime(2026, 11, 2, tzinfo=UTC)


def measure() -> Iterator[Figure]:
    """Return what starting, asking and writing cost."""
    with tempfile.TemporaryDirectory() as folder:
        path, map_file = Path(folder) / "places.yaml", Path(folder) / "map.yaml"
        write_map(_draw_building(), map_file)
        places = draw_places()
        path.write_text(_render(places), encoding="utf-8")
        EpisodeStore(memory_folder(path)).write_all(_draw_observations())
        yield Figure(name="the file", value=path.stat().st_size / 1e6, unit="MB")
        arguments = (
            "--robot",
            f"sim:{map_file}",
            "--map",
            str(map_file),
            "--semantic-map",
            str(path),
        )
        for which in ("first", "second"):
            server = ServerProcess(*arguments)
            yield from _measure_server(server, f"{which} start")
            server.close()
        yield from _measure_store("a file", SemanticMapStore(path), SemanticMapStore(path))
        query = EpisodeQuery(words="ladder near the pump")
        episodes = EpisodeStore(memory_folder(path))
        took = _median_ms(lambda: episodes.find(query))
        yield Figure(name="100,000 observations asked by words", value=took, unit="ms")
        yield from _measure_database(places, Path(folder))


def _measure_server(server: ServerProcess, which: str) -> Iterator[Figure]:
    server.begin()
    yield Figure(name=f"{which}: CPU until initialized", value=server.cpu_s(), unit="s")
    ask = iter(range(10_000))

    def find() -> float:
        i = next(ask)
        words = f"{COLOURS[i % len(COLOURS)]} {KINDS[i * 7 % len(KINDS)]}"
        return _call(server, "find_place", query=words)

    yield Figure(name=f"{which}: find_place, the first", value=find(), unit="ms")
    yield Figure(name=f"{which}: CPU until answered (target: 3)", value=server.cpu_s(), unit="s")
    before_s = server.cpu_s()
    asked = [find() for _ in range(N_ASKED)]
    cpu_ms = (server.cpu_s() - before_s) / N_ASKED * 1e3
    name = f"{which}: find_place by words (target: 50)"
    yield Figure(name=name, value=statistics.median(asked), unit="ms")
    yield Figure(name=f"{which}: find_place by words, CPU", value=cpu_ms, unit="ms")
    writes, after = [], []
    for i in range(N_ASKED):
        noted = {
            "name": f"{which} note {i}",
            "description": "A corner.",
            "functional_landmarks": [{"label": f"{COLOURS[i]} kettle", "bearing_deg": 10.0}],
        }
        writes.append(_call(server, "write_semantic_data", **noted, x=0.0, y=0.0, yaw_deg=10.0 * i))
        after.append(find())
    yield Figure(name=f"{which}: write_semantic_data", value=statistics.median(writes), unit="ms")
    name = f"{which}: find_place after a write (target: 150)"
    yield Figure(name=name, value=statistics.median(after), unit="ms")
    yield Figure(name=f"{which}: memory (target: 1000)", value=server.peak_mb(), unit="MB")


def _measure_store(what: str, store: MemoryStore, other: MemoryStore) -> Iterator[Figure]:
    started_s = time.process_time()
    store.read()
    yield Figure(name=f"{what}: first read, CPU", value=time.process_time() - started_s, unit="s")
    other.read()
    numbers = iter(range(N_PLACES, 2 * N_PLACES))
    writes, news = [], []
    for _ in range(N_ASKED):
        place = _draw_place(next(numbers))
        writes.append(_median_ms(lambda place=place: store.remember(place), n=1))  # type: ignore[misc]
        news.append(_median_ms(other.read, n=1))
    target = "20" if what == "a file" else "10"
    name = f"{what}: a write (target: {target})"
    yield Figure(name=name, value=statistics.median(writes), unit="ms")
    yield Figure(name=f"{what}: another reads it", value=statistics.median(news), unit="ms")
    if what == "a file":
        bare_ms = _median_ms(lambda: _write_bare(store.path))
        yield Figure(name="a file: the same bytes written and flushed", value=bare_ms, unit="ms")


def _measure_database(places: list[Waypoint], folder: Path) -> Iterator[Figure]:
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from mapspeak.memory.postgres import PostgresStore  # noqa: PLC0415 - an extra
    from postgres_server import run_postgres  # noqa: PLC0415 - of the tests

    home = folder / "postgres"
    home.mkdir()
    folder.chmod(0o755)
    with run_postgres(home) as server:
        address = server.new_database()
        with (
            closing(PostgresStore(address, path=folder / "a.yaml", map_id="hall")) as store,
            closing(PostgresStore(address, path=folder / "b.yaml", map_id="hall")) as other,
        ):
            store.write_all(lambda _: places)
            yield from _measure_store("PostgreSQL", store, other)


def _call(server: ServerProcess, tool: str, **arguments: object) -> float:
    result, took_ms = server.call(tool, **arguments)
    if result.get("isError"):
        raise RuntimeError(f"{tool} failed: {result['content'][0]['text']}")
    return took_ms


def _median_ms(act: Callable[[], object], *, n: int = N_ASKED) -> float:
    took = []
    for _ in range(n):
        started_s = time.perf_counter()
        act()
        took.append((time.perf_counter() - started_s) * 1e3)
    return statistics.median(took)


def _write_bare(path: Path) -> None:
    content, spare = path.read_bytes(), path.with_suffix(".tmp")
    with spare.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    spare.replace(path)


def _draw_building() -> OccupancyGrid:
    """Return rooms side by side, each with doors to its neighbours."""
    side, n = round(ROOM_M / CELL_M), N_ROOMS
    cells = np.zeros((n * side + 1, n * side + 1), dtype=np.int8)
    cells[::side, :] = cells[:, ::side] = 100
    doors = (np.arange(n)[:, None] * side + side // 2 + np.arange(-10, 10)).ravel()
    for wall in range(side, n * side, side):
        cells[wall, doors] = cells[doors, wall] = 0
    half_m = ROOM_M / 2
    # The robot begins in a room, wherever its own world begins.
    return OccupancyGrid(cells=cells, resolution_m=CELL_M, origin=Pose(-half_m, -half_m))


def draw_places() -> list[Waypoint]:
    """Return the places, with what is seen from each."""
    return [_draw_place(number) for number in range(N_PLACES)]


def _draw_place(number: int) -> Waypoint:
    random = np.random.default_rng(number)
    room_x, room_y = random.integers(N_ROOMS, size=2) * ROOM_M
    x, y = random.uniform(-1.5, 1.5, size=2)
    things = tuple(
        Landmark(
            label=f"{random.choice(COLOURS)} {random.choice(KINDS)}",
            bearing_rad=float(random.uniform(-0.5, 0.5)),
            range_m=float(random.uniform(0.5, 2.0)),
        )
        for _ in range(2 + number % 2)
    )
    return Waypoint(
        name=f"place {number}",
        description=f"A corner with {things[0].label}.",
        pose=Pose(float(room_x + x), float(room_y + y), float(random.uniform(-math.pi, math.pi))),
        functional_landmarks=things,
        recorded_at=START + timedelta(minutes=number),
        map_id="hall",
    )


def _render(places: list[Waypoint]) -> str:
    records = (
        record_text({k: v for k, v in data_of(each).items() if v not in (None, [])}, indent=2)
        for each in places
    )
    return "\n".join(["version: 1\nmap: map\nwaypoints:", *records])


def _draw_observations() -> Iterator[Observation]:
    random = np.random.default_rng(1)
    for number in range(N_OBSERVATIONS):
        colour, kind = random.choice(COLOURS), random.choice(KINDS)
        x, y = random.uniform(0.0, N_ROOMS * ROOM_M, size=2)
        yield Observation(
            recorded_at=START + timedelta(seconds=number),
            pose=Pose(float(x), float(y)),
            kind=ObservationKind.NOTE,
            text=f"a {colour} {kind} in room {number % 144}",
            labels=(f"{colour} {kind}",),
        )
