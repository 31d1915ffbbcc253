"""The tools, one module per toolset."""

from mapspeak.server.tools.toolsets import build_toolsets

__all__ = ["build_toolsets"]
