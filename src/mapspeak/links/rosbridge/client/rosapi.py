"""What a robot is made of, as its rosapi tells: the part of the port that only asks."""

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.links.ros import NodeParameters
from mapspeak.links.rosbridge.client.definitions import DefinitionKeeper
from mapspeak.ros import NodeLinks, RosGraph
from mapspeak.ros.messages import Dialect, bare_type, read_stamp

ROSAPI_HINT = (
    "Start rosapi beside rosbridge: the usual launch file does (ROS 2: `ros2 launch "
    "rosbridge_server rosbridge_websocket_launch.xml`, ROS 1: `roslaunch rosbridge_server "
    "rosbridge_websocket.launch`). Without it, name `ros` and the topics in robot.yaml."
)


class Rosapi(ABC):
    """Asks rosapi, by whatever way services are called.

    Some of its services end or hang it on ROS 2 (message_details, get_param_names): these are
    never called there.
    """

    def __init__(self) -> None:
        self._version: tuple[Dialect, str] | None = None
        self._definitions = DefinitionKeeper(self.call_service)
        self._parameters = NodeParameters(self)

    @abstractmethod
    async def call_service(
        self,
        service: str,
        arguments: Mapping[str, Any] | None = None,
        *,
        type_name: str | None = None,
        timeout_s: float | None = None,
    ) -> dict[str, Any]:
        """Gives what a service answers."""

    async def fetch_graph(self) -> RosGraph:
        """Gives the topics and actions there are.

        Raises:
            LinkError: rosapi is missing, or gives no usable answer.
        """
        listed = await self._list_topics()
        dialect, distro = await self._fetch_version(list(listed.values()))
        actions: tuple[str, ...] = ()
        if dialect is Dialect.ROS2:
            actions = await self._fetch_actions()
        return RosGraph(
            dialect=dialect,
            distro=distro,
            types={topic: bare_type(name) for topic, name in listed.items()},
            actions=actions,
        )

    async def fetch_topics(self) -> Mapping[str, str]:
        """Gives the type of each topic."""
        listed = await self._list_topics()
        return {topic: bare_type(name) for topic, name in listed.items()}

    async def _list_topics(self) -> dict[str, str]:
        """Gives the type of each topic, as rosapi writes it."""
        try:
            listed = await self.call_service("/rosapi/topics")
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
        return dict(zip(topics, types, strict=True))

    async def fetch_time_s(self) -> float | None:
        """Gives robot time; None where rosapi does not say."""
        try:
            stamp = (await self.call_service("/rosapi/get_time")).get("time")
            return read_stamp(stamp if isinstance(stamp, dict) else {})
        except LinkError:
            return None

    async def fetch_nodes(self) -> tuple[str, ...]:
        """Gives the full names of all nodes."""
        return tuple(sorted(_texts(await self.call_service("/rosapi/nodes"), "nodes")))

    async def fetch_node(self, node: str) -> NodeLinks:
        """Gives what a node publishes, subscribes to and serves."""
        answer = await self.call_service("/rosapi/node_details", {"node": node})
        return NodeLinks(
            publishes=tuple(sorted(_texts(answer, "publishing"))),
            subscribes=tuple(sorted(_texts(answer, "subscribing"))),
            serves=tuple(sorted(_texts(answer, "services"))),
        )

    async def fetch_publishers(self, topic: str) -> tuple[str, ...]:
        """Gives the nodes that publish on a topic."""
        answer = await self.call_service("/rosapi/publishers", {"topic": topic})
        return tuple(sorted(_texts(answer, "publishers")))

    async def fetch_subscribers(self, topic: str) -> tuple[str, ...]:
        """Gives the nodes that listen to a topic."""
        answer = await self.call_service("/rosapi/subscribers", {"topic": topic})
        return tuple(sorted(_texts(answer, "subscribers")))

    async def fetch_services(self) -> tuple[str, ...]:
        """Gives the full names of all services."""
        return tuple(sorted(_texts(await self.call_service("/rosapi/services"), "services")))

    async def fetch_service_type(self, service: str) -> str:
        """Gives a service's type."""
        answer = await self.call_service("/rosapi/service_type", {"service": service})
        return _type_of(answer, service)

    async def fetch_action_type(self, action: str) -> str:
        """Gives an action's type: by rosapi on ROS 2, by its topics on ROS 1."""
        if await self._fetch_dialect() is Dialect.ROS1:
            answer = await self.call_service("/rosapi/topic_type", {"topic": f"{action}/goal"})
            return _type_of(answer, action).removesuffix("ActionGoal")
        # Only versions after 2.1 have that service.
        answer = await self.call_service("/rosapi/action_type", {"action": action})
        return _type_of(answer, action)

    async def fetch_definitions(self, type_name: str) -> Mapping[str, str]:
        """Gives the .msg texts of a type and of all within it: the robot's, else our own."""
        dialect = await self._fetch_dialect()
        distro = "" if self._version is None else self._version[1]
        return await self._definitions.fetch(type_name, dialect=dialect, distro=distro)

    async def fetch_parameter_names(self, node: str) -> tuple[str, ...]:
        """Gives the names of a node's parameters."""
        if await self._fetch_dialect() is Dialect.ROS2:
            return await self._parameters.fetch_names(node)
        names = _texts(await self.call_service("/rosapi/get_param_names"), "names")
        below = f"{node.rstrip('/')}/"
        return tuple(sorted(name.removeprefix(below) for name in names if name.startswith(below)))

    async def fetch_parameter(self, node: str, name: str) -> Any:  # noqa: ANN401 - any value
        """Gives the value of a node's parameter; None where it is not set."""
        if await self._fetch_dialect() is Dialect.ROS2:
            return await self._parameters.fetch(node, name)
        full = f"{node.rstrip('/')}/{name}"
        answer = await self.call_service("/rosapi/get_param", {"name": full, "default": "null"})
        try:
            return json.loads(answer.get("value") or "null")
        except (TypeError, ValueError) as error:
            raise LinkError(
                f"rosapi gives {full} as something that is no JSON.",
                hint="Read it on the robot: `rosparam get`.",
            ) from error

    async def set_parameter(self, node: str, name: str, value: Any) -> None:  # noqa: ANN401
        """Sets a node's parameter; None deletes it."""
        if await self._fetch_dialect() is Dialect.ROS2:
            await self._parameters.put(node, name, value)
            return
        full = f"{node.rstrip('/')}/{name}"
        if value is None:
            await self.call_service("/rosapi/delete_param", {"name": full})
            return
        await self.call_service("/rosapi/set_param", {"name": full, "value": json.dumps(value)})

    async def _fetch_dialect(self) -> Dialect:
        if self._version is None:
            return (await self.fetch_graph()).dialect
        return self._version[0]

    async def _fetch_version(self, types: list[str]) -> tuple[Dialect, str]:
        """Gives which ROS it is; that is asked once, for it does not change."""
        if self._version is None:
            version = await self._ask_version(types)
            if not types:
                return version
            self._version = version
        return self._version

    async def _ask_version(self, types: list[str]) -> tuple[Dialect, str]:
        try:
            answer = await self.call_service("/rosapi/get_ros_version")
        except LinkError:
            # ROS 1 has no such service, nor have early versions of ROS 2: their types tell.
            is_ros2 = any("/msg/" in type_name for type_name in types)
            return (Dialect.ROS2 if is_ros2 else Dialect.ROS1), ""
        return (Dialect.ROS1 if answer.get("version") == 1 else Dialect.ROS2), str(
            answer.get("distro", "")
        )

    async def _fetch_actions(self) -> tuple[str, ...]:
        try:
            answer = await self.call_service("/rosapi/action_servers")
        except LinkError:
            return ()
        return tuple(sorted(_texts(answer, "action_servers")))


def _type_of(answer: Mapping[str, Any], name: str) -> str:
    type_name = answer.get("type")
    if not isinstance(type_name, str) or "/" not in type_name:
        raise LinkError(
            f"The robot knows no {name[:80]}.", hint="Ask for the list of what there is first."
        )
    return bare_type(type_name)


def _texts(answer: Mapping[str, Any], key: str) -> list[str]:
    values = answer.get(key)
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        raise LinkError(
            f"The robot's rosapi answers without a list of {key}.",
            hint="Restart rosapi on the robot, or check that it is the one of rosbridge_suite.",
        )
    return values
