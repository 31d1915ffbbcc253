"""Any robot offered as a rosbridge server with rosapi, as ROS 1 or ROS 2 would.

Of the parts that such a server is made of, those are public with which a ROS can be made that has
no robot behind it: topics, services, types and parameters, served by `serve_system`.
"""

from mapspeak.links.rosbridge.server.hub import ROSBRIDGE_NODE, Hub, Topic
from mapspeak.links.rosbridge.server.interfaces import Interfaces
from mapspeak.links.rosbridge.server.parameters import Parameters, add_parameter_services
from mapspeak.links.rosbridge.server.rosapi import add_rosapi
from mapspeak.links.rosbridge.server.running import run_rosbridge_server
from mapspeak.links.rosbridge.server.services import Service
from mapspeak.links.rosbridge.server.serving import (
    RosbridgeServer,
    open_rosbridge_server,
    serve_system,
)
from mapspeak.links.rosbridge.server.system import RosSystem

__all__ = [
    "ROSBRIDGE_NODE",
    "Hub",
    "Interfaces",
    "Parameters",
    "RosSystem",
    "RosbridgeServer",
    "Service",
    "Topic",
    "add_parameter_services",
    "add_rosapi",
    "open_rosbridge_server",
    "run_rosbridge_server",
    "serve_system",
]
