"""Robots behind rosbridge: its protocol, and a client that keeps one robot connected."""

from mapspeak.links.rosbridge.address import RobotAddress, quote_address
from mapspeak.links.rosbridge.client import RosbridgeClient, open_client, open_rosbridge_robot

__all__ = [
    "RobotAddress",
    "RosbridgeClient",
    "open_client",
    "open_rosbridge_robot",
    "quote_address",
]
