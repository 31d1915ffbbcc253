"""What the live page costs and how quick it is: the stop, the server's share, the model's calls.

A simulated robot whose map grows to 1000 x 1000 cells is served with its page, in this process; the
pages are HTTP clients that read every event and fetch every tile that changes, as a browser does.
"""

import json
import statistics
import tempfile
import time
from collections.abc import AsyncGenerator, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import anyio
import httpx2
import numpy as np
from mcp.client import Client

from benchmarks.figure import Figure
from mapspeak.geometry import Pose
from mapspeak.links.simulated import SoloRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import StampedPose
from mapspeak.server.app import build_server
from mapspeak.server.view.calls import CallFeed
from mapspeak.server.view.feed import ViewFeed
from mapspeak.server.view.keys import PageKeys
from mapspeak.server.view.site import serve_view
from mapspeak.session import Session
from mapspeak.simulator import Simulation, load_world
from mapspeak.spatial import OccupancyGrid

__all__ = ["measure"]

ADDRESS = "127.0.0.1:8798"
N_CELLS = 1000
WATCH_S = 10.0
N_PAGES = 10
N_STOPS = 20
N_CALLS = 40
GROWN_CELLS = 40


class RovingRobot(SoloRobot):
    """Turns in place and maps some more each time it is looked at."""

    def __init__(self) -> None:
        super().__init__(Simulation(load_world("flat_1"), seed=7), has_detector=False)
        self._n_looks = 0
        self._stopped_at: list[float] = []
        cells = np.full((N_CELLS, N_CELLS), -1, dtype=np.int8)
        cells[400:600, 400:600] = 0
        self._grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(-25.0, -25.0))

    async def fetch_pose(self) -> StampedPose:
        """Return a pose that changes."""
        self._n_looks += 1
        stamped = await super().fetch_pose()
        return replace(stamped, pose=Pose(0.0, 0.0, self._n_looks / 20))

    async def fetch_map(self) -> OccupancyGrid:
        """Return a map that grows."""
        cells = self._grid.cells.copy()
        row = self._n_looks % (N_CELLS - GROWN_CELLS)
        cells[row : row + GROWN_CELLS, 300:700] = 0
        self._grid = replace(self._grid, cells=cells)
        return self._grid

    async def stop(self) -> None:
        """Note when it was told to stop."""
        self._stopped_at.append(time.perf_counter())
        await super().stop()

    @property
    def stopped_s(self) -> float:
        """When it was told last."""
        return self._stopped_at[-1]


@dataclass
class Page:
    """Reads what a browser would.

    Attributes:
        n_bytes: Of events and tiles.
    """

    http: httpx2.AsyncClient
    n_bytes: int = 0
    n_events: int = 0

    async def read(self) -> None:
        """Read until cancelled."""
        tiles: set[str] = set()
        async with self.http.stream("GET", "/robots/robot/events") as answer:
            kind = ""
            async for line in answer.aiter_lines():
                self.n_bytes += len(line)
                name, _, rest = line.partition(": ")
                kind = rest if name == "event" else kind
                if name == "data":
                    self.n_events += 1
                    if kind == "map":
                        tiles = await self._fetch_tiles(json.loads(rest)["tiles"], tiles)

    async def _fetch_tiles(self, names: list[list[str]], known: set[str]) -> set[str]:
        fresh = set()
        for row, line in enumerate(names):
            for col, name in enumerate(line):
                tile = f"{row}/{col}/{name}"
                fresh.add(tile)
                if name and tile not in known:
                    png = await self.http.get(f"/robots/robot/tiles/{tile}.png")
                    self.n_bytes += len(png.content)
        return fresh


