"""A robot in a DDS domain."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager

from mapspeak.links.dds.connection import open_dds_connection
from mapspeak.links.dds.network import DdsNetwork
from mapspeak.links.dds.timing import DdsTiming
from mapspeak.ros.discovery import RobotOverrides
from mapspeak.ros.driving import DrivingPatience
from mapspeak.ros.robot import RosRobot, build_ros_robot

USUAL_TIMING = DdsTiming()
USUAL_PATIENCE = DrivingPatience()
NOTHING_SAID = RobotOverrides()


@asynccontextmanager
async def open_dds_robot(
    network: DdsNetwork,
    *,
    overrides: RobotOverrides = NOTHING_SAID,
    timing: DdsTiming = USUAL_TIMING,
    patience: DrivingPatience = USUAL_PATIENCE,
) -> AsyncGenerator[RosRobot]:
    """Offers the ROS 2 robot in a DDS domain while the context lasts.

    Leaving the context does not stop the robot: call `stop` before, where that is wanted.

    Args:
        network: Which domain, and how others in it are found.
        overrides: What robot.yaml says.
        timing: Time limits of the connection.
        patience: Time limits of navigation.

    Raises:
        LinkError: No robot is found there, or it does not say what it offers.
    """
    async with open_dds_connection(network, timing=timing) as connection:
        yield await build_ros_robot(connection, overrides=overrides, patience=patience)
