"""The live page's own small web site: files, events, pictures, and a person's commands.

It is served beside the clients, on this machine alone.
"""

import json
from collections.abc import AsyncIterator, Callable, Generator, Mapping
from contextlib import contextmanager
from functools import partial
from http import HTTPStatus
from importlib.resources.abc import Traversable
from typing import Any

import anyio
import uvicorn
from pydantic import ValidationError
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from mapspeak.errors import ConfigError, LinkError, MapspeakError
from mapspeak.server.text.world.maps import say_navigation
from mapspeak.server.view.commands import PersonCommands
from mapspeak.server.view.document import NavigationView
from mapspeak.server.view.feed import ViewFeed
from mapspeak.server.view.keys import NOBODY, PageKeys
from mapspeak.server.view.pages import find_leaflet_files, find_page_files, link_page
from mapspeak.server.wire.access import (
    HostGuard,
    ReadyServer,
    find_security,
    is_loopback,
    listen,
    parse_address,
)

ONLY = "robot"
"""The name of an only robot in addresses."""
TYPES = {".js": "text/javascript", ".css": "text/css", ".png": "image/png"}
POLICY = (
    "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; "
    "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = (
    (b"content-security-policy", POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
)
MOST_BYTES = 2_000
"""Of the body of a command."""
CHECK = "check"
STOPS = frozenset({"stop", "hold"})
FREE = STOPS | {CHECK}
"""Commands without a key: a stop must never wait, and a check moves nothing."""
KEY, NAME_OF_PAGE = "x-mapspeak-key", "x-mapspeak-page"


async def serve_view(
    feeds: Mapping[str, ViewFeed],
    address: str,
    *,
    keys: PageKeys,
    on_ready: Callable[[str], None] = lambda _: None,
) -> None:
    """Serve the live page of some robots until cancelled.

    Args:
        feeds: Of each robot, by its name.
        address: HOST:PORT on this machine.
        keys: The keys that may command.
        on_ready: Called with the page's address once it answers.

    Raises:
        ConfigError: The address is no HOST:PORT of this machine, or it is taken.
    """
    host, port = parse_address(address)
    if not is_loopback(host):
        raise ConfigError(
            f"{host} can be reached from other machines; the live page is for this one.",
            hint="Serve it on 127.0.0.1, and reach it from elsewhere through an SSH tunnel: "
            f"ssh -L {port}:127.0.0.1:{port} ROBOT.",
        )
    site = HostGuard(build_site(feeds, keys), find_security(host, port))
    config = uvicorn.Config(site, log_level="warning", timeout_graceful_shutdown=1, lifespan="off")
    with listen(host, port) as listener:
        shown = f"[{host}]" if ":" in host else host
        page = _PageServer(config, partial(on_ready, f"http://{shown}:{port}/"))
        async with anyio.create_task_group() as tasks:
            for feed in feeds.values():
                tasks.start_soon(feed.watch)
            await page.serve(sockets=[listener])
            tasks.cancel_scope.cancel()


class _PageServer(ReadyServer):
    """Leaves signals to the robot's server, which makes the robot stand first."""

    @contextmanager
    def capture_signals(self) -> Generator[None]:
        """Capture none."""
        yield


def build_site(feeds: Mapping[str, ViewFeed], keys: PageKeys) -> ASGIApp:
    """Return the site for some robots by their names."""
    site = LiveSite(feeds, keys)
    routes = [
        Route("/", site.show_page),
        Route("/page/{file}", site.show_file),
        Route("/leaflet/{file}", site.show_leaflet),
        Route("/robots", site.list_robots),
        Route("/robots/{robot}/events", site.stream),
        Route("/robots/{robot}/tiles/{row:int}/{col:int}/{name}.png", site.show_tile),
        Route("/robots/{robot}/camera", site.show_camera),
        Route("/robots/{robot}/navigation", site.show_navigation),
        Route("/robots/{robot}/calls/{number:int}/{index:int}", site.show_picture),
        Route("/robots/{robot}/questions/{question}", site.show_question),
        Route("/unlock", site.unlock, methods=["POST"]),
        Route("/stop-all", site.stop_all, methods=["POST"]),
        Route("/robots/{robot}/{command}", site.command, methods=["POST"]),
    ]
    return _SafeHeaders(Starlette(routes=routes))


class LiveSite:
    """Answers the requests of pages."""

    def __init__(self, feeds: Mapping[str, ViewFeed], keys: PageKeys) -> None:
        self._feeds = {name or ONLY: feed for name, feed in feeds.items()}
        self._keys = keys

    async def show_page(self, _request: Request) -> Response:
        """Answer with the page."""
        return Response(link_page(), media_type="text/html")

    async def show_file(self, request: Request) -> Response:
        """Answer with a file of the page."""
        return _file(find_page_files(), request.path_params["file"])

    async def show_leaflet(self, request: Request) -> Response:
        """Answer with a file of Leaflet."""
        return _file(find_leaflet_files(), request.path_params["file"])

    async def list_robots(self, _request: Request) -> Response:
        """Answer with the names of the robots."""
        return JSONResponse(list(self._feeds))

    async def stream(self, request: Request) -> Response:
        """Send a page the news, until it leaves."""
        feed = self._find(request)

        async def events() -> AsyncIterator[bytes]:
            async with feed.listen() as heard:
                async for event in heard:
                    yield event

        return StreamingResponse(
            events(), media_type="text/event-stream", headers={"cache-control": "no-store"}
        )

    async def show_tile(self, request: Request) -> Response:
        """Answer with a tile of the map; its name says what it shows, so it may be kept."""
        feed, wanted = self._find(request), request.path_params
        png = await feed.draw(wanted["row"], wanted["col"], wanted["name"])
        if png is None:
            raise HTTPException(HTTPStatus.NOT_FOUND)
        kept = {"cache-control": "private, max-age=3600, immutable"}
        return Response(png, media_type="image/png", headers=kept)

    async def show_camera(self, request: Request) -> Response:
        """Answer with the present camera picture."""
        feed = self._find(request)
        try:
            if not feed.session.robot.description.has_camera:
                raise HTTPException(HTTPStatus.NOT_FOUND, "This robot has no camera.")
            picture = await feed.see(request.query_params.get("camera"))
        except LinkError as error:
            raise HTTPException(HTTPStatus.SERVICE_UNAVAILABLE, str(error)) from error
        fresh = {"cache-control": "no-store"}
        return Response(picture.data, media_type=picture.media_type, headers=fresh)

    async def show_navigation(self, request: Request) -> Response:
        """Answer with what the robot's navigation tells of path, footprint and costmaps."""
        session = self._find(request).session
        try:
            looks = await session.robot.fetch_navigation()
        except LinkError as error:
            raise HTTPException(HTTPStatus.SERVICE_UNAVAILABLE, str(error)) from error
        parts = [NavigationView.of(look).model_dump() for look in looks]
        fresh = {"cache-control": "no-store"}
        return JSONResponse({"said": say_navigation(looks), "parts": parts}, headers=fresh)

    async def show_picture(self, request: Request) -> Response:
        """Answer with a picture that a client was given."""
        numbers = request.path_params["number"], request.path_params["index"]
        found = self._find(request).calls.find_picture(*numbers)
        if found is None:
            raise HTTPException(HTTPStatus.NOT_FOUND, "That picture is no longer kept.")
        return Response(found[0], media_type=found[1])

    async def show_question(self, request: Request) -> Response:
        """Answer with the picture that a waiting question is about."""
        book = self._find(request).book
        waiting = {} if book is None else book.runs.questions.waiting
        question = waiting.get(request.path_params["question"])
        if question is None or (picture := question.picture) is None:
            raise HTTPException(HTTPStatus.NOT_FOUND, "That question waits no longer.")
        return Response(picture.data, media_type=picture.media_type)

    async def unlock(self, request: Request) -> Response:
        """Give a key for the token that the server's terminal shows."""
        body = await _read_body(request)
        typed, name = (str(body.get(key, "")) for key in ("token", "name"))
        key = await self._keys.unlock(typed, name)
        if key is None:
            return _say("That is not the token. A newer one may stand on the terminal.", 403)
        return JSONResponse({"key": key})

    async def command(self, request: Request) -> Response:
        """Carry out a person's command, and return its result."""
        feed, name = self._find(request), request.path_params["command"]
        person = self._keys.find_name(request.headers.get(KEY, ""))
        if name not in FREE and person is None:
            return _say("Unlock the page first, with the token on the server's terminal.", 403)
        commands = PersonCommands(feed, person or NOBODY)
        if name not in commands.by_name:
            raise HTTPException(HTTPStatus.NOT_FOUND)
        try:
            # A stop takes no arguments, and is not refused for wrong ones.
            body = {} if name in STOPS else await _read_body(request)
            said = await commands.carry_out(name, body)
        except ValidationError as error:
            return _say(f"Not understood: {error.errors(include_url=False)[0]['msg']}.", 422)
        except MapspeakError as error:
            return _say(str(error), 409)
        if name != CHECK:
            feed.tell_word(f"{person or NOBODY}: {said}", page=_name_page(request))
        return _say(said, 200)

    async def stop_all(self, request: Request) -> Response:
        """Stop every robot at once: one that does not answer holds up none of the others."""
        person = self._keys.find_name(request.headers.get(KEY, "")) or NOBODY
        said: dict[str, str] = {}

        async def stop(name: str, feed: ViewFeed) -> None:
            try:
                said[name] = await PersonCommands(feed, person).carry_out("stop", {})
            except MapspeakError as error:
                said[name] = str(error)
            feed.tell_word(f"{person}: {said[name]}", page=_name_page(request))

        async with anyio.create_task_group() as tasks:
            for name, feed in self._feeds.items():
                tasks.start_soon(stop, name, feed)
        text = " ".join(f"{name}: {said[name]}" for name in self._feeds)
        return _say(text, 409 if "NOT STOPPED" in text else 200)

    def _find(self, request: Request) -> ViewFeed:
        feed = self._feeds.get(request.path_params["robot"])
        if feed is None:
            raise HTTPException(HTTPStatus.NOT_FOUND, "There is no such robot.")
        return feed


def _name_page(request: Request) -> str:
    """Return a page's own id, so that it is not told of its own commands."""
    return request.headers.get(NAME_OF_PAGE, "")[:40]


def _file(folder: Traversable, name: str) -> Response:
    suffix = name[name.rfind(".") :]
    path = folder.joinpath(name)
    if suffix not in TYPES or "/" in name or not path.is_file():
        raise HTTPException(HTTPStatus.NOT_FOUND)
    return Response(path.read_bytes(), media_type=TYPES[suffix])


async def _read_body(request: Request) -> dict[str, Any]:
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > MOST_BYTES:
            raise HTTPException(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
    try:
        read = json.loads(body or b"{}")
    except ValueError:
        read = None
    if not isinstance(read, dict):
        raise HTTPException(HTTPStatus.BAD_REQUEST, "Not a JSON object.")
    return read


def _say(text: str, status: int) -> Response:
    return PlainTextResponse(text, status)


class _SafeHeaders:
    """Lets no other page hold, frame or run anything of this one."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, and add to the answer's headers."""
        has_begun = False

        async def send_safely(message: Message) -> None:
            nonlocal has_begun
            if message["type"] == "http.response.start":
                has_begun = True
                message = {**message, "headers": [*message["headers"], *HEADERS]}
            await send(message)

        try:
            await self._app(scope, receive, send_safely)
        except anyio.get_cancelled_exc_class():
            # The server ends: the web server would fill the terminal with what each page waits for.
            if not has_begun:
                await _say("The server ends.", 503)(scope, receive, send_safely)
