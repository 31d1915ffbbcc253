"""Stands in for ROS's ros2param, of which rosapi uses a little and no wheel exists."""
