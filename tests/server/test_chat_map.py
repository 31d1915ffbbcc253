"""The map in a chat (MCP Apps): what clients that show pages are offered, and others are not."""

from pathlib import Path

import pytest
from mcp.client import Client
from mcp.client.extension import advertise
from mcp.server.apps import APP_MIME_TYPE, EXTENSION_ID

from fakes import FakeRobot, two_rooms
from mapspeak.memory import SemanticMapStore
from mapspeak.server.app import MapspeakServer, build_server
from mapspeak.server.fleet import FleetServer
from mapspeak.server.view.chat import URI
from mapspeak.server.wire.calllog import CallLog
from mapspeak.session import Session

pytestmark = pytest.mark.anyio

APPS = advertise(EXTENSION_ID, {"mimeTypes": [APP_MIME_TYPE]})
MODES = pytest.mark.parametrize("mode", ["auto", "legacy"])


def build(folder: Path, name: str = "m", **options: object) -> MapspeakServer:
    store = SemanticMapStore(folder / f"{name}.yaml", map_id="two-rooms")
    session = Session(FakeRobot(two_rooms()), store, lease_s=60.0, find_model=lambda: None)
    return build_server(session, **options)  # type: ignore[arg-type]  # options of build_server


@MODES
async def test_a_client_that_shows_pages_finds_the_one_of_the_map(
    tmp_path: Path, mode: str
) -> None:
    async with Client(build(tmp_path), mode=mode, extensions=[APPS]) as client:
        tools = {tool.name: tool for tool in (await client.list_tools()).tools}
        page = (await client.read_resource(URI)).contents[0]
    assert (tools["look_at_map"].meta or {})["ui"] == {"resourceUri": URI}
    assert (tools["view_map"].meta or {})["ui"]["visibility"] == ["app"]
    assert page.mime_type == APP_MIME_TYPE
    text = page.text  # type: ignore[union-attr]  # HTML
    assert text.startswith("<!doctype html>")
    head = text.partition("<style>")[0]
    assert "src=" not in head
    assert len(text) <= 400_000


@MODES
async def test_other_clients_see_what_they_saw(tmp_path: Path, mode: str) -> None:
    async with Client(build(tmp_path), mode=mode) as client:
        tools = {tool.name: tool for tool in (await client.list_tools()).tools}
    assert "view_map" not in tools
    assert "ui" not in (tools["look_at_map"].meta or {})


async def test_without_the_tool_there_is_no_page(tmp_path: Path) -> None:
    server = build(tmp_path, toolsets=("drive",))
    async with Client(server, extensions=[APPS]) as client:
        names = {tool.name for tool in (await client.list_tools()).tools}
    assert "view_map" not in names


async def test_a_page_is_sent_only_the_tiles_that_it_has_not(tmp_path: Path) -> None:
    async with Client(build(tmp_path), extensions=[APPS]) as client:
        await client.call_tool("look_at_map", {})
        first = (await client.call_tool("view_map", {})).structured_content
        assert first is not None
        known = list(first["map"]["pictures"])
        again = (await client.call_tool("view_map", {"known": known})).structured_content
        wrong = await client.call_tool("view_map", {"known": "all"})
    assert again is not None
    assert len(known) == 1
    assert again["map"]["pictures"] == {}
    assert {region["id"] for region in first["overlay"]["regions"]} == {"R1", "R2"}
    assert first["robot"]["pose"]["x"] == 1.5
    assert wrong.is_error


async def test_a_page_that_looks_is_no_call_of_a_model(tmp_path: Path) -> None:
    log = CallLog(tmp_path / "calls.jsonl")
    async with Client(build(tmp_path, call_log=log), extensions=[APPS]) as client:
        await client.call_tool("view_map", {})
    assert log.path.read_text() == ""


async def test_with_several_robots_a_page_asks_for_the_one_it_shows(tmp_path: Path) -> None:
    fleet = FleetServer({name: build(tmp_path, name) for name in ("hall", "yard")})
    async with Client(fleet, extensions=[APPS]) as client:
        tools = {tool.name: tool for tool in (await client.list_tools()).tools}
        shown = await client.call_tool("view_map", {"robot": "yard"})
        page = (await client.read_resource(URI)).contents[0]
    assert tools["view_map"].input_schema["properties"]["robot"]["enum"] == ["hall", "yard"]
    assert not shown.is_error
    assert page.mime_type == APP_MIME_TYPE
