"""Robots on ROS 2 through rclpy, with no rosbridge: mapspeak is one more node.

Needs a Python that has rclpy: that of a sourced ROS, or one with ROS's wheels.
"""

from mapspeak.links.rclpy.opening import open_ros2_connection, open_ros2_robot

__all__ = ["open_ros2_connection", "open_ros2_robot"]
