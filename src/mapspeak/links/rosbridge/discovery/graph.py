"""The topics and actions of a running ROS system, as rosapi lists them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.links.rosbridge.client import RosbridgeClient
from mapspeak.links.rosbridge.messages import Dialect, bare_type

ROSAPI_HINT = (
    "Start rosapi beside rosbridge: the usual launch file does (ROS 2: `ros2 launch "
    "rosbridge_server rosbridge_websocket_launch.xml`, ROS 1: `roslaunch rosbridge_server "
    "rosbridge_websocket.launch`). Without it, name `ros` and the topics in robot.yaml."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotGraph:
    """What is there at one moment.

    Attributes:
        dialect: Which ROS it is.
        distro: Such as "jazzy"; empty where the robot does not say.
        types: The type of each topic, as "package/Type".
        actions: The action servers of ROS 2; ROS 1 shows them as topics only.
    """

    dialect: Dialect
    distro: str = ""
    types: Mapping[str, str] = field(default_factory=dict)
    actions: tuple[str, ...] = ()

    def topics_of(self, *types: str) -> list[str]:
        """Gives the topics of some types, in the order of their names."""
        return sorted(topic for topic, type_name in self.types.items() if type_name in types)


async def fetch_graph(client: RosbridgeClient) -> RobotGraph:
    """Asks rosapi what there is.

    Raises:
        LinkError: rosapi is missing, or gives no usable answer.
    """
    try:
        listed = await client.call_service("/rosapi/topics")
    except LinkError as error:
        raise LinkError(
            f"The robot's rosapi does not list its topics: {error.message}", hint=ROSAPI_HINT
        ) from error
    topics, types = _texts(listed, "topics"), _texts(listed, "types")
    if len(topics) != len(types):
        raise LinkError(
            f"The robot's rosapi lists {len(topics)} topics and {len(types)} types.",
            hint="Restart rosapi on the robot.",
        )
    dialect, distro = await _fetch_version(client, types)
    actions: tuple[str, ...] = ()
    if dialect is Dialect.ROS2:
        actions = await _fetch_actions(client)
    return RobotGraph(
        dialect=dialect,
        distro=distro,
        types={topic: bare_type(name) for topic, name in zip(topics, types, strict=True)},
        actions=actions,
    )


async def _fetch_version(client: RosbridgeClient, types: list[str]) -> tuple[Dialect, str]:
    try:
        answer = await client.call_service("/rosapi/get_ros_version")
    except LinkError:
        # ROS 1 has no such service, nor have early versions of ROS 2: their types tell.
        is_ros2 = any("/msg/" in type_name for type_name in types)
        return (Dialect.ROS2 if is_ros2 else Dialect.ROS1), ""
    return (Dialect.ROS1 if answer.get("version") == 1 else Dialect.ROS2), str(
        answer.get("distro", "")
    )


async def _fetch_actions(client: RosbridgeClient) -> tuple[str, ...]:
    try:
        answer = await client.call_service("/rosapi/action_servers")
    except LinkError:
        return ()
    return tuple(sorted(_texts(answer, "action_servers")))


def _texts(answer: Mapping[str, Any], key: str) -> list[str]:
    values = answer.get(key)
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        raise LinkError(
            f"The robot's rosapi answers without a list of {key}.",
            hint="Restart rosapi on the robot, or check that it is the one of rosbridge_suite.",
        )
    return values
