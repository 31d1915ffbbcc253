"""What a real browser makes of the live page: its first paint, and panning a map of 16 Mcells.

It needs Playwright and a Chromium: `.venv-browser/bin/python -m benchmarks.run browser`, after
`./run test-browser` has made that.
"""

import shutil
import socket
import tempfile
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import anyio
import click
import numpy as np

from benchmarks.figure import Figure
from mapspeak.geometry import Pose
from mapspeak.links.simulated import SoloRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.server.view.calls import CallFeed
from mapspeak.server.view.feed import ViewFeed
from mapspeak.server.view.keys import PageKeys
from mapspeak.server.view.site import serve_view
from mapspeak.session import Session
from mapspeak.simulator import Simulation, load_world
from mapspeak.spatial import OccupancyGrid

__all__ = ["measure"]

N_CELLS = 4000
EVERY = 80
"""Walls stand so many cells apart."""
CRUMBS_RATIO = 0.02
PAN_S = 5.0
DRAWN_S = 60.0
"""Time for all tiles to come."""
SIZE = {"width": 1280, "height": 800}
COUNT_FRAMES = "window.n = 0; (function each() { window.n += 1; requestAnimationFrame(each); })()"
FIRST_PAINT = "performance.getEntriesByName('first-contentful-paint')[0].startTime"


class LargeRobot(SoloRobot):
    """Has a map of 4000 x 4000 cells."""

    def __init__(self) -> None:
        super().__init__(Simulation(load_world("flat_1"), seed=7), has_detector=False)
        cells = np.zeros((N_CELLS, N_CELLS), dtype=np.int8)
        cells[::EVERY] = cells[:, ::EVERY] = 100
        cells[np.random.default_rng(0).random(cells.shape) < CRUMBS_RATIO] = 100
        self._grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(-100.0, -100.0))

    async def fetch_map(self) -> OccupancyGrid:
        """Return that map."""
        return self._grid


def measure() -> Iterator[Figure]:
    """Measure the page in a browser of this machine."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if find_spec("playwright") is None or browser is None:
        click.echo("browser: not measured, for want of Playwright or a Chromium.", err=True)
        return
    with tempfile.TemporaryDirectory() as folder:
        yield from anyio.run(_show, Path(folder), browser)


async def _show(folder: Path, browser: str) -> list[Figure]:
    from playwright.async_api import async_playwright  # noqa: PLC0415 - only .venv-browser has it

    memory = SemanticMapStore(folder / "memory.yaml", map_id="large")
    session = Session(LargeRobot(), memory, lease_s=60.0, find_model=lambda: None)
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"127.0.0.1:{free.getsockname()[1]}"
    is_ready = anyio.Event()
    async with anyio.create_task_group() as tasks:

        async def serve() -> None:
            def tell(_address: str) -> None:
                is_ready.set()

            feeds = {"": ViewFeed(session, CallFeed())}
            await serve_view(feeds, address, keys=PageKeys(lambda _: None), on_ready=tell)

        tasks.start_soon(serve)
        await is_ready.wait()
        async with async_playwright() as playwright:
            chromium = playwright.chromium
            program = await chromium.launch(executable_path=browser, args=["--no-sandbox"])
            page = await program.new_page(viewport=SIZE)
            await page.goto(f"http://{address}/")
            figures = await _measure_page(page)
            await program.close()
        tasks.cancel_scope.cancel()
    return figures


async def _measure_page(page: Any) -> list[Figure]:  # noqa: ANN401 - a page of Playwright
    begun_s, n_tiles = time.monotonic(), 0
    while n_tiles < (N_CELLS // 256) ** 2 and time.monotonic() < begun_s + DRAWN_S:
        await anyio.sleep(0.2)
        n_tiles = await page.evaluate(
            "[...document.querySelectorAll('#map img')].filter((tile) => tile.complete).length"
        )
    await page.evaluate(COUNT_FRAMES)
    await page.mouse.move(400, 400)
    await page.mouse.down()
    n_before, begun_s, n_moves = await page.evaluate("window.n"), time.perf_counter(), 0
    while time.perf_counter() < begun_s + PAN_S:
        n_moves += 1
        await page.mouse.move(400 + 150 * np.sin(n_moves / 7), 400 + 150 * np.cos(n_moves / 9))
    spent_s = time.perf_counter() - begun_s
    rate_hz = (await page.evaluate("window.n") - n_before) / spent_s
    await page.mouse.up()
    name = f"{N_CELLS} x {N_CELLS}"
    return [
        Figure(name=f"{name}: first paint", value=await page.evaluate(FIRST_PAINT), unit="ms"),
        Figure(name=f"{name}: tiles", value=n_tiles, unit=""),
        Figure(name=f"{name}: frames while it is panned", value=rate_hz, unit="1/s"),
        Figure(name=f"{name}: moves of the pointer meanwhile", value=n_moves / spent_s, unit="1/s"),
    ]
