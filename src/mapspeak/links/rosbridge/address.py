"""The address of a rosbridge, and the credentials that it asks for."""

import re
import ssl
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from urllib.parse import parse_qsl, urlencode, urlsplit

from websockets.exceptions import InvalidURI
from websockets.uri import WebSocketURI, parse_uri

from mapspeak.errors import ConfigError, say_cause
from mapspeak.ros.port import LinkKind, LinkName

DEFAULT_PORT = 9090
SECRET_KEY = re.compile("token|key|auth|pass|secret|sig", re.IGNORECASE)
"""Parts of a query that change without naming another robot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotAddress:
    """A rosbridge server.

    Attributes:
        url: ws://host:9090 or wss://host:9090; the default port is 9090.
        headers: Sent with the first request, such as {"Authorization": "Bearer ..."}.
        token: Given in rosbridge's own `auth` operation, for servers that want it.
        ca_file: Whose certificates a wss server may show; None trusts the system's.

    Raises:
        ConfigError: The URL is invalid, or there is no such file.
    """

    url: str = field(repr=False)
    headers: dict[str, str] = field(default_factory=dict, repr=False)
    token: str | None = field(default=None, repr=False)
    ca_file: Path | None = None

    def __post_init__(self) -> None:
        uri = _parse(self.url)
        object.__setattr__(self, "url", _with_port(self.url))
        if self.ca_file is not None and not uri.secure:
            raise ConfigError(
                f"{self.shown} is not encrypted, so that a CA file says nothing.",
                hint="Write wss:// for a server with a certificate, or leave the CA file away.",
            )

    @property
    def uri(self) -> WebSocketURI:
        """The URL in parts."""
        return _parse(self.url)

    @property
    def link(self) -> LinkName:
        """The name of a connection to it."""
        return LinkName(LinkKind.ROSBRIDGE, self.shown)

    @property
    def shown(self) -> str:
        """The URL as it may be shown and stored: without user, password and token.

        A path or an id may hold a token too: a digest tells robots behind one gateway apart.
        """
        uri = self.uri
        host = f"[{uri.host}]" if ":" in uri.host else uri.host
        pairs = [pair for pair in parse_qsl(uri.query) if not SECRET_KEY.search(pair[0])]
        resource = f"{uri.path.rstrip('/')}?{urlencode(pairs)}"
        digest = "" if resource == "?" else f"/~{sha256(resource.encode()).hexdigest()[:8]}"
        return f"{'wss' if uri.secure else 'ws'}://{host}:{uri.port}{digest}"

    def build_ssl_context(self) -> ssl.SSLContext | None:
        """Return the TLS context that verifies a wss server; None for ws.

        Raises:
            ConfigError: The CA file cannot be read.
        """
        if not self.uri.secure:
            return None
        try:
            return ssl.create_default_context(cafile=self.ca_file)
        except (OSError, ssl.SSLError) as error:
            raise ConfigError(
                f"The CA file {self.ca_file} cannot be used: {say_cause(error)}.",
                hint="Give a PEM file with the certificate that signed the robot's.",
            ) from error


def quote_address(text: str) -> str:
    """Return the given address in quotes, unless a part of it may be a secret."""
    return "What was given" if {"@", "?", "#"} & set(text) else repr(text[:80])


def _parse(url: str) -> WebSocketURI:
    try:
        return parse_uri(url)
    except (InvalidURI, ValueError) as error:
        raise ConfigError(
            f"{quote_address(url)} is not the address of a rosbridge server.",
            hint="It looks like ws://192.168.1.20:9090, ws://[fe80::1]:9090 or wss://robot:9090.",
        ) from error


def _with_port(url: str) -> str:
    parts = urlsplit(url)
    if parts.port is not None:
        return url
    return parts._replace(netloc=f"{parts.netloc.rstrip(':')}:{DEFAULT_PORT}").geturl()
