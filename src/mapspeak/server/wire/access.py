"""Access to an address: the allowed Host and Origin, the token, and where a server listens."""

import ipaddress
import secrets
import socket
from collections.abc import Callable

import uvicorn
from mcp.server.transport_security import TransportSecurityMiddleware, TransportSecuritySettings
from starlette.requests import Request
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Receive, Scope, Send

from mapspeak.errors import ConfigError

HEALTH = "/health"
PUBLIC = ("/", HEALTH)
"""Are answered to anybody."""


class ReadyServer(uvicorn.Server):
    """Says when it answers."""

    def __init__(self, config: uvicorn.Config, on_ready: Callable[[], None]) -> None:
        super().__init__(config)
        self._on_ready = on_ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to answer."""
        await super().startup(sockets)
        self._on_ready()


class HostGuard:
    """Lets only requests through that name this server, before anything is done for them."""

    def __init__(self, app: ASGIApp, security: TransportSecuritySettings) -> None:
        self._app = app
        self._security = TransportSecurityMiddleware(security)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, or answer 421 or 403."""
        if scope["type"] == "http" and scope["path"] != HEALTH:
            refusal = await self._security.validate_request(Request(scope))
            if refusal is not None:
                await refusal(scope, receive, send)
                return
        await self._app(scope, receive, send)


class TokenGuard:
    """Lets only requests through that carry the bearer token."""

    def __init__(self, app: ASGIApp, token: str) -> None:
        self._app = app
        self._token = token.encode()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, or answer 401."""
        if scope["type"] == "http" and not self._is_welcome(scope):
            refusal = PlainTextResponse(
                "A bearer token is needed.", 401, headers={"WWW-Authenticate": "Bearer"}
            )
            await refusal(scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _is_welcome(self, scope: Scope) -> bool:
        # The scheme's name is written in any case (RFC 9110, section 11.1).
        scheme, _, given = dict(scope["headers"]).get(b"authorization", b"").partition(b" ")
        is_bearer = scheme.lower() == b"bearer"
        is_right = secrets.compare_digest(given.strip(), self._token)
        return scope["path"] in PUBLIC or (is_bearer and is_right)


def find_security(host: str, port: int) -> TransportSecuritySettings:
    """Return which Host and Origin headers are let through at an address."""
    if not is_loopback(host):
        # The token guards here; the names by which others reach this machine are unknown.
        return TransportSecuritySettings(enable_dns_rebinding_protection=False)
    names = {host, "localhost", "127.0.0.1", "[::1]"}
    return TransportSecuritySettings(
        enable_dns_rebinding_protection=True,
        allowed_hosts=[f"{name}:{port}" for name in sorted(names)],
        allowed_origins=[f"http://{name}:{port}" for name in sorted(names)],
    )


def parse_address(address: str) -> tuple[str, int]:
    """Return host and port.

    Raises:
        ConfigError: It is no HOST:PORT.
    """
    host, _, port = address.rpartition(":")
    host = host.strip("[]") or "127.0.0.1"
    if not port.isdecimal() or not 0 < int(port) < 65536:
        raise ConfigError(
            f"{address!r} is no address to serve on.", hint="Give HOST:PORT, as 127.0.0.1:8766."
        )
    return host, int(port)


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens there.

    Raises:
        ConfigError: Another program has it, or this machine does not have that address.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as error:
        raise ConfigError(
            f"{host}:{port} cannot be served on: {error.strerror or error}.",
            hint="Choose another port, or end the program that has this one.",
        ) from error


def is_loopback(host: str) -> bool:
    """Return True for an address that only this machine can reach."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
