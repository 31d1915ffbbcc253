"""Any robot that speaks ROS, over any connection: what it offers, its map, its goals."""

from mapspeak.links.ros.discovery import (
    RobotOverrides,
    RobotProfile,
    RosSettings,
    describe_profile,
    load_robot_file,
)
from mapspeak.links.ros.driving import DrivingPatience
from mapspeak.links.ros.environment import environment_with
from mapspeak.links.ros.errors import plain_errors
from mapspeak.links.ros.goal import PursuedGoal
from mapspeak.links.ros.late import NOTICE_S, Announcements, say_again
from mapspeak.links.ros.native import NativeConnection, NativeTopics, check_name, wrong_type
from mapspeak.links.ros.parameters import NodeParameters
from mapspeak.links.ros.robot import RosRobot, build_ros_robot
from mapspeak.links.ros.subscription import TopicSubscription

__all__ = [
    "NOTICE_S",
    "Announcements",
    "DrivingPatience",
    "NativeConnection",
    "NativeTopics",
    "NodeParameters",
    "PursuedGoal",
    "RobotOverrides",
    "RobotProfile",
    "RosRobot",
    "RosSettings",
    "TopicSubscription",
    "build_ros_robot",
    "check_name",
    "describe_profile",
    "environment_with",
    "load_robot_file",
    "plain_errors",
    "say_again",
    "wrong_type",
]
