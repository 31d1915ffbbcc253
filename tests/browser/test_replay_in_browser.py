"""A replay in a real browser, opened as a file without any server."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcp.client import Client

from fakes import FakeRobot, two_rooms
from mapspeak.evaluation.report.page import write_page
from mapspeak.evaluation.trials import (
    ToolCall,
    Turn,
    read_results,
    trial_folder,
    write_result,
)
from mapspeak.memory import SemanticMapStore
from mapspeak.server.app import build_server
from mapspeak.server.view.pages import build_replay_page
from mapspeak.server.view.replay import MAPS, MapLog, replay_log
from mapspeak.server.wire.calllog import CallLog
from mapspeak.session import Session
from reportmaking import make_result, make_trial, make_turns, write_course, write_trial

playwright_api = pytest.importorskip("playwright.async_api")
from browsing import KEEP, PHONE, PICTURES, browse  # noqa: E402 - needs Playwright

expect = playwright_api.expect
pytestmark = [pytest.mark.anyio, pytest.mark.browser]

HOSTILE = "<img src=x onerror=alert(1)><script>alert(2)</script>\u202egnorw"
RUN = "MAPSPEAK_SHOWN_RUN"
"""The folder of a run whose replay is taken as a picture for the documents."""


@pytest.fixture
def replay(tmp_path: Path) -> str:
    """The address of a trial's replay, a file."""
    write_trial(tmp_path, make_trial(1))
    write_page(tmp_path, read_results(tmp_path))
    return (trial_folder(tmp_path, make_trial(1)) / "replay.html").as_uri()


async def stands_at(page: Any, number: int) -> None:  # noqa: ANN401 - a page of Playwright
    await expect(page.locator("#step")).to_have_text(f"{number} of 4")
    await expect(page.locator("#calls details[open]")).to_have_count(1)
    await expect(page.locator(f"#step-{number} details")).to_have_attribute("open", "")


async def test_a_replay_goes_step_by_step_by_buttons_keys_slider_and_clicks(replay: str) -> None:
    async with browse(replay) as page:
        await stands_at(page, 1)
        await page.click("#step-on")
        await stands_at(page, 2)
        await expect(page.locator("#step-2 pre")).to_contain_text("Explored: 6.0 m2")
        await page.locator("body").press("ArrowRight")
        await stands_at(page, 3)
        await page.locator("body").press("ArrowLeft")
        await stands_at(page, 2)
        await page.fill("#slider", "3")
        await stands_at(page, 4)
        await expect(page.locator("#state")).to_contain_text("x 5.00, y 1.50")
        await page.click("#step-1 summary")
        await stands_at(page, 1)


async def test_a_replay_plays_to_its_end_at_the_chosen_speed(replay: str) -> None:
    async with browse(replay) as page:
        await page.select_option("#speed", "100")
        await page.click("#play")
        await expect(page.locator("#play")).to_have_text("Pause")
        await stands_at(page, 4)
        await expect(page.locator("#play")).to_have_text("Play")


async def test_an_address_leads_to_a_step(replay: str) -> None:
    async with browse(f"{replay}#step-3") as page:
        await stands_at(page, 3)


async def test_pictures_are_shown_with_alt_texts_and_lead_to_themselves(replay: str) -> None:
    async with browse(f"{replay}#step-2") as page:
        seen = page.locator("#picture img")
        await expect(seen).to_have_attribute("alt", "What was seen in step 2")
        assert await seen.evaluate("image => image.decode().then(() => image.naturalWidth)") == 6
        link = page.locator("#step-2 a")
        await expect(link).to_have_attribute("href", "pictures/003.png")
        alts = await page.eval_on_selector_all("aside img", "all => all.map((each) => each.alt)")
        assert all(alts)


async def test_a_replay_on_a_phone_and_in_the_dark_fits_its_width(replay: str) -> None:
    async with browse(replay, size=PHONE, is_dark=True) as page:
        assert await page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        await page.click("#step-on")
        await stands_at(page, 2)


async def test_the_map_grows_with_the_steps(tmp_path: Path) -> None:
    robot, log = FakeRobot(two_rooms()), CallLog(tmp_path / "calls.jsonl")
    store = SemanticMapStore(tmp_path / "m.yaml")
    session = Session(robot, store, lease_s=60.0, find_model=lambda: None)
    maps = MapLog(session, log.pictures / MAPS, log)
    async with Client(build_server(session, call_log=maps)) as client:
        await client.call_tool("look_at_map", {})
        cells = np.where(np.arange(30) < 12, two_rooms().cells, -1).astype(np.int8)
        robot.grid = replace(two_rooms(), cells=cells)
        await client.call_tool("look_at_map", {})
    page_file = tmp_path / "calls.html"
    page_file.write_bytes(build_replay_page("calls", replay_log(log.path)))
    async with browse(page_file.as_uri()) as page:
        items, tile = page.locator("#items"), page.locator("#map img.leaflet-image-layer").last
        await expect(items).to_contain_text("D1: door of R1 and R2")
        first = await tile.get_attribute("src")
        await page.click("#step-on")
        await expect(items).not_to_contain_text("D1")
        await expect(tile).not_to_have_attribute("src", first)
        await page.click("#step-back")
        await expect(items).to_contain_text("D1")
        await expect(tile).to_have_attribute("src", first)


async def test_hostile_text_is_text(tmp_path: Path) -> None:
    trial = make_trial(1)
    call = ToolCall(tool=HOSTILE, arguments={HOSTILE: HOSTILE})
    write_course(tmp_path, trial, Turn(role="agent", call=call, text=HOSTILE), *make_turns())
    write_result(tmp_path, make_result(trial, answer=HOSTILE, prompt=HOSTILE))
    write_page(tmp_path, read_results(tmp_path))
    page_file = trial_folder(tmp_path, trial) / "replay.html"
    async with browse(page_file.as_uri()) as page:
        await expect(page.locator("#calls pre")).to_contain_text(
            "<script>alert(2)</script><U+202E>"
        )
        assert await page.locator("img[src=x]").count() == 0


@pytest.fixture
def shown() -> str:
    """The address of a demo's replay."""
    (page_file,) = Path(os.environ[RUN]).resolve().glob("trials/explore/**/replay.html")
    return page_file.as_uri()


@pytest.mark.skipif(RUN not in os.environ, reason="needs the folder of a demo")
async def test_a_demo_is_replayed(shown: str) -> None:
    async with browse(f"{shown}#step-68") as page:
        seen = await page.locator("text=/^seen in step [0-9]+$/").inner_text()
    async with browse(f"{shown}#step-{seen.split()[-1]}") as page:
        await expect(page.locator("#calls details[open] img").first).to_be_visible()
        if KEEP in os.environ:
            await page.screenshot(path=PICTURES / "replay.png")
