"""A robot on ROS 2, through rclpy; nothing here needs that before a robot is opened."""

from collections.abc import AsyncGenerator, Mapping
from contextlib import asynccontextmanager
from types import MappingProxyType

from mapspeak.errors import ConfigError
from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.link import USUAL_PATIENCE, Patience
from mapspeak.ros.port import RosConnection
from mapspeak.ros.robot import NOTHING_SAID, RosRobot, build_ros_robot

NO_VARIABLES: Mapping[str, str] = MappingProxyType({})
HINT = (
    "Source ROS 2 (`source /opt/ros/$ROS_DISTRO/setup.sh`) and start mapspeak with its Python, or "
    "install ROS's wheels in an environment of their own on Python 3.12: see "
    "docs/howto/connect-without-rosbridge.md. `--robot dds` needs no ROS on this machine."
)


@asynccontextmanager
async def open_ros2_connection(
    *,
    domain_id: int | None = None,
    distro: str = "",
    variables: Mapping[str, str] = NO_VARIABLES,
    patience: Patience = USUAL_PATIENCE,
) -> AsyncGenerator[RosConnection]:
    """Keep a node of ours in a ROS 2 domain while the context lasts.

    Args:
        domain_id: As in ROS_DOMAIN_ID; None takes that variable's value.
        distro: Such as "jazzy"; empty where that is unknown.
        variables: Override those of the environment while the domain is entered.

    Raises:
        ConfigError: This Python has no rclpy.
        LinkError: ROS cannot be started.
    """
    try:
        from mapspeak.links.rclpy.connection import open_connection  # noqa: PLC0415 - needs rclpy
    except ImportError as error:
        # Without its libraries rclpy fails as if it were not there, and says which one is missing.
        raise ConfigError(f"This Python has no rclpy: {error}.", hint=HINT) from error
    async with open_connection(
        domain_id=domain_id, distro=distro, variables=variables, patience=patience
    ) as connection:
        yield connection


@asynccontextmanager
async def open_ros2_robot(
    *,
    domain_id: int | None = None,
    distro: str = "",
    variables: Mapping[str, str] = NO_VARIABLES,
    overrides: RobotOverrides = NOTHING_SAID,
    patience: Patience = USUAL_PATIENCE,
) -> AsyncGenerator[RosRobot]:
    """Offer the robot in a ROS 2 domain while the context lasts.

    Leaving the context does not stop the robot: call `stop` before, where that is wanted.

    The first arguments are those of `open_ros2_connection`.

    Raises:
        ConfigError: This Python has no rclpy.
        LinkError: ROS cannot be started, or no robot is found there.
    """
    async with open_ros2_connection(
        domain_id=domain_id, distro=distro, variables=variables, patience=patience
    ) as connection:
        if connection.connected_for_s is None:
            await connection.wait_until_connected()
        yield await build_ros_robot(connection, overrides=overrides)
