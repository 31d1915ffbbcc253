"""The tools, one module per toolset."""

from mapspeak.server.tools.ros import require_ros
from mapspeak.server.tools.toolsets import build_toolsets

__all__ = ["build_toolsets", "require_ros"]
