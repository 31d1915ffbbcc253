"""A served robot with its live page, for tests: the page's server, its client, its token."""

import json
import socket
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Coroutine, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import anyio
import httpx2
from mcp.client import Client

from fakes import FakeRobot, two_rooms
from guarding import make_guard
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import Robot
from mapspeak.safety import Guard
from mapspeak.server.app import DEFAULT_TOOLSETS, build_server
from mapspeak.server.view.calls import CallFeed
from mapspeak.server.view.feed import ViewFeed
from mapspeak.server.view.keys import PageKeys
from mapspeak.server.view.site import serve_view
from mapspeak.session import Session

PATIENCE_S = 120.0


@dataclass
class Live:
    """A live page that is served, and the client whose robot it shows.

    Attributes:
        address: Of the page.
        tokens: As they were printed.
        keys: The headers of who has unlocked the page.
    """

    http: httpx2.AsyncClient
    client: Client
    session: Session
    robot: Any
    address: str
    tokens: list[str]
    keys: dict[str, str] = field(default_factory=dict)

    async def command(self, name: str, /, **body: object) -> httpx2.Response:
        return await self.http.post(f"/robots/robot/{name}", json=body, headers=self.keys)

    async def unlock(self, name: str = "") -> None:
        body = {"token": self.tokens[-1], "name": name}
        answer = await self.http.post("/unlock", json=body)
        self.keys = {"x-mapspeak-key": answer.json()["key"]}

    @asynccontextmanager
    async def hear(self) -> AsyncGenerator[AsyncIterator[tuple[str, Any]]]:
        async with self.http.stream("GET", "/robots/robot/events") as answer:
            yield _read_events(answer)

    async def wait_for(self, kind: str, having: str = "") -> Any:  # noqa: ANN401 - JSON
        """Return what is told first of a kind, or first with something in a field."""
        async with self.hear() as events:
            data = await next_of(events, kind)
            while having and not data[having]:
                data = await next_of(events, kind)
            return data


@asynccontextmanager
async def serve_page(
    feeds: Mapping[str, ViewFeed], keys: PageKeys, *work: Callable[[], Coroutine[Any, Any, None]]
) -> AsyncGenerator[str]:
    """Serve the page of some robots while other work goes on; give its address."""
    address, is_ready = find_free_address(), anyio.Event()

    async def serve() -> None:
        def tell(_address: str) -> None:
            is_ready.set()

        await serve_view(feeds, address, keys=keys, on_ready=tell)

    async with anyio.create_task_group() as tasks:
        for each in (serve, *work):
            tasks.start_soon(each)
        await is_ready.wait()
        yield f"http://{address}"
        tasks.cancel_scope.cancel()


async def _read_events(answer: httpx2.Response) -> AsyncIterator[tuple[str, Any]]:
    kind = ""
    async for line in answer.aiter_lines():
        name, _, rest = line.partition(": ")
        if name == "event":
            kind = rest
        elif name == "data":
            yield kind, json.loads(rest)


async def next_of(events: AsyncIterator[tuple[str, Any]], kind: str) -> Any:  # noqa: ANN401 - JSON
    async for heard, data in events:
        if heard == kind:
            return data
    raise AssertionError(f"the events ended before {kind}")


def find_free_address() -> str:
    """Return an address on this machine that nobody has."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        return f"127.0.0.1:{free.getsockname()[1]}"


@asynccontextmanager
async def serve_live(
    folder: Path,
    robot: Robot | None = None,
    *,
    guard: Guard | None = None,
    toolsets: tuple[str, ...] = DEFAULT_TOOLSETS,
    session_type: type[Session] = Session,
) -> AsyncGenerator[Live]:
    """Serve a robot to a client, and its live page."""
    robot = robot or FakeRobot(two_rooms())
    guard = guard or make_guard(folder)
    store = SemanticMapStore(folder / "m.yaml", map_id="two-rooms")
    session = session_type(robot, store, lease_s=60.0, guard=guard, find_model=lambda: None)
    calls, tokens = CallFeed(), list[str]()
    server = build_server(session, toolsets=toolsets, call_log=calls)
    feed = ViewFeed(session, calls, server.book)
    with anyio.fail_after(PATIENCE_S):
        async with (
            serve_page(
                {"": feed}, PageKeys(tokens.append, wrong_s=0.0), server.keep_skills
            ) as address,
            Client(server) as client,
            httpx2.AsyncClient(base_url=address, timeout=PATIENCE_S) as http,
        ):
            yield Live(http, client, session, robot, f"{address}/", tokens)
