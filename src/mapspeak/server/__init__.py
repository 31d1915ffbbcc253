"""The MCP surface."""

from mapspeak.server.app import DEFAULT_TOOLSETS, MapspeakServer, build_server
from mapspeak.server.calllog import CallLog
from mapspeak.server.fleet import FleetServer
from mapspeak.server.mapview.representations import Representation
from mapspeak.server.transport import serve_http, serve_stdio

__all__ = [
    "DEFAULT_TOOLSETS",
    "CallLog",
    "FleetServer",
    "MapspeakServer",
    "Representation",
    "build_server",
    "serve_http",
    "serve_stdio",
]
