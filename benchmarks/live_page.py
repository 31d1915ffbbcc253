"""What the live page costs and how quick it is: the stop, the server's share, the model's calls.

A simulated robot whose map grows to 1000 x 1000 cells is served with its page, in this process. The
pages are HTTP clients in another process that read every event, and fetch every tile that changes
and the camera each second, as browsers do. Rounds without and with pages alternate, so that what
else the machine does falls on both.
"""

import json
import statistics
import sys
import tempfile
import time
from collections.abc import AsyncGenerator, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import anyio
import httpx2
import numpy as np
from mcp.client import Client

from benchmarks.figure import Figure
from mapspeak.geometry import Pose
from mapspeak.links.simulated import SoloRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import CameraPicture, StampedPose
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
N_PAGES = (0, 1, 10)
N_ROUNDS = 5
SETTLE_S = 1.0
N_STOPS = 10
N_CALLS = 30
CALLS = ("get_robot_pose", "look_at_map")
GROWN_CELLS = 40


class RovingRobot(SoloRobot):
    """Turns in place and maps some more each time it is looked at."""

    def __init__(self) -> None:
        super().__init__(Simulation(load_world("flat_1"), seed=7), has_detector=False)
        self._n_looks = 0
        self._picture: CameraPicture | None = None
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

    async def fetch_picture(self, camera: str | None = None) -> CameraPicture:
        """Return a picture that is there already, as a real camera sends it."""
        if self._picture is None:
            self._picture = await super().fetch_picture(camera)
        return self._picture

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
    """Reads what a browser would."""

    http: httpx2.AsyncClient
    is_open: anyio.Event = field(default_factory=anyio.Event)

    async def read(self) -> None:
        """Read until cancelled."""
        tiles: set[str] = set()
        async with self.http.stream("GET", "/robots/robot/events") as answer:
            kind = ""
            async for line in answer.aiter_lines():
                name, _, rest = line.partition(": ")
                kind = rest if name == "event" else kind
                if name == "data":
                    self.is_open.set()
                    if kind == "map":
                        tiles = await self._fetch_tiles(json.loads(rest)["tiles"], tiles)

    async def watch(self) -> None:
        """Look through the camera each second, until cancelled."""
        while True:
            await self.http.get("/robots/robot/camera")
            await anyio.sleep(1.0)

    async def _fetch_tiles(self, names: list[list[str]], known: set[str]) -> set[str]:
        fresh = set()
        for row, line in enumerate(names):
            for col, name in enumerate(line):
                tile = f"{row}/{col}/{name}"
                fresh.add(tile)
                if name and tile not in known:
                    await self.http.get(f"/robots/robot/tiles/{tile}.png")
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


@dataclass
class Measured:
    """What was measured with one number of pages, in all rounds.

    Attributes:
        calls_ms: Of each tool, the times of its calls.
        stops_ms: From a page's stop to the robot, while the model calls on and on.
    """

    calls_ms: dict[str, list[float]]
    stops_ms: list[float]

    def figures(self, n_pages: int) -> Iterator[Figure]:
        """Sum up."""
        name = f"{n_pages} pages"
        for tool, times in self.calls_ms.items():
            tail = statistics.quantiles(times, n=20)[-1]
            median = statistics.median(times)
            yield Figure(name=f"{name}: {tool}, median", value=median, unit="ms")
            yield Figure(name=f"{name}: {tool}, 95 %", value=tail, unit="ms")
        stops = self.stops_ms
        told = statistics.median(stops), max(stops)
        yield Figure(name=f"{name}: stop during calls, median", value=told[0], unit="ms")
        yield Figure(name=f"{name}: stop during calls, worst", value=told[1], unit="ms")


async def measure_all(folder: Path) -> list[Figure]:
    """Measure with no page, with one, and with ten, in turns."""
    found = {n: Measured({tool: [] for tool in CALLS}, []) for n in N_PAGES}
    shares: dict[int, list[float]] = {n: [] for n in N_PAGES}
    async with serve(folder) as (robot, client):
        begun_s = time.perf_counter()
        async with httpx2.AsyncClient(base_url=f"http://{ADDRESS}") as http:
            await http.get("/")
            first_ms = 1e3 * (time.perf_counter() - begun_s)
        for _ in range(N_ROUNDS):
            for n_pages in N_PAGES:
                async with open_pages(n_pages):
                    await anyio.sleep(SETTLE_S)
                    shares[n_pages].append(await watch_idle())
                    for tool in CALLS:
                        found[n_pages].calls_ms[tool] += await time_calls(client, tool)
                    found[n_pages].stops_ms += await time_stops(robot, client)
    figures = [Figure(name="page is answered", value=first_ms, unit="ms")]
    for n_pages, each in found.items():
        share = statistics.median(shares[n_pages])
        name = f"{n_pages} pages: the server's share of a core"
        figures += [Figure(name=name, value=100 * share, unit="%"), *each.figures(n_pages)]
    return figures


async def watch_idle() -> float:
    """Return the share of a core that this process takes while no one calls."""
    cpu_s, begun_s = time.process_time(), time.perf_counter()
    await anyio.sleep(SETTLE_S)
    return (time.process_time() - cpu_s) / (time.perf_counter() - begun_s)


@asynccontextmanager
async def open_pages(n_pages: int) -> AsyncGenerator[None]:
    """Let another process read so many pages; return once each has been told something."""
    if not n_pages:
        yield
        return
    command = [sys.executable, "-m", "benchmarks.live_page", str(n_pages)]
    async with await anyio.open_process(command, stderr=None) as process:
        if process.stdout is not None:
            await process.stdout.receive()
        yield
        process.kill()


async def read_pages(n_pages: int) -> None:
    """Read so many pages, and say when all of them are open."""
    async with anyio.create_task_group() as tasks:
        pages = [
            Page(httpx2.AsyncClient(base_url=f"http://{ADDRESS}", timeout=60.0))
            for _ in range(n_pages)
        ]
        for page in pages:
            tasks.start_soon(page.read)
            tasks.start_soon(page.watch)
        for page in pages:
            await page.is_open.wait()
        sys.stdout.write("open\n")
        sys.stdout.flush()


async def time_calls(client: Client, tool: str) -> list[float]:
    """Return the times of calls of the model, in ms."""
    times = []
    for _ in range(N_CALLS):
        begun_s = time.perf_counter()
        await client.call_tool(tool, {})
        times.append(1e3 * (time.perf_counter() - begun_s))
    return times


async def time_stops(robot: RovingRobot, client: Client) -> list[float]:
    """Return the times from a page's stop to the robot while the model calls on, in ms."""
    times = []

    async def call_on() -> None:
        while True:
            await client.call_tool("look_at_map", {})

    http = httpx2.AsyncClient(base_url=f"http://{ADDRESS}")
    async with http, anyio.create_task_group() as tasks:
        tasks.start_soon(call_on)
        for _ in range(N_STOPS):
            await anyio.sleep(0.05)
            begun_s = time.perf_counter()
            await http.post("/robots/robot/stop", json={})
            times.append(1e3 * (robot.stopped_s - begun_s))
        tasks.cancel_scope.cancel()
    return times


def measure() -> Iterator[Figure]:
    """Measure the live page."""
    with tempfile.TemporaryDirectory() as folder:
        yield from anyio.run(measure_all, Path(folder))


if __name__ == "__main__":
    anyio.run(read_pages, int(sys.argv[1]))
