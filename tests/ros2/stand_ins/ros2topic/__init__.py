"""Stands in for ROS's ros2topic, of which rosapi uses a little and no wheel exists."""
