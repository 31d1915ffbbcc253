"""A robot behind a rosbridge server, for ROS 1 and ROS 2."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager

from mapspeak.links.rosbridge import RobotAddress, Timing, open_client
from mapspeak.ros.discovery import RobotOverrides
from mapspeak.ros.robot import RosRobot, build_ros_robot
from mapspeak.ros.robot.driving import DrivingPatience

USUAL_TIMING = Timing()
USUAL_PATIENCE = DrivingPatience()
NOTHING_SAID = RobotOverrides()


@asynccontextmanager
async def open_rosbridge_robot(
    url: str | RobotAddress,
    *,
    overrides: RobotOverrides = NOTHING_SAID,
    timing: Timing = USUAL_TIMING,
    patience: DrivingPatience = USUAL_PATIENCE,
) -> AsyncGenerator[RosRobot]:
    """Offer the robot behind a rosbridge server while the context lasts.

    Leaving the context does not stop the robot: call `stop` before, where that is wanted.

    Raises:
        LinkError: The robot cannot be reached, or does not say what it offers.
        ConfigError: The address is none.
    """
    address = RobotAddress(url=url) if isinstance(url, str) else url
    async with open_client(address, timing=timing) as client:
        yield await build_ros_robot(
            client, overrides=overrides, patience=patience, frames_s=timing.frames_s
        )
