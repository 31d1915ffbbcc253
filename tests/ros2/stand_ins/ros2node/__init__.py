"""Stands in for ROS's ros2node, of which rosapi uses a little and no wheel exists."""
