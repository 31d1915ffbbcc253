"""One robot's rosbridge, kept connected: two sockets, calls matched by id, topics latest first."""

from mapspeak.links.rosbridge.client.address import RobotAddress, quote_address
from mapspeak.links.rosbridge.client.client import RosbridgeClient, open_client
from mapspeak.links.rosbridge.client.timing import Timing

__all__ = [
    "RobotAddress",
    "RosbridgeClient",
    "Timing",
    "open_client",
    "quote_address",
]
