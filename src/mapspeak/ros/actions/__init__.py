"""One client for the actions of ROS 1 and ROS 2: goals sent, followed, and ended for certain."""

from mapspeak.ros.actions.client import ActionClient
from mapspeak.ros.actions.opening import open_action

__all__ = ["ActionClient", "open_action"]
