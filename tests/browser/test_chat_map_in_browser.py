"""The map in a chat (MCP Apps), against the extension's own implementation of the chat's side.

The frame is sandboxed and may load what the extension allows a page that asks for nothing. What
stands between the page and the server, a chat's client, is played by the host's web server.
"""

import os
import sys
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import anyio
import pytest
import uvicorn
from mcp.client import Client
from mcp.client.extension import advertise
from mcp.server.apps import APP_MIME_TYPE, EXTENSION_ID
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route

from fakes import FakeRobot, two_rooms
from livepage import find_free_address
from mapspeak.errors import LinkError
from mapspeak.links.simulated import SoloRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import Robot
from mapspeak.server.app import build_server
from mapspeak.server.view.chat import URI
from mapspeak.server.wire.access import listen
from mapspeak.session import Session
from mapspeak.simulator import Simulation, load_world
from mapspeak.spatial import OccupancyGrid

playwright_api = pytest.importorskip("playwright.async_api")
from browsing import KEEP, PHONE, PICTURES, browse  # noqa: E402 - needs Playwright

expect = playwright_api.expect
HOST = Path(__file__).with_name("host")
BUNDLE = Path(sys.prefix) / "host" / "bundle.js"
pytestmark = [
    pytest.mark.anyio,
    pytest.mark.browser,
    pytest.mark.skipif(not BUNDLE.exists(), reason="./run test-browser makes the chat, with npm"),
]

POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-inline'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data:; media-src 'self' data:; connect-src 'none'"
)
"""What the extension lets a page do that asks for no more."""
HOSTILE = "<img src=x onerror=alert(1)>"


class Chat:
    """A chat's client and web server."""

    def __init__(self, client: Client, address: str) -> None:
        self.client = client
        self.address = f"http://{address}/"

    async def show_page(self, _: Request) -> Response:
        read = await self.client.read_resource(URI)
        headers = {"content-security-policy": POLICY}
        return Response(read.contents[0].text, media_type="text/html", headers=headers)  # type: ignore[union-attr]

    async def call(self, request: Request) -> Response:
        asked = await request.json()
        answer = await self.client.call_tool(asked["name"], asked["arguments"])
        return JSONResponse(answer.model_dump(mode="json", by_alias=True, exclude_none=True))

    async def show_host(self, request: Request) -> Response:
        name = request.path_params["name"]
        return FileResponse(BUNDLE if name == "host.js" else HOST / "host.html")

    async def serve(self) -> None:
        routes = [
            Route("/page", self.show_page),
            Route("/call", self.call, methods=["POST"]),
            Route("/{name:path}", self.show_host),
        ]
        port = int(self.address.rstrip("/").rpartition(":")[2])
        config = uvicorn.Config(Starlette(routes=routes), log_level="error", lifespan="off")
        with listen("127.0.0.1", port) as listener:
            await uvicorn.Server(config).serve(sockets=[listener])


@asynccontextmanager
async def open_chat(folder: Path, robot: Robot | None = None) -> AsyncGenerator[Chat]:
    """Serve a robot to a chat that shows pages."""
    robot = robot or FakeRobot(two_rooms())
    store = SemanticMapStore(folder / "m.yaml", map_id="two-rooms")
    session = Session(robot, store, lease_s=60.0, find_model=lambda: None)
    apps = advertise(EXTENSION_ID, {"mimeTypes": [APP_MIME_TYPE]})
    async with (
        anyio.create_task_group() as tasks,
        Client(build_server(session), extensions=[apps]) as client,
    ):
        chat = Chat(client, find_free_address())
        tasks.start_soon(chat.serve)
        with anyio.fail_after(30):
            await _wait_for(chat.address)
        yield chat
        tasks.cancel_scope.cancel()


async def _wait_for(address: str) -> None:
    port = int(address.rstrip("/").rpartition(":")[2])
    while True:
        try:
            await (await anyio.connect_tcp("127.0.0.1", port)).aclose()
        except OSError:
            await anyio.lowlevel.checkpoint()
        else:
            return


def frame_of(page: Any) -> Any:  # noqa: ANN401 - of Playwright
    return page.frame_locator("#app")


