"""What a robot offers, found by asking it, and overridden where a person knows better."""

from mapspeak.links.ros.discovery.finding import FRAMES_S, discover_robot, look_at_robot
from mapspeak.links.ros.discovery.findings import describe_profile
from mapspeak.links.ros.discovery.overrides import (
    RobotOverrides,
    RosSettings,
    load_robot_file,
)
from mapspeak.links.ros.discovery.profile import (
    NavigationKind,
    PoseSource,
    RobotProfile,
    choose_profile,
)

__all__ = [
    "FRAMES_S",
    "NavigationKind",
    "PoseSource",
    "RobotOverrides",
    "RobotProfile",
    "RosSettings",
    "choose_profile",
    "describe_profile",
    "discover_robot",
    "load_robot_file",
    "look_at_robot",
]
