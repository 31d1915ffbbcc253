"""How fast a hundred thousand observations are asked, written, and indexed anew.

Every observation has a text of its own of about twelve words; rooms, things and days are drawn by a
seeded generator. Times are processor time of one thread, the disk's waiting left out, but for
writes, which are mostly that. `python -m benchmarks.episodes` shows the table.
"""

import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.figure import Figure
from mapspeak.geometry import Point, Pose
from mapspeak.memory.episodes.observation import (
    EpisodeOrder,
    EpisodeQuery,
    Observation,
    ObservationKind,
)
from mapspeak.memory.episodes.store import EpisodeStore
from mapspeak.memory.episodes.textindex import VectorRank
from mapspeak.memory.search.answer import MINILM_THRESHOLDS

__all__ = ["measure"]

N_OBSERVATIONS = 100_000
N_QUERIES = 7
N_WRITES = 200
N_DIMENSIONS = 256
START = datetime(2026, 11, 2, tzinfo=UTC)
LAST_DAY = START + timedelta(days=30)
THINGS = """
    ladder extinguisher pallet shelf crate forklift sink fridge desk printer cabinet sofa plant
    table chair door window charger bin cart hose alarm exit sign box trolley barrel pump valve
""".split()  # noqa: SIM905 - a list in quotes would hide what they are
COLOURS = ("red", "blue", "green", "yellow", "white", "grey", "black", "orange")
PICTURE = b"\xff\xd8\xff" + bytes(60_000)


class _DrawnVectors:
    """Stands for a language model: each text has a direction of its own, made at once."""

    name = "drawn"
    thresholds = replace(MINILM_THRESHOLDS, least_ratio=0.1, same_ratio=0.01)

    def embed(self, texts: Sequence[str]) -> NDArray[np.float32]:
        return np.stack([_direction(sum(map(ord, text))) for text in texts])


def measure() -> Iterator[Figure]:
    """Return medians, and for writes the slowest twentieth too."""
    with tempfile.TemporaryDirectory() as folder:
        store = EpisodeStore(Path(folder) / "drawn.memory")
        store.write_all(draw_observations(N_OBSERVATIONS))
        for name, query in queries().items():
            found = store.find(query)
            ask = partial(store.find, query)
            taken_ms = [_taken_ms(ask) for _ in range(N_QUERIES)]
            shown = f"ask: {name} ({found.n_matches:,} fit)"
            yield Figure(name=shown, value=statistics.median(taken_ms), unit="ms")
        yield from _by_meaning(store)
        yield from _writes(store)
        size_mb = (Path(folder) / "drawn.memory" / "episodes.sqlite").stat().st_size / 1e6
        yield Figure(name="database", value=size_mb, unit="MB")


def queries() -> dict[str, EpisodeQuery]:
    """Return the questions by what they ask for."""
    morning = LAST_DAY - timedelta(hours=12)
    ladder = EpisodeQuery(words="red ladder", since=morning, order=EpisodeOrder.NEWEST)
    return {
        "newest": EpisodeQuery(),
        "words, rare": EpisodeQuery(words="where is aisle 4711"),
        "words, two common": EpisodeQuery(words="where did you see the red ladder"),
        "words, in every text": EpisodeQuery(words="beside the aisle"),
        "words, misspelt": EpisodeQuery(words="red laddre"),
        "words, newest first": EpisodeQuery(words="red ladder", order=EpisodeOrder.NEWEST),
        "around a point": EpisodeQuery(near=Point(10.0, 10.0), radius_m=3.0),
        "nearest to a point": EpisodeQuery(near=Point(10.0, 10.0)),
        "in a room": EpisodeQuery(room_id="R3"),
        "in a span": EpisodeQuery(since=morning, until=LAST_DAY),
        "with a label": EpisodeQuery(labels=("Ladder",)),
        "all at once": EpisodeQuery(
            words="red ladder",
            near=Point(10.0, 10.0),
            radius_m=20.0,
            room_id="R3",
            since=START,
            until=LAST_DAY,
            labels=("ladder",),
        ),
        "page 51 of words": EpisodeQuery(words="red ladder", offset=1000),
        "nearest to where the ladder was": EpisodeQuery(near=ladder),
    }


def draw_observations(n: int) -> Iterator[Observation]:
    """Return observations over thirty days and 60 x 40 m."""
    random = np.random.default_rng(11)
    numbers = random.random((n, 5))
    for i, (x, y, yaw, thing, colour) in enumerate(numbers.tolist()):
        one = THINGS[int(thing * len(THINGS))]
        other = THINGS[int((thing * 97) % 1 * len(THINGS))]
        shade = COLOURS[int(colour * len(COLOURS))]
        yield Observation(
            recorded_at=START + timedelta(days=30) * (i / n),
            pose=Pose(x * 60, y * 40, (yaw - 0.5) * 6.28),
            kind=ObservationKind.PICTURE,
            text=f"A {shade} {one} beside a {other} at the end of aisle {i % 10_000}, view {i}.",
            labels=(one, other),
            stamp_s=float(i),
            map_id="drawn",
            room_id=f"R{int(x * 6) + 1}",
        )


def _by_meaning(store: EpisodeStore) -> Iterator[Figure]:
    rank = VectorRank(store.database, _DrawnVectors())
    query = EpisodeQuery(words="a thing for high shelves")
    store.find(query, rank=rank)
    # What another process finds: the vectors are in the database.
    rank = VectorRank(store.database, _DrawnVectors())
    first_ms = _taken_ms(lambda: store.find(query, rank=rank))
    yield Figure(name="ask: meaning, the first time in a process", value=first_ms, unit="ms")
    again_ms = [_taken_ms(lambda: store.find(query, rank=rank)) for _ in range(N_QUERIES)]
    yield Figure(name="ask: meaning, then", value=statistics.median(again_ms), unit="ms")


def _writes(store: EpisodeStore) -> Iterator[Figure]:
    for name, picture in (("words", None), ("a picture of 60 kB", PICTURE)):
        wall_ms, cpu_ms = [], []
        for i, observation in enumerate(draw_observations(N_WRITES)):
            later = Observation(
                recorded_at=LAST_DAY + timedelta(seconds=i),
                pose=observation.pose,
                kind=observation.kind,
                text=f"{name}: {observation.text}",
                labels=observation.labels,
            )
            content = None if picture is None else picture + str(i).encode()
            begun_s, cpu_s = time.perf_counter(), time.process_time()
            store.write(later, picture=content)
            wall_ms.append((time.perf_counter() - begun_s) * 1e3)
            cpu_ms.append((time.process_time() - cpu_s) * 1e3)
        yield Figure(name=f"write {name}, on the wall", value=statistics.median(wall_ms), unit="ms")
        slow_ms = sorted(wall_ms)[int(0.95 * N_WRITES)]
        yield Figure(name=f"write {name}, slowest twentieth", value=slow_ms, unit="ms")
        yield Figure(name=f"write {name}, processor", value=statistics.median(cpu_ms), unit="ms")


def _direction(seed: int) -> NDArray[np.float32]:
    vector = np.random.default_rng(seed).normal(size=N_DIMENSIONS).astype(np.float32)
    vector /= np.linalg.norm(vector)
    return vector


def _taken_ms(work: Callable[[], object]) -> float:
    begun_s = time.process_time()
    work()
    return (time.process_time() - begun_s) * 1e3


if __name__ == "__main__":
    from benchmarks.run import show_table

    show_table({"episodes": list(measure())})
