"""How a server reaches its clients: stdio, or streaming HTTP with its doors closed by default."""

import logging
import os
import sys
from collections.abc import AsyncIterable, Awaitable, Callable
from functools import partial
from http import HTTPStatus
from io import TextIOWrapper

import anyio
import uvicorn
from anyio.streams.memory import MemoryObjectSendStream
from mcp.server.stdio import stdio_server
from mcp.shared.message import SessionMessage
from mcp_types import INVALID_REQUEST, PARSE_ERROR, ErrorData, JSONRPCError
from pydantic import ValidationError
from starlette.requests import ClientDisconnect
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from mapspeak.errors import ConfigError
from mapspeak.server.app import MapspeakServer
from mapspeak.server.fleet import FleetServer
from mapspeak.server.wire.access import (
    HEALTH,
    HostGuard,
    ReadyServer,
    TokenGuard,
    find_security,
    is_loopback,
    listen,
    parse_address,
)

LISTEN = b"subscriptions/listen"
"""The method by which a client of the newer protocol asks for news."""
HTTP_LOGGERS = ("mcp.server.streamable_http", "uvicorn.error")


async def serve_stdio(server: MapspeakServer | FleetServer) -> None:
    """Serve one client over standard input and output until it hangs up.

    A line that is no message is answered, where the SDK keeps silent. A client that takes no more
    answers has hung up too, though a thread may wait for its next line for ever.
    """
    lowlevel = server._lowlevel_server  # noqa: SLF001 - what `run_stdio_async` runs
    assert isinstance(sys.stdin, TextIOWrapper)  # noqa: S101 - a process's own
    sys.stdin.reconfigure(encoding="utf-8", errors="replace")
    lines = _Lines(sys.stdin)
    try:
        async with stdio_server(lines) as (received, to_send), anyio.create_task_group() as tasks:
            forward, messages = anyio.create_memory_object_stream[SessionMessage | Exception](0)
            tasks.start_soon(_answer_unreadable, received, forward, to_send.send)
            await lowlevel.run(messages, to_send, lowlevel.create_initialization_options())
            tasks.cancel_scope.cancel()
    except* BrokenPipeError:
        _drop_output()


class _Lines(anyio.AsyncFile[str]):
    """A file for whose next line the end does not wait, where the SDK's own does."""

    async def readline(self) -> str:
        """Return the next line; empty at the end of the file."""
        return await anyio.to_thread.run_sync(self.wrapped.readline, abandon_on_cancel=True)


def _drop_output() -> None:
    """Send what is still to be written nowhere, or the interpreter complains when it ends."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


async def _answer_unreadable(
    received: AsyncIterable[SessionMessage | Exception],
    forward: MemoryObjectSendStream[SessionMessage | Exception],
    send: Callable[[SessionMessage], Awaitable[None]],
) -> None:
    async with forward:
        async for each in received:
            if isinstance(each, ValidationError):
                fault = each.errors(include_url=False, include_context=False)[0]
                if not str(fault["input"]).strip():
                    continue
                is_json = fault["type"] != "json_invalid"
                error = ErrorData(
                    code=INVALID_REQUEST if is_json else PARSE_ERROR,
                    message="Not a JSON-RPC message." if is_json else "Not JSON.",
                )
                answer = JSONRPCError(jsonrpc="2.0", id=None, error=error)
                await send(SessionMessage(answer))
            else:
                await forward.send(each)


async def serve_http(
    server: MapspeakServer | FleetServer,
    address: str,
    *,
    token: str | None = None,
    on_ready: Callable[[str], None] = lambda _: None,
) -> None:
    """Serve clients over streaming HTTP at `/mcp`; `/health` answers "ok".

    Once clients are answered, `on_ready` is called with the address to give them.

    Foreign Host and Origin headers are refused. Outside this machine a bearer token is demanded.

    Raises:
        ConfigError: The address is no HOST:PORT, or it is reachable from outside without a token.
    """
    host, port = parse_address(address)
    if token is None and not is_loopback(host):
        raise ConfigError(
            f"{host} can be reached from other machines, and no token is set.",
            hint="Set MAPSPEAK_HTTP_TOKEN, or serve on 127.0.0.1.",
        )
    security = find_security(host, port)
    # Cancellation is lost with json_response or stateless_http: never use either for a robot.
    app = server.streamable_http_app(transport_security=security, host=host)
    app.add_route(HEALTH, _say_ok)
    app.add_route("/", _say_where)
    watched: ASGIApp = HostGuard(HangUpWatch(app, server.note_hang_up), security)
    guarded = watched if token is None else TokenGuard(watched, token)
    config = uvicorn.Config(guarded, log_level="warning")
    for name in HTTP_LOGGERS:
        logging.getLogger(name).addFilter(shorten_disconnect)
    with listen(host, port) as listener:
        shown = f"[{host}]" if ":" in host else host
        tell = partial(on_ready, f"http://{shown}:{port}/mcp")
        await ReadyServer(config, tell).serve(sockets=[listener])


def shorten_disconnect(record: logging.LogRecord) -> bool:
    """Let a client that leaves in the middle of its request cost one line, not a trace."""
    if record.exc_info and isinstance(record.exc_info[1], ClientDisconnect):
        record.msg, record.args, record.exc_info = (
            "A client left before its request ended.",
            (),
            None,
        )
        record.levelno, record.levelname = logging.WARNING, "WARNING"
    return True


class HangUpWatch:
    """Notices a client that is gone before its answer was, or that ends its session.

    A running tool does not learn of it otherwise. Clients are told apart by their session; those of
    a protocol without sessions count as one. Streams of news do not count: a client closes one and
    opens the next as it likes. The lease ends the drives of one that is gone for good.
    """

    def __init__(self, app: ASGIApp, on_hang_up: Callable[[str], Awaitable[None]]) -> None:
        self._app = app
        self._on_hang_up = on_hang_up

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, watching both directions."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = dict(scope["headers"])
        client = headers.get(b"mcp-session-id", b"").decode("latin-1")
        is_call = scope["method"] == "POST" and headers.get(b"mcp-method") != LISTEN
        is_answered = is_ended = False

        async def watch_send(message: Message) -> None:
            nonlocal is_answered, is_ended
            await send(message)
            is_body = message["type"] == "http.response.body"
            is_answered = is_answered or (is_body and not message.get("more_body", False))
            if scope["method"] == "DELETE" and message["type"] == "http.response.start":
                is_ended = message["status"] < HTTPStatus.BAD_REQUEST

        async def watch_receive() -> Message:
            message = await receive()
            if message["type"] == "http.disconnect" and is_call and not is_answered:
                # The stop itself may end the call, and with it this task.
                with anyio.CancelScope(shield=True):
                    await self._on_hang_up(client)
            return message

        await self._app(scope, watch_receive, watch_send)
        if is_ended:
            await self._on_hang_up(client)


async def _say_ok(_request: object) -> PlainTextResponse:
    return PlainTextResponse("ok")


async def _say_where(_request: object) -> PlainTextResponse:
    return PlainTextResponse(
        "This is mapspeak, a robot for language models.\n"
        "MCP clients connect to /mcp on this address (streaming HTTP); /health answers ok.\n"
    )