async def test_the_map_is_shown_beside_the_answer(tmp_path: Path) -> None:
    async with open_chat(tmp_path) as chat, browse(chat.address) as page:
        app = frame_of(page)
        await expect(app.locator("#map img").first).to_be_visible()
        await expect(app.locator("#state")).to_contain_text("Robot at x 1.5, y 1.4")
        await expect(app.locator("#items")).to_contain_text("R1:")
        await expect(app.locator("#stop")).to_be_hidden()


async def test_a_click_on_a_room_says_to_the_model_to_go_there(tmp_path: Path) -> None:
    async with open_chat(tmp_path) as chat, browse(chat.address) as page:
        app = frame_of(page)
        await app.locator("#index summary").click()
        await app.locator("#items").get_by_role("button", name="R1:").first.click()
        await app.get_by_role("button", name="Go to R1").click()
        await expect(app.locator("#said")).to_have_text("Told the model: Go to R1.")
        assert await page.evaluate("window.said") == ["user: Go to R1."]
        await app.locator("#map").click(position={"x": 250, "y": 200})
        await app.get_by_role("button", name="Go to").last.click()
        await expect(app.locator("#said")).to_contain_text("Go to")


async def test_the_map_follows_what_comes_later(tmp_path: Path) -> None:
    async with open_chat(tmp_path) as chat, browse(chat.address) as page:
        app = frame_of(page)
        await expect(app.locator("#state")).to_contain_text("Robot at")
        noted = {"name": f"spill {HOSTILE}", "description": "wet"}
        await chat.client.call_tool("write_semantic_data", noted)
        await chat.client.call_tool("look_at_map", {})
        await chat.client.call_tool("navigate_to", {"place": "R1", "wait_s": 0})
        await expect(app.locator("#items")).to_contain_text(f"W1: spill {HOSTILE}")
        await expect(app.locator("#state")).to_contain_text("G1 to R1")
        assert await app.locator("img[src=x]").count() == 0


async def test_a_chat_that_lets_nothing_be_asked_shows_the_tools_own_picture(
    tmp_path: Path,
) -> None:
    async with open_chat(tmp_path) as chat, browse(f"{chat.address}?mute=1") as page:
        app = frame_of(page)
        await expect(app.locator("#picture img")).to_be_visible()


async def test_a_robot_that_is_lost_is_told_and_found_again(tmp_path: Path) -> None:
    class Fickle(FakeRobot):
        is_lost = False

        async def fetch_map(self) -> OccupancyGrid:
            if self.is_lost:
                raise LinkError("The robot does not answer.", hint="Look at its network.")
            return await super().fetch_map()

    robot = Fickle(two_rooms())
    async with open_chat(tmp_path, robot) as chat, browse(chat.address) as page:
        state = frame_of(page).locator("#state")
        await expect(state).to_contain_text("Robot at")
        robot.is_lost = True
        await expect(state).to_contain_text("does not answer")
        robot.is_lost = False
        await expect(state).to_contain_text("Robot at")


async def test_the_map_fits_a_phone(tmp_path: Path) -> None:
    async with open_chat(tmp_path) as chat, browse(chat.address, size=PHONE) as page:
        app = frame_of(page)
        await expect(app.locator("#map img").first).to_be_visible()
        width = await app.locator("html").evaluate("page => page.scrollWidth - page.clientWidth")
        assert width <= 0


async def test_an_exploration_is_shown_in_the_chat(tmp_path: Path) -> None:
    robot = SoloRobot(Simulation(load_world("flat_1"), seed=7), has_detector=True)
    async with open_chat(tmp_path, robot) as chat, browse(chat.address) as page:
        app = frame_of(page)
        for _ in range(4):
            await chat.client.call_tool("navigate_to", {"place": "nearest frontier"})
            await chat.client.call_tool("look_at_map", {})
        await expect(app.locator("#items")).to_contain_text("frontier")
        await app.locator("#index summary").click()
        await app.locator("#items").get_by_role("button", name="frontier").first.click()
        await expect(app.get_by_role("button", name="Go to F")).to_be_visible()
        await app.locator("#index summary").click()
        if KEEP in os.environ:
            shown = {"x": 170, "y": 0, "width": 940, "height": 560}
            await page.screenshot(path=PICTURES / "chat-map.png", clip=shown)
