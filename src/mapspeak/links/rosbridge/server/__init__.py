"""Any robot offered as a rosbridge server with rosapi, as ROS 1 or ROS 2 would."""

from mapspeak.links.rosbridge.server.running import run_rosbridge_server
from mapspeak.links.rosbridge.server.serving import RosbridgeServer, open_rosbridge_server

__all__ = ["RosbridgeServer", "open_rosbridge_server", "run_rosbridge_server"]
