# ROS 2 Jazzy with what the simulated TurtleBot 3 needs; used for the robot and for rosbridge.
FROM ros:jazzy-ros-base
RUN apt-get update \
    && apt-get install --yes --no-install-recommends \
        ros-jazzy-nav2-bringup \
        ros-jazzy-nav2-minimal-tb3-sim \
        ros-jazzy-navigation2 \
        ros-jazzy-rosbridge-suite \
        ros-jazzy-slam-toolbox \
    && rm -rf /var/lib/apt/lists/*
