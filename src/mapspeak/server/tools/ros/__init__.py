"""The toolset `ros`: every verb of ROS, over any connection to it."""
