"""What a robot offers, found by asking it, and overridden where a person knows better."""

from mapspeak.ros.discovery.overrides import (
    RobotOverrides,
    RosSettings,
    load_robot_file,
)
from mapspeak.ros.discovery.profile import (
    NavigationKind,
    PoseSource,
    RobotProfile,
    choose_profile,
)
from mapspeak.ros.discovery.watch import FRAMES_S, RobotWatch

__all__ = [
    "FRAMES_S",
    "NavigationKind",
    "PoseSource",
    "RobotOverrides",
    "RobotProfile",
    "RobotWatch",
    "RosSettings",
    "choose_profile",
    "load_robot_file",
]
