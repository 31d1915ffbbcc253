"""What a robot offers, found by asking it, and overridden where a person knows better."""

from mapspeak.links.rosbridge.discovery.finding import discover_robot, look_at_robot
from mapspeak.links.rosbridge.discovery.findings import describe_profile
from mapspeak.links.rosbridge.discovery.graph import RobotGraph, fetch_graph
from mapspeak.links.rosbridge.discovery.overrides import RobotOverrides, load_robot_file
from mapspeak.links.rosbridge.discovery.profile import (
    NavigationKind,
    PoseSource,
    RobotProfile,
    choose_profile,
)

__all__ = [
    "NavigationKind",
    "PoseSource",
    "RobotGraph",
    "RobotOverrides",
    "RobotProfile",
    "choose_profile",
    "describe_profile",
    "discover_robot",
    "fetch_graph",
    "load_robot_file",
    "look_at_robot",
]
