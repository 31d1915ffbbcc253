"""Robots behind rosbridge: its messages, a client, and any robot offered as a server."""

from mapspeak.links.rosbridge.client import RobotAddress
from mapspeak.links.rosbridge.discovery import (
    RobotOverrides,
    RobotProfile,
    describe_profile,
    load_robot_file,
)
from mapspeak.links.rosbridge.link import RosbridgeRobot, open_rosbridge_robot
from mapspeak.links.rosbridge.poses import describe_pose_source

__all__ = [
    "RobotAddress",
    "RobotOverrides",
    "RobotProfile",
    "RosbridgeRobot",
    "describe_pose_source",
    "describe_profile",
    "load_robot_file",
    "open_rosbridge_robot",
]