@asynccontextmanager
async def serve(folder: Path) -> AsyncGenerator[tuple[RovingRobot, Client]]:
    """Serve a robot and its page."""
    robot, calls, is_ready = RovingRobot(), CallFeed(), anyio.Event()
    memory = SemanticMapStore(folder / "memory.yaml", map_id="roving")
    session = Session(robot, memory, lease_s=60.0, find_model=lambda: None)
    async with (
        anyio.create_task_group() as tasks,
        Client(build_server(session, call_log=calls)) as client,
    ):

        async def show() -> None:
            def tell(_address: str) -> None:
                is_ready.set()

            feeds = {"": ViewFeed(session, calls)}
            await serve_view(feeds, ADDRESS, keys=PageKeys(lambda _: None), on_ready=tell)

        tasks.start_soon(show)
        await is_ready.wait()
        yield robot, client
        tasks.cancel_scope.cancel()


async def time_calls(client: Client) -> float:
    """Return the median time of a call of the model, in ms."""
    times = []
    for _ in range(N_CALLS):
        begun_s = time.perf_counter()
        await client.call_tool("get_robot_pose", {})
        times.append(1e3 * (time.perf_counter() - begun_s))
    return statistics.median(times)


async def measure_all(folder: Path) -> list[Figure]:
    """Measure with no page, with one, and with ten."""
    figures = []
    async with serve(folder) as (robot, client):
        begun_s = time.perf_counter()
        async with httpx2.AsyncClient(base_url=f"http://{ADDRESS}") as http:
            await http.get("/")
            first_ms = 1e3 * (time.perf_counter() - begun_s)
        figures.append(Figure(name="page is answered", value=first_ms, unit="ms"))
        for n_pages in (0, 1, N_PAGES):
            figures += await measure_with(n_pages, robot, client)
    return figures


async def measure_with(n_pages: int, robot: RovingRobot, client: Client) -> list[Figure]:
    """Measure while so many pages are open."""
    pages = [
        Page(httpx2.AsyncClient(base_url=f"http://{ADDRESS}", timeout=60.0)) for _ in range(n_pages)
    ]
    async with anyio.create_task_group() as tasks:
        for page in pages:
            tasks.start_soon(page.read)
        await anyio.sleep(2.0)
        cpu_s, begun_s = time.process_time(), time.perf_counter()
        n_before = sum(page.n_events for page in pages)
        n_bytes = sum(page.n_bytes for page in pages)
        await anyio.sleep(WATCH_S)
        spent_s = time.perf_counter() - begun_s
        share = (time.process_time() - cpu_s) / spent_s
        n_events = sum(page.n_events for page in pages) - n_before
        n_bytes = sum(page.n_bytes for page in pages) - n_bytes
        call_ms = await time_calls(client)
        stops_ms = await time_stops(robot)
        tasks.cancel_scope.cancel()
    name = f"{n_pages} pages"
    figures = [
        Figure(name=f"{name}: of one core, readers included", value=100 * share, unit="%"),
        Figure(name=f"{name}: a call of the model, median", value=call_ms, unit="ms"),
        Figure(name=f"{name}: stop until the robot is told, median", value=stops_ms[0], unit="ms"),
        Figure(name=f"{name}: stop until the robot is told, worst", value=stops_ms[1], unit="ms"),
    ]
    if pages:
        rate_hz = n_events / n_pages / spent_s
        figures.append(Figure(name=f"{name}: events to each", value=rate_hz, unit="1/s"))
        each_kb = n_bytes / n_pages / spent_s / 1e3
        figures.append(Figure(name=f"{name}: read by each", value=each_kb, unit="kB/s"))
    return figures


async def time_stops(robot: RovingRobot) -> tuple[float, float]:
    """Return the median and the worst time from a page's stop to the robot, in ms."""
    times = []
    async with httpx2.AsyncClient(base_url=f"http://{ADDRESS}") as http:
        for _ in range(N_STOPS):
            begun_s = time.perf_counter()
            await http.post("/robots/robot/stop", json={})
            times.append(1e3 * (robot.stopped_s - begun_s))
    return statistics.median(times), max(times)


def measure() -> Iterator[Figure]:
    """Measure the live page."""
    with tempfile.TemporaryDirectory() as folder:
        yield from anyio.run(measure_all, Path(folder))
