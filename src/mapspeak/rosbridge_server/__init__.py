"""Any robot offered as a rosbridge server with rosapi, as ROS 1 or ROS 2 would.

Of the parts that such a server is made of, those are public with which a ROS can be made that has
no robot behind it: topics, services, types and parameters, served by `serve_system`.
"""

from mapspeak.rosbridge_server.hub import ROSBRIDGE_NODE, Hub, Topic
from mapspeak.rosbridge_server.interfaces import Interfaces, RosSystem
from mapspeak.rosbridge_server.rosapi import Parameters, add_parameter_services, add_rosapi
from mapspeak.rosbridge_server.serving import (
    RosbridgeServer,
    open_rosbridge_server,
    serve_system,
)

__all__ = [
    "ROSBRIDGE_NODE",
    "Hub",
    "Interfaces",
    "Parameters",
    "RosSystem",
    "RosbridgeServer",
    "Topic",
    "add_parameter_services",
    "add_rosapi",
    "open_rosbridge_server",
    "serve_system",
]
