"""A robot made of a ROS system: its interfaces, its map, its goals, over any connection."""

from mapspeak.ros.robot.rosrobot import NOTHING_SAID, RosRobot, build_ros_robot

__all__ = ["NOTHING_SAID", "RosRobot", "build_ros_robot"]
