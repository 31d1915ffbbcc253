"""What a memory in PostgreSQL costs: 10,000 places, and 50 servers that write at once.

The server is one of this machine's own programs, in a temporary folder, with its usual settings:
every write is on the disk before it is acknowledged. The 50 writers are processes, each of which
has read everything, and all begin their first write at the same moment. As the baseline the same
processes insert a bare row each time.
"""

import multiprocessing
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from functools import partial
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import psycopg

from benchmarks.figure import Figure
from mapspeak.geometry import Pose
from mapspeak.memory import Landmark, Waypoint
from mapspeak.memory.postgres import PostgresStore

__all__ = ["measure"]

N_PLACES = 10_000
N_WRITERS, N_WRITES = 50, 4
N_SINGLE = 20
N_BARE = 300

if TYPE_CHECKING:
    from multiprocessing import Queue
    from multiprocessing.synchronize import Barrier


def measure() -> Iterator[Figure]:
    """Return times of reading and writing, alone and at once."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from postgres_server import run_postgres  # noqa: PLC0415 - of the tests

    with TemporaryDirectory() as folder, run_postgres(Path(folder)) as server:
        address = server.new_database()
        with ExitStack() as opened:

            def open_store() -> PostgresStore:
                store = PostgresStore(address, path=Path(folder) / "places.yaml", map_id="hall")
                return opened.enter_context(closing(store))

            store = open_store()
            store.write_all(lambda _: [_place(number) for number in range(N_PLACES)])
            reader = open_store()
            yield Figure(name="10,000 places, first read", value=_time_ms(reader.read), unit="ms")
            writes_ms, news_ms = [], []
            for i in range(N_SINGLE):
                writes_ms.append(_time_ms(_writing(store, f"new {i}")))
                news_ms.append(_time_ms(reader.read))
            median_ms = statistics.median(writes_ms)
            yield Figure(name="10,000 places, a write, median", value=median_ms, unit="ms")
            median_ms = statistics.median(news_ms)
            yield Figure(name="10,000 places, another reads it", value=median_ms, unit="ms")
            n_before = len(reader.read().waypoints)
            yield from _measure_rush(address, Path(folder))
            n_new = len(reader.read().waypoints) - n_before
            name = f"stored of {N_WRITERS * N_WRITES} writes at once"
            yield Figure(name=name, value=n_new, unit="")
            with psycopg.connect(address, autocommit=True) as connection:
                connection.execute("CREATE TABLE bare (id bigserial PRIMARY KEY, said text)")
            yield from _measure_rush(address, Path(folder), is_bare=True)


def _measure_rush(address: str, folder: Path, *, is_bare: bool = False) -> Iterator[Figure]:
    """Return how long writes take when all writers begin at once.

    Args:
        is_bare: As the baseline, each write is one INSERT of as many bytes.
    """
    context = multiprocessing.get_context("spawn")
    start, answers = context.Barrier(N_WRITERS), context.Queue()
    writers = [
        context.Process(target=_write, args=(address, folder, number, is_bare, start, answers))
        for number in range(N_WRITERS)
    ]
    for writer in writers:
        writer.start()
    times_ms = sorted(chain.from_iterable(answers.get(timeout=300) for _ in writers))
    for writer in writers:
        writer.join()
    what = f"{N_WRITERS} writers at once, {N_WRITES} {'bare INSERTs' if is_bare else 'writes'} each"
    target = "" if is_bare else " (target: 200)"
    p95_ms = times_ms[int(0.95 * len(times_ms))]
    yield Figure(name=f"{what}: median", value=statistics.median(times_ms), unit="ms")
    yield Figure(name=f"{what}: p95{target}", value=p95_ms, unit="ms")


def _write(
    address: str,
    folder: Path,
    number: int,
    is_bare: object,
    start: "Barrier",
    answers: "Queue[Any]",
) -> None:
    """Be one writer, in a process of its own."""
    with ExitStack() as opened:
        if is_bare:
            bare = opened.enter_context(psycopg.connect(address, autocommit=True))
            row = "x" * N_BARE
            bare.execute("SELECT 1")
            insert = partial(bare.execute, "INSERT INTO bare (said) VALUES (%s)", (row,))
            writes: list[Callable[[], object]] = [insert] * N_WRITES
        else:
            store = PostgresStore(address, path=folder / f"{number}.yaml", map_id="hall")
            opened.enter_context(closing(store)).read()
            writes = [_writing(store, f"robot {number}, {i}") for i in range(N_WRITES)]
        start.wait()
        answers.put([_time_ms(each) for each in writes])


def _writing(store: PostgresStore, name: str) -> Callable[[], object]:
    return lambda: store.remember(Waypoint(name=name, pose=Pose(1.0, 2.0, 0.0)))


def _place(number: int) -> Waypoint:
    labels = (f"sink {number % 97}", f"door {number % 89}", f"chair {number % 83}")
    things = tuple(Landmark(label=each, bearing_rad=0.1, range_m=2.0) for each in labels)
    return Waypoint(
        name=f"place {number}",
        pose=Pose(number % 100, number // 100, 0.0),
        functional_landmarks=things,
    )


def _time_ms(call: Callable[[], object]) -> float:
    started_s = time.perf_counter()
    call()
    return (time.perf_counter() - started_s) * 1e3
