"""The live page in a real browser: every button, hostile names, a phone, and its pictures."""

import os
import sys
from collections.abc import AsyncGenerator
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import anyio
import numpy as np
import pytest
from anyio.abc import Process

from fakes import FakeRobot, two_rooms
from guarding import make_guard
from livepage import Live, find_free_address, serve_live, serve_page
from mapspeak.geometry import Point
from mapspeak.links.simulated import SoloRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import NavigationLook, NavigationPart
from mapspeak.safety import Approval, CommandKind, Otherwise, Policy
from mapspeak.server.view.calls import CallFeed
from mapspeak.server.view.feed import ViewFeed
from mapspeak.server.view.keys import PageKeys
from mapspeak.session import Session
from mapspeak.simulator import Simulation, load_world

playwright_api = pytest.importorskip("playwright.async_api")
from browsing import KEEP, PATIENCE_MS, PHONE, PICTURES, browse  # noqa: E402 - needs Playwright

expect = playwright_api.expect
pytestmark = [pytest.mark.anyio, pytest.mark.browser]

HOSTILE = "<img src=x onerror=alert(1)><script>alert(2)</script>"


async def unlock(page: Any, live: Live) -> None:  # noqa: ANN401 - a page of Playwright
    await page.fill("#token", live.tokens[-1])
    await page.click("#unlock button")
    await expect(page.locator("#unlock")).to_be_hidden()


