"""Robots behind rosbridge: its protocol, a client, and any robot offered as a server."""

from mapspeak.links.rosbridge.client import RobotAddress, quote_address
from mapspeak.links.rosbridge.opening import open_rosbridge_robot

__all__ = ["RobotAddress", "open_rosbridge_robot", "quote_address"]
