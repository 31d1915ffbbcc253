"""The graph of a robot from its rosapi, and definitions of types that rosapi cannot describe."""

import json
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.links.endpoints import unknown
from mapspeak.ros.definitions.texts import (
    KINDS,
    find_actions_of_ros1,
    find_parts,
    known_definitions,
    name_parts,
    split_definition,
)
from mapspeak.ros.definitions.types import TypeBook
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import Dialect, bare_type, read_stamp
from mapspeak.ros.port import NodeLinks, RosConnection, RosGraph

Call = Callable[[str, Mapping[str, Any]], Awaitable[dict[str, Any]]]


class DefinitionKeeper:
    """Definitions of one robot. Its answers are kept; only unknown types are asked for again.

    On ROS 2 some of rosapi's services that describe types end or hang it: these are never called
    there, so that services and actions are described by what we know ourselves.
    """

    def __init__(self, call: Call) -> None:
        self._call = call
        self._told: dict[str, str] = {}
        self._known: dict[str, str] = {}
        self._not_told: set[str] = set()

    async def fetch(self, type_name: str, *, dialect: Dialect, distro: str) -> Mapping[str, str]:
        """Return the texts of a type's parts and of all types within, as the port says."""
        bare, kinds = bare_type(type_name), _kinds_of(type_name)
        if not self._known:
            self._known = known_definitions(dialect, distro=distro)
        # A type that the robot did not describe, and that we know ourselves, is not asked for
        # again.
        is_answered = bare in self._not_told and find_parts(self._known, bare, kinds)
        if not find_parts(self._told, bare, kinds) and not is_answered:
            await self._ask_graph()
            if dialect is Dialect.ROS1 and not find_parts(self._told, bare, kinds):
                await self._ask_details(bare, kinds)
            self._not_told.add(bare)
        names = find_parts(self._told, bare, kinds) or find_parts(self._known, bare, kinds)
        return TypeBook({**self._known, **self._told}).texts_of(names)

    async def _ask_graph(self) -> None:
        """Take the definitions of all types that some topic has."""
        try:
            answer = await self._call("/rosapi/topics_and_raw_types", {})
        except LinkError:
            return  # An early rosapi has no such service; our own definitions remain.
        types, texts = answer.get("types"), answer.get("typedefs_full_text")
        if not isinstance(types, list) or not isinstance(texts, list):
            return
        for name, text in zip(types, texts, strict=False):
            if (
                isinstance(name, str)
                and isinstance(text, str)
                and bare_type(name) not in self._told
            ):
                self._told |= split_definition(name, text)
        self._told |= find_actions_of_ros1(self._told)

    async def _ask_details(self, bare: str, kinds: tuple[str, ...]) -> None:
        """Ask for one type, as only the rosapi of ROS 1 survives."""
        service = name_parts(bare)[0]
        questions = {"msg": {"message_details": bare}, "srv": {}}
        if "srv" in kinds:
            questions["srv"] = {
                "service_request_details": service[0],
                "service_response_details": service[1],
            }
        for kind in kinds:
            for question, name in questions.get(kind, {}).items():
                try:
                    answer = await self._call(f"/rosapi/{question}", {"type": bare})
                except LinkError:
                    break
                self._take_details(answer, name)

    def _take_details(self, answer: Mapping[str, Any], name: str) -> None:
        details = answer.get("typedefs")
        entries = details if isinstance(details, list) else []
        for number, entry in enumerate(each for each in entries if isinstance(each, Mapping)):
            own_name = bare_type(str(entry.get("type", "")))
            self._told.setdefault(name if number == 0 else own_name, _write_text(entry))


def _kinds_of(type_name: str) -> tuple[str, ...]:
    parts = type_name.strip("/").split("/")
    return (parts[1],) if len(parts) == 3 and parts[1] in KINDS else KINDS


def _write_text(detail: Mapping[str, Any]) -> str:
    """Return rosapi's lists about one type as a .msg text."""
    names, types, lengths, constants, values = (
        value if isinstance(value := detail.get(key), list) else []
        for key in ("fieldnames", "fieldtypes", "fieldarraylen", "constnames", "constvalues")
    )
    lines = [f"string {name}={value}" for name, value in zip(constants, values, strict=False)]
    for name, type_name, length in zip(names, types, lengths, strict=False):
        shown = "" if length == -1 else f"[{length or ''}]"
        lines.append(f"{type_name}{shown} {name}")
    return "\n".join(lines)


ROSAPI_HINT = (
    "Start rosapi beside rosbridge: the usual launch file does (ROS 2: `ros2 launch "
    "rosbridge_server rosbridge_websocket_launch.xml`, ROS 1: `roslaunch rosbridge_server "
    "rosbridge_websocket.launch`). Without it, name `ros` and the topics in robot.yaml."
)


