"""Stands in for ROS's ros2service, of which rosapi uses a little and no wheel exists."""
