"""Robots on ROS 2 over DDS: no ROS here, and nothing but their own nodes on the robot.

Needs the optional packages of mapspeak[dds].
"""

from mapspeak.links.dds.connection import DdsConnection, open_dds_connection, open_dds_robot
from mapspeak.links.dds.participant import DdsNetwork

__all__ = ["DdsConnection", "DdsNetwork", "open_dds_connection", "open_dds_robot"]