class Rosapi(RosConnection):
    """Asks rosapi, by whatever way services are called.

    Some of its services end or hang it on ROS 2 (message_details, get_param_names): these are
    never called there.
    """

    def __init__(self, patience: Patience) -> None:
        super().__init__(patience)
        self._version: tuple[Dialect, str] | None = None
        self._definitions = DefinitionKeeper(self.call_service)

    async def fetch_graph(self) -> RosGraph:
        """Return the topics and actions there are."""
        listed = await self._list_topics()
        dialect, distro = await self._fetch_version(list(listed.values()))
        actions: tuple[str, ...] = ()
        if dialect is Dialect.ROS2:
            with suppress(LinkError):
                actions = await self._list("action_servers")
        return RosGraph(
            dialect=dialect,
            distro=distro,
            types={topic: bare_type(name) for topic, name in listed.items()},
            actions=actions,
        )

    async def fetch_topics(self) -> Mapping[str, str]:
        """Return the type of each topic."""
        return {topic: bare_type(name) for topic, name in (await self._list_topics()).items()}

    async def _list_topics(self) -> dict[str, str]:
        """Return the type of each topic, as rosapi writes it."""
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
        """Return robot time; None where rosapi does not say."""
        try:
            stamp = (await self.call_service("/rosapi/get_time")).get("time")
            return read_stamp(stamp if isinstance(stamp, dict) else {})
        except LinkError:
            return None

    async def fetch_nodes(self) -> tuple[str, ...]:
        """Return the full names of all nodes."""
        return await self._list("nodes")

    async def fetch_node(self, node: str) -> NodeLinks:
        """Return the topics and services that a node publishes, subscribes to and serves."""
        answer = await self.call_service("/rosapi/node_details", {"node": node})
        return NodeLinks(
            publishes=tuple(sorted(_texts(answer, "publishing"))),
            subscribes=tuple(sorted(_texts(answer, "subscribing"))),
            serves=tuple(sorted(_texts(answer, "services"))),
        )

    async def fetch_publishers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that publish on a topic."""
        return await self._list("publishers", topic=topic)

    async def fetch_subscribers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that listen to a topic."""
        return await self._list("subscribers", topic=topic)

    async def fetch_services(self) -> tuple[str, ...]:
        """Return the full names of all services."""
        return await self._list("services")

    async def fetch_service_type(self, service: str) -> str:
        """Return a service's type."""
        answer = await self.call_service("/rosapi/service_type", {"service": service})
        return _type_of(answer, service)

    async def fetch_action_type(self, action: str) -> str:
        """Return an action's type: by rosapi on ROS 2, by its topics on ROS 1."""
        if await self._fetch_dialect() is Dialect.ROS1:
            answer = await self.call_service("/rosapi/topic_type", {"topic": f"{action}/goal"})
            return _type_of(answer, action).removesuffix("ActionGoal")
        # Only versions after 2.1 have that service.
        answer = await self.call_service("/rosapi/action_type", {"action": action})
        return _type_of(answer, action)

    async def fetch_definitions(self, type_name: str) -> Mapping[str, str]:
        """Return the .msg texts of a type and of all within it: the robot's, else our own."""
        dialect = await self._fetch_dialect()
        distro = "" if self._version is None else self._version[1]
        return await self._definitions.fetch(type_name, dialect=dialect, distro=distro)

    async def fetch_parameter_names(self, node: str) -> tuple[str, ...]:
        """Return the names of a node's parameters."""
        if await self._fetch_dialect() is Dialect.ROS2:
            return await super().fetch_parameter_names(node)
        names = _texts(await self.call_service("/rosapi/get_param_names"), "names")
        below = f"{node.rstrip('/')}/"
        return tuple(sorted(name.removeprefix(below) for name in names if name.startswith(below)))

    async def fetch_parameter(self, node: str, name: str) -> Any:  # noqa: ANN401 - any value
        """Return the value of a node's parameter; None where it is not set."""
        if await self._fetch_dialect() is Dialect.ROS2:
            return await super().fetch_parameter(node, name)
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
        """Set a node's parameter; None deletes it."""
        if await self._fetch_dialect() is Dialect.ROS2:
            await super().set_parameter(node, name, value)
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
        """Return which ROS it is; that is asked once, for it does not change."""
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

    async def _list(self, kind: str, **asked: str) -> tuple[str, ...]:
        """Return the names that the service of rosapi called so lists."""
        return tuple(sorted(_texts(await self.call_service(f"/rosapi/{kind}", asked), kind)))


def _type_of(answer: Mapping[str, Any], name: str) -> str:
    type_name = answer.get("type")
    if not isinstance(type_name, str) or "/" not in type_name:
        raise unknown(name)
    return bare_type(type_name)


def _texts(answer: Mapping[str, Any], key: str) -> list[str]:
    values = answer.get(key)
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        raise LinkError(
            f"The robot's rosapi answers without a list of {key}.",
            hint="Restart rosapi on the robot, or check that it is the one of rosbridge_suite.",
        )
    return values