async def test_the_buttons_that_make_a_robot_stand_need_no_token(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live, browse(live.address) as page:
        await live.client.call_tool("navigate_to", {"place": "R2", "wait_s": 0})
        await page.click("#stop")
        await expect(page.locator("#said")).to_have_text("The robot was told to stop.")
        await page.click("#hold")
        await expect(page.locator("#state")).to_contain_text("HELD")
        await page.click("#release")
        await expect(page.locator("#said")).to_contain_text("Unlock the page first")
    assert live.robot.n_stops >= 2


async def test_a_key_stops_the_robot_but_not_while_typing(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live, browse(live.address) as page:
        await page.locator("#token").press("s")
        assert live.robot.n_stops == 0
        await page.locator("#map").press("s")
        await expect(page.locator("#said")).to_have_text("The robot was told to stop.")
    assert live.robot.n_stops == 1


async def test_who_has_the_token_releases_checks_and_drives(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live, browse(live.address) as page:
        await page.fill("#token", "0000-0000-0000")
        await page.click("#unlock button")
        await expect(page.locator("#said")).to_contain_text("That is not the token")
        await unlock(page, live)
        await page.click("#hold")
        await page.click("#release")
        await expect(page.locator("#said")).to_have_text("Released.")
        await page.click("#map", position={"x": 300, "y": 380})
        await page.click("text=Check this goal")
        await expect(page.locator("#said")).to_contain_text("away by path")
        await page.click("#map", position={"x": 300, "y": 380})
        await page.click("text=Drive here")
        await expect(page.locator("#said")).to_contain_text("has begun")
        await expect(page.locator("#state")).to_contain_text("G1 to (")
    assert len(live.robot.goals) == 1


async def test_a_person_answers_a_mission_by_a_button_or_in_words(tmp_path: Path) -> None:
    tree = f"""
- look
- ask: Does the door stand open? {HOSTILE}
  answers: ['yes', 'no']
- ask: What is written on it?
"""
    toolsets = ("drive", "missions")
    async with serve_live(tmp_path, toolsets=toolsets) as live, browse(live.address) as page:
        asked, said = page.locator("#asked"), page.locator("#said")
        await expect(asked).to_be_hidden()
        await live.client.call_tool("run_mission", {"tree": tree, "wait_s": 1})
        await expect(asked).to_contain_text("Does the door stand open? <img")
        await expect(asked.get_by_role("img")).to_have_js_property("naturalWidth", 64)
        await asked.get_by_role("button", name="yes").click()
        await expect(said).to_contain_text("Unlock the page first")
        await unlock(page, live)
        await asked.get_by_role("button", name="yes").click()
        await expect(said).to_have_text("Q1 is answered: yes.")
        await asked.get_by_label("Answer Q2").last.fill("EXIT 4")
        await asked.get_by_role("button", name="Answer Q2").click()
        await expect(said).to_have_text("Q2 is answered: EXIT 4.")
        await expect(asked).to_be_hidden()
        await expect(page.locator("#missions")).to_contain_text("Last mission")


async def test_a_person_chooses_a_camera(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    robot.cameras = ("front", "rear")
    async with serve_live(tmp_path, robot) as live, browse(live.address) as page:
        await page.get_by_label("Which camera").select_option("rear")
        async with page.expect_request("**/camera?*camera=rear"):
            await expect(page.locator("#camera")).to_be_visible()


async def test_what_navigation_plans_is_a_layer_that_a_person_switches_on(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    path = (Point(1.5, 1.5), Point(3.0, 1.5))
    edge = tuple(
        Point(x, y) for x, y in ((1.3, 1.2), (1.7, 1.2), (1.7, 1.6), (1.3, 1.6), (1.3, 1.2))
    )
    robot.navigation = (
        NavigationLook(part=NavigationPart.PLAN, age_s=0.4, lines=(path,)),
        NavigationLook(part=NavigationPart.FOOTPRINT, age_s=0.1, lines=(edge,)),
    )
    async with serve_live(tmp_path, robot) as live, browse(live.address) as page:
        note, drawn = page.locator("#navigation"), page.locator("path.plan")
        await expect(page.locator("#state")).to_contain_text("x 1.50")
        await expect(note).to_be_hidden()
        await page.hover(".leaflet-control-layers")
        await page.get_by_label("navigation").check()
        await expect(note).to_contain_text("planned path 1.5 m long")
        await expect(drawn).to_have_css("stroke", "rgb(0, 158, 115)")
        # The robot's arrow does not hide where its edge is.
        box = await page.locator("path.footprint").bounding_box()
        on_top = "([x, y]) => document.elementFromPoint(x, y).classList.contains('footprint')"
        assert await page.evaluate(on_top, [box["x"] + 1, box["y"] + box["height"] / 2])
        robot.navigation = ()
        await expect(note).to_contain_text("publishes no planned path")
        await expect(drawn).to_have_count(0)
        await page.get_by_label("navigation").uncheck()
        await expect(note).to_be_hidden()


async def test_a_click_on_what_lies_there_notes_closes_renames_and_forgets(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live, browse(live.address) as page:
        await live.client.call_tool("look_at_map", {})
        await unlock(page, live)
        said, items = page.locator("#said"), page.locator("#items")

        async def choose(item: str) -> None:
            await page.locator("#index").evaluate("index => { index.open = true; }")
            await items.get_by_role("button", name=item).first.click()

        await choose("D1:")
        await page.get_by_label("Close D1 until").last.fill("in 2h")
        await page.get_by_role("button", name="Close D1 until").last.click()
        await expect(said).to_contain_text("Noted as E1")
        await live.client.call_tool("look_at_map", {})
        await choose("closed by event E1")
        await page.get_by_role("button", name="End E1").last.click()
        await expect(said).to_contain_text("Ended")
        await choose("R1:")
        await page.get_by_label("Note this place as").last.fill("spill")
        await page.get_by_role("button", name="Note this place as").last.click()
        await expect(said).to_contain_text("'spill' is remembered")
        await live.client.call_tool("look_at_map", {})
        await choose("W1: spill")
        await page.get_by_label("Rename to").last.fill(HOSTILE[:40])
        await page.get_by_role("button", name="Rename to").last.click()
        await expect(said).to_contain_text("is called '<img")
        await choose("W1: <img")
        await page.get_by_role("button", name="Forget W1").last.click()
        await expect(said).to_contain_text("Forgotten")
        await expect(items).not_to_contain_text("W1")


async def test_another_page_is_told_what_a_person_does(tmp_path: Path) -> None:
    async with (
        serve_live(tmp_path) as live,
        browse(live.address) as page,
        browse(live.address) as other,
    ):
        # Who opens a page hears what happens from then on.
        await expect(other.locator("#state")).to_contain_text("x 1.50")
        await page.click("#stop")
        await expect(page.locator("#said")).to_have_text("The robot was told to stop.")
        await expect(other.locator("#said")).to_have_text("a person: The robot was told to stop.")


async def test_two_robots_are_stopped_one_by_one_and_all_at_once(tmp_path: Path) -> None:
    robots = {name: FakeRobot(two_rooms()) for name in ("ada", "ben")}
    feeds = {}
    for name, robot in robots.items():
        store = SemanticMapStore(tmp_path / f"{name}.yaml")
        session = Session(robot, store, lease_s=60.0, find_model=lambda: None)
        feeds[name] = ViewFeed(session, CallFeed())
    keys = PageKeys(lambda _: None)
    async with serve_page(feeds, keys) as address, browse(f"{address}/?robot=ben") as page:
        await expect(page.locator("#stop")).to_have_text("STOP ben")
        await page.click("#stop")
        await expect(page.locator("#said")).to_have_text("The robot was told to stop.")
        assert [robot.n_stops for robot in robots.values()] == [0, 1]
        await page.select_option("#robots", "ada")
        await expect(page.locator("#stop")).to_have_text("STOP ada")
        await page.click("#stop-all")
        await expect(page.locator("#said")).to_contain_text("ben: The robot was told to stop.")
        assert [robot.n_stops for robot in robots.values()] == [1, 2]
        await page.evaluate("byId('said').textContent = ''")
        await page.locator("body").press("s")
        await expect(page.locator("#said")).to_contain_text("ada: The robot was told to stop.")
        assert [robot.n_stops for robot in robots.values()] == [2, 3]


async def test_a_page_that_is_left_open_keeps_to_its_bounds_and_comes_back(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live, browse(live.address) as page:
        state, calls = page.locator("#state"), page.locator("#calls li")
        await expect(state).to_contain_text("x 1.50")
        for _ in range(105):
            await live.client.call_tool("get_robot_pose", {})
        await expect(calls).to_have_count(100)
        await expect(calls.first).to_contain_text("105 get_robot_pose")
        await expect(calls.first).to_contain_text("s ago, took")
        # As when the machine of the page has slept.
        await page.evaluate("""() => {
          const before = performance.now.bind(performance);
          performance.now = () => before() + 8 * 3600 * 1000;
        }""")
        await expect(calls.first).to_contain_text("8 h ago")
        await live.client.call_tool("navigate_to", {"place": "R2", "wait_s": 0})
        await expect(state).not_to_contain_text("does not answer")
        await expect(state).to_contain_text("G1 to R2")
        await page.click("#stop")
        await expect(page.locator("#said")).to_have_text("The robot was told to stop.")


async def test_the_view_grows_with_the_map_until_a_person_moves_it(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live, browse(live.address) as page:
        scale = page.locator(".leaflet-control-scale-line")

        async def grow() -> None:
            grid = live.robot.grid
            cells = np.pad(grid.cells, ((0, 2 * grid.n_rows), (0, 2 * grid.n_cols)))
            live.robot.grid = replace(grid, cells=cells)

        await expect(page.locator("#map img.leaflet-image-layer")).to_have_count(1)
        before = await scale.inner_text()
        await grow()
        await expect(scale).not_to_have_text(before)
        await page.click(".leaflet-control-zoom-in")
        await page.click(".leaflet-control-zoom-in")
        await expect(page.locator(".leaflet-zoom-anim")).to_have_count(0)
        moved = await scale.inner_text()
        await grow()
        await expect(page.locator("#state")).to_contain_text("map changed 0 s ago")
        assert await scale.inner_text() == moved
        await page.click(".whole")
        await expect(scale).not_to_have_text(moved)


async def test_a_mission_is_drawn_as_a_tree(tmp_path: Path) -> None:
    tree = "- wait: 1\n- ask: Is it open?\n"
    tools = ("drive", "missions")
    async with serve_live(tmp_path, toolsets=tools) as live, browse(live.address) as page:
        await live.client.call_tool("save_mission", {"name": "patrol", "tree": tree})
        await live.client.call_tool("run_mission", {"name": "patrol"})
        missions = page.locator("#missions")
        await expect(missions).to_contain_text("Mission under way: patrol")
        await expect(missions.locator("li.succeeded")).to_have_text("✓ wait 1 succeeded")
        await expect(missions.locator("li.running")).to_have_text('▶ ask "Is it open?" running')
        await expect(page.locator("#asked")).to_contain_text('Q1: "Is it open?"')
        await live.client.call_tool("answer_mission", {"answer": "yes"})
        await expect(missions).to_contain_text("Last mission: patrol")
        await expect(missions).to_contain_text("Saved mission: patrol")


async def test_what_waits_is_approved_and_refused(tmp_path: Path) -> None:
    approval = Approval(kinds=frozenset({CommandKind.DRIVE}), otherwise=Otherwise.QUEUE)
    guard = make_guard(tmp_path, Policy(approval=approval))
    async with serve_live(tmp_path, guard=guard) as live, browse(live.address) as page:
        await unlock(page, live)
        for button, is_let in (("Refuse", False), ("Approve", True)):
            await live.client.call_tool("navigate_to", {"x": 3.0, "y": 1.0})
            await expect(page.locator("#waiting")).to_contain_text("May it drive to")
            await page.click(f"#waiting >> text={button}")
            await expect(page.locator("#waiting")).to_be_hidden()
            if is_let:
                await live.client.call_tool("navigate_to", {"x": 3.0, "y": 1.0})
            assert bool(live.robot.goals) is is_let


async def test_calls_are_shown_as_the_client_was_answered(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live, browse(live.address) as page:
        await live.client.call_tool("look_through_camera", {})
        await page.click("#calls summary")
        await expect(page.locator("#calls pre")).to_contain_text("Picture P1")
        picture = page.locator("#calls img")
        await expect(picture).to_have_attribute("alt", "Picture 1 of 1 of 1 look_through_camera")


async def test_hostile_names_are_text_everywhere(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live, browse(live.address) as page:
        noted = {"name": HOSTILE, "description": HOSTILE, "geometric_features": [HOSTILE]}
        await live.client.call_tool("write_semantic_data", noted)
        await live.client.call_tool("navigate_to", {"place": HOSTILE, "wait_s": 0})
        await live.client.call_tool("look_at_map", {})
        await expect(page.locator("#calls li")).to_have_count(3)
        await page.locator("#calls summary").first.click()
        await page.locator("path.leaflet-interactive").last.dispatch_event("mouseover")
        await expect(page.locator("#calls")).to_contain_text("onerror")
        assert await page.locator("img[src=x]").count() == 0


async def test_a_phone_shows_all_of_it_without_scrolling_sideways(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live, browse(live.address, size=PHONE, is_dark=True) as page:
        assert await page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        box = await page.locator("#stop").bounding_box()
    assert box["height"] >= 44


@asynccontextmanager
async def run_server(folder: Path, address: str, *more: str) -> AsyncGenerator[Process]:
    """Run the command, as a client does that speaks over its standard input."""
    command = [sys.executable, "-m", "mapspeak", "serve", "--robot", "sim:flat_1"]
    command += ["--clock", "virtual", "--view", address]
    command += ["--control", str(folder / "control"), "--audit", str(folder / "audit.jsonl"), *more]
    async with await anyio.open_process(command) as process:
        assert process.stderr is not None
        told = ""
        while f"live page at http://{address}/" not in told:
            told += (await process.stderr.receive()).decode()
        yield process
        process.kill()


async def test_a_page_whose_server_ends_says_so_and_comes_back_with_the_next_one(
    tmp_path: Path,
) -> None:
    address = find_free_address()
    async with AsyncExitStack() as stack:
        async with run_server(tmp_path, address):
            page = await stack.enter_async_context(browse(f"http://{address}/"))
            state, said = page.locator("#state"), page.locator("#said")
            await expect(state).to_contain_text("x 0.00")
        await expect(state).to_contain_text("does not answer")
        await page.click("#stop")
        await expect(said).to_contain_text("NOT SENT")
        async with run_server(tmp_path, address):
            await expect(state).not_to_contain_text("does not answer", timeout=PATIENCE_MS)


async def test_the_command_shows_the_missions_that_are_saved_beside_its_memory(
    tmp_path: Path,
) -> None:
    saved = tmp_path / "places.memory" / "missions" / "patrol.yaml"
    saved.parent.mkdir(parents=True)
    saved.write_text("skills:\n- name: patrol\n  mission:\n  - wait: 1\n")
    address = find_free_address()
    memory = ("--memory", str(tmp_path / "places.yaml"), "--toolsets", "+missions")
    async with run_server(tmp_path, address, *memory), browse(f"http://{address}/") as page:
        await expect(page.locator("#missions")).to_contain_text("Saved mission: patrol")


async def test_what_a_page_loads_besides_map_and_camera_is_small(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live, browse(live.address) as page:
        loaded = await page.evaluate(
            "performance.getEntriesByType('resource')"
            ".filter((each) => /page|leaflet/.test(each.name))"
            ".reduce((sum, each) => sum + each.decodedBodySize, 0)"
        )
    assert 100_000 < loaded <= 400_000


async def test_an_exploration_is_shown_as_it_goes_on(tmp_path: Path) -> None:
    robot = SoloRobot(Simulation(load_world("office"), seed=7), has_detector=True)
    tools = ("look", "drive", "explore", "paper")
    async with serve_live(tmp_path, robot, toolsets=tools) as live, browse(live.address) as page:
        for _ in range(3):
            await live.client.call_tool("explore", {"wait_s": 10})
        await live.client.call_tool("look_through_camera", {})
        ladder = {"label": "ladder", "bearing_deg": 5, "range_m": 2.5}
        noted = {"name": "ladder corner", "description": "by the door"}
        await live.client.call_tool(
            "write_semantic_data", {**noted, "functional_landmarks": [ladder]}
        )
        await live.client.call_tool("look_at_map", {})
        await live.client.call_tool("navigate_to", {"place": "farthest room", "wait_s": 1})
        await expect(page.locator(".leaflet-tooltip.name").first).to_be_visible()
        await page.locator("#calls summary").nth(1).click()
        await expect(page.locator("#calls pre")).to_contain_text("Explored")
        if KEEP in os.environ:
            await page.screenshot(path=PICTURES / "live-page.png")
