"""What a memory of 1,000 places costs its user: writes and questions, to the server over stdio.

A scripted observer has looked from 1,000 places of a shipped school at all that is in view there;
the robot knows the map. Beside the writes stands what nobody goes below who keeps one file and
loses nothing: the same file written out, flushed to the disk and put in its place.
"""

import math
import os
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.figure import Figure
from benchmarks.memory.observer import observe_from
from benchmarks.memory.sites import Site
from benchmarks.talking import ServerProcess
from mapspeak.geometry import Pose
from mapspeak.memory import Waypoint
from mapspeak.memory.store.records import data_of
from mapspeak.memory.store.yamlwriting import record_text
from mapspeak.simulator import load_world
from mapspeak.spatial.mapfiles import MapMode
from mapspeak.spatial.mapwriting import write_map

__all__ = ["measure"]

N_PLACES = 1000
N_WRITES = 60
N_PAIRS = 10
WORLD = "school_2"


def measure() -> Iterator[Figure]:
    """Return medians of what a client waits for, and the slowest twentieth."""
    site = Site(load_world(WORLD))
    places = observe_from(site, _draw_poses(site, N_PLACES + N_WRITES), seed=1).places.waypoints
    known, new = places[:N_PLACES], places[N_PLACES:]
    with tempfile.TemporaryDirectory() as folder:
        memory, map_file = Path(folder) / "places.yaml", Path(folder) / "map.yaml"
        memory.write_text(_render(known), encoding="utf-8")
        write_map(site.grid, map_file, mode=MapMode.RAW)
        server = ServerProcess(
            *("--robot", f"sim:{WORLD}", "--map", str(map_file), "--semantic-map", str(memory))
        )
        server.begin()
        labels = sorted({each.label for place in known for each in place.landmarks})
        for what, times_ms in _talk(server, labels, new):
            yield from _figures(what, times_ms)
        server.close()
        yield from _figures("the file alone, written and flushed", _write_bare(memory))


def _talk(
    server: ServerProcess, labels: Sequence[str], new: Sequence[Waypoint]
) -> Iterator[tuple[str, Sequence[float]]]:
    """Return what was asked of the server, and the milliseconds of each call."""
    first, *others = labels
    yield "find_place, the first", [_ask(server, first)]
    yield "find_place, another thing", [_ask(server, label) for label in others]
    yield "find_place, again", [_ask(server, label) for label in others]
    yield "write_semantic_data, the first", [_write(server, new[0])]
    yield "write_semantic_data, a new place", [_write(server, place) for place in new[1:]]
    yield "write_semantic_data, a known place", [_write(server, place) for place in new[1:]]
    after_ms = []
    for place, label in zip(new[:N_PAIRS], others, strict=False):
        _write(server, place)
        after_ms.append(_ask(server, label))
    yield "find_place after a write", after_ms


def _ask(server: ServerProcess, words: str) -> float:
    return _timed(server, "find_place", query=words)


def _write(server: ServerProcess, place: Waypoint) -> float:
    pose = place.pose
    return _timed(
        server,
        "write_semantic_data",
        name=place.name,
        description="What is seen from here.",
        functional_landmarks=[
            {
                "label": each.label,
                "bearing_deg": round(math.degrees(each.bearing_rad or 0.0)),
                "range_m": round(each.range_m or 0.0, 1),
            }
            for each in place.landmarks
        ],
        x=round(pose.x, 2),
        y=round(pose.y, 2),
        yaw_deg=round(math.degrees(pose.yaw_rad)),
    )


def _timed(server: ServerProcess, tool: str, **arguments: object) -> float:
    result, took_ms = server.call(tool, **arguments)
    if result.get("isError"):
        raise RuntimeError(f"{tool} failed: {result['content'][0]['text']}")
    return took_ms


def _figures(what: str, times_ms: Sequence[float]) -> Iterator[Figure]:
    yield Figure(name=what, value=statistics.median(times_ms), unit="ms")
    if len(times_ms) > 1:
        slow_ms = float(np.quantile(times_ms, 0.95))
        yield Figure(name=f"{what}, slowest twentieth", value=slow_ms, unit="ms")


def _draw_poses(site: Site, n: int) -> list[Pose]:
    """Return places on which an observer can stand, looking any way."""
    random = np.random.default_rng(0)
    points = site.places[random.integers(len(site.places), size=n)]
    yaws_rad = random.uniform(-math.pi, math.pi, size=n)
    return [
        Pose(x, y, yaw_rad)
        for (x, y), yaw_rad in zip(points.tolist(), yaws_rad.tolist(), strict=True)
    ]


def _render(places: Sequence[Waypoint]) -> str:
    given: Iterator[dict[str, Any]] = (
        {k: v for k, v in data_of(each).items() if v not in (None, [])} for each in places
    )
    records = (record_text(each, indent=2) for each in given)
    return "\n".join(["version: 1\nwaypoints:", *records])


def _write_bare(path: Path) -> list[float]:
    content = path.read_bytes()

    def write() -> None:
        spare = path.with_suffix(".tmp")
        with spare.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        spare.replace(path)
        folder = os.open(path.parent, os.O_RDONLY)
        os.fsync(folder)
        os.close(folder)

    return [_clock(write) for _ in range(N_WRITES)]


def _clock(act: Callable[[], None]) -> float:
    started_s = time.perf_counter()
    act()
    return (time.perf_counter() - started_s) * 1e3
