"""The tools that know nothing of robots and everything of ROS: topics, services, actions, nodes."""

from mapspeak.server.tools.ros.inquiry import require_ros
from mapspeak.server.tools.ros.toolset import RosTools

__all__ = ["RosTools", "require_ros"]
