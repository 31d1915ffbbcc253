"""Queries to a ROS system: names checked, types described, the latest graph kept."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import anyio

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.ros.definitions.checking import check_message, describe_type
from mapspeak.ros.definitions.texts import find_parts, kinds_of, known_definitions, split_parts
from mapspeak.ros.definitions.types import Field, TypeBook, find_odd_lines, parse_definition
from mapspeak.ros.listening import Heard, hear
from mapspeak.ros.messages.fields import NAME, TYPE, Dialect, bare_type
from mapspeak.ros.port import RosConnection, RosGraph, find_nearest
from mapspeak.safety import Act, Call, GuardedConnection, Publish, SetParameter
from mapspeak.server.text.ros.outcomes import (
    KNOWN_TYPE,
    NO_NAME,
    NO_ROS,
    NO_ROS_TOOLS,
    NO_TYPE,
    NOT_INSTALLED,
    ODD_LINE,
    UNKNOWN_TYPE,
    UNKNOWN_WITHIN,
    UNTOLD_TYPE,
    refuse_name,
    refuse_without_ros,
)
from mapspeak.session import Session

ACTION_GOAL = "ActionGoal"
MOST_NEAR = 5
KEPT_S = 1.0
"""How long a list of names counts as fresh, in wall time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Described:
    """The definition of a type.

    Attributes:
        type: As "package/Type".
        said: As this ROS writes it, such as "nav_msgs/msg/Path".
        parts: The names of its parts: itself, or those of a service or an action.
        book: Holds them and all types within.
    """

    type: str
    said: str
    parts: tuple[str, ...]
    book: TypeBook

    @property
    def answer_fields(self) -> tuple[Field, ...]:
        """The fields of a service's response, or of an action's result."""
        return self.book[self.parts[1]].fields

    def check(self, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Return a message, request or goal of this type as it may be sent.

        Raises:
            LinkError: It does not fit; names the field's path and what its type wants.
        """
        return check_message(self.book, self.parts[0], fields)

    def say(self) -> str:
        """Return its fields down to the plain values, part by part."""
        told: list[str] = []
        for name in self.parts:
            lines = describe_type(self.book, name) or ["(no fields)"]
            if len(self.parts) == 1:
                return "\n".join(lines)
            told.append(f"{name.rpartition('_')[2].lower()}:")
            told += [f"  {line}" for line in lines]
        return "\n".join(told)


class RosInquiry:
    """Asks over the session's connection; keeps the answers about names and types.

    Args:
        session: Holds the connection.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._graph: RosGraph | None = None
        self._asked_s = float("-inf")
        self._listed_s = float("-inf")
        self._taught: dict[str, str] = {}

    @property
    def connection(self) -> RosConnection:
        """The connection.

        Raises:
            LinkError: The robot is no ROS robot.
        """
        connection = self._session.ros
        if connection is None:
            raise refuse_without_ros(NO_ROS)
        return connection

    def check_policy(self, command: Publish | Call | Act | SetParameter) -> None:
        """Return when a command is not denied for its name: said before anything else is checked.

        Raises:
            PolicyError: It is.
        """
        if isinstance(self.connection, GuardedConnection):
            self.connection.check_name(command)

    # --- names

    async def fetch_graph(self) -> RosGraph:
        """Return the topics and actions there are, as they were a second ago at most."""
        return await self._fetch_graph(is_fresh=anyio.current_time() <= self._asked_s + KEPT_S)

    async def fetch_topics(self) -> RosGraph:
        """Return the topics as they were a second ago at most; the actions may be older."""
        is_fresh = anyio.current_time() <= self._listed_s + KEPT_S
        return await self._fetch_graph(is_fresh=is_fresh, topics_suffice=True)

    async def _fetch_graph(self, *, is_fresh: bool, topics_suffice: bool = False) -> RosGraph:
        # Also the kept graph does not answer for a robot that has gone.
        await self.connection.wait_until_connected()
        if self._graph is not None and is_fresh:
            return self._graph
        if self._graph is not None and topics_suffice:
            self._graph = replace(self._graph, types=await self.connection.fetch_topics())
        else:
            self._graph = await self.connection.fetch_graph()
            self._asked_s = anyio.current_time()
        self._listed_s = anyio.current_time()
        return self._graph

    async def fetch_dialect(self) -> Dialect:
        """Return which ROS it is."""
        return (self._graph or await self.fetch_graph()).dialect

    async def find_topic_type(self, topic: str) -> str | None:
        """Return a topic's type as "package/Type"; ask again only for an unknown topic."""
        graph = self._graph
        if graph is None or topic not in graph.types:
            graph = await self._fetch_graph(is_fresh=False, topics_suffice=True)
        return graph.types.get(topic)

    async def fetch_topic_type(self, topic: str) -> str:
        """Return a topic's type as "package/Type".

        Raises:
            LinkError: There is no such topic; names those most like it.
        """
        found = await self.find_topic_type(topic)
        if found is None:
            raise refuse_name("topic", topic, self._graph.types if self._graph else ())
        return found

    async def fetch_service_type(self, service: str) -> str:
        """Return a service's type as "package/Type".

        Raises:
            LinkError: There is no such service; names those most like it.
        """
        try:
            return await self.connection.fetch_service_type(service)
        except LinkError:
            services = await self.connection.fetch_services()
            if service in services:
                raise
            raise refuse_name("service", service, services) from None

    async def fetch_actions(self) -> tuple[str, ...]:
        """Return all actions; ROS 1 shows them by their topics."""
        return actions_of(await self.fetch_graph())

    async def check_action(self, action: str) -> None:
        """Check that there is such an action.

        Raises:
            LinkError: There is none; names those most like it.
        """
        if action not in await self.fetch_actions():
            actions = actions_of(await self._fetch_graph(is_fresh=False))
            if action not in actions:
                raise refuse_name("action", action, actions)

    async def fetch_action_type(self, action: str, *, given: str | None = None) -> str:
        """Return an action's type as "package/Type"; the given one, where one is.

        rosapi 2.1 does not tell it: then it is the one of that name, as Nav2 names its actions.

        Raises:
            LinkError: There is no such action, or its type is unknown.
        """
        await self.check_action(action)
        if given is not None:
            return bare_type(given)
        try:
            return await self.connection.fetch_action_type(action)
        except LinkError as error:
            found = _find_type_by_name(action)
            if found is None:
                raise UNTOLD_TYPE.error(name=action, why=error.message) from error
            return found

    async def check_node(self, node: str) -> None:
        """Check that there is such a node.

        Raises:
            LinkError: There is none; names those most like it.
        """
        nodes = await self.connection.fetch_nodes()
        if node not in nodes:
            raise refuse_name("node", node, nodes)

    # --- messages

    async def hear(
        self, topic: str, type_name: str, *, n: int = 1, wait_s: float, duration_s: float = 0.0
    ) -> Heard:
        """Listen to a topic of a type, "package/Type"; see `mapspeak.ros.listening.hear`."""
        return await hear(
            self.connection,
            topic,
            type_name=await self.say_type(type_name),
            n=n,
            wait_s=wait_s,
            duration_s=duration_s,
        )

    # --- types

    async def say_type(self, type_name: str, *, kind: str = "msg") -> str:
        """Return a type as this ROS writes it, such as "nav_msgs/msg/Path"."""
        dialect = await self.fetch_dialect()
        package, _, last = bare_type(type_name).partition("/")
        return f"{package}/{kind}/{last}" if dialect is Dialect.ROS2 else f"{package}/{last}"

    async def describe(self, type_name: str, *, kind: str | None = None) -> Described:
        """Return the definition of a type.

        Args:
            type_name: However it is written.
            kind: "msg", "srv" or "action"; None asks for it as it is written.

        Raises:
            LinkError: It is not a type's name, or is unknown; says how to describe it.
        """
        wanted = type_name if kind is None else await self.say_type(type_name, kind=kind)
        await self._check_type_name(wanted)
        bare = bare_type(wanted)
        texts = await self.connection.fetch_definitions(wanted)
        if not texts:
            # Only the client that taught us knows it.
            texts = self._taught
        parts = find_parts(texts, bare)
        if not parts:
            raise await self._unknown_type(wanted)
        said = await self.say_type(bare, kind=("msg", "srv", "action")[len(parts) - 1])
        return Described(
            type=bare, said=said, parts=parts, book=TypeBook({**self._taught, **texts})
        )

    async def teach(self, type_name: str, definition: str) -> None:
        """Keep the definition of an otherwise unknown type while the session lasts.

        Raises:
            LinkError: It is not a type's name, or the robot or mapspeak knows that type, or the
                text is not a definition.
        """
        await self._check_type_name(type_name)
        if await self.connection.fetch_definitions(type_name):
            raise KNOWN_TYPE.error(type=type_name)
        texts = split_parts(type_name, definition)
        for name, text in texts.items():
            await self._check_definition(name, text)
        self._taught |= texts

    async def _unknown_type(self, type_name: str) -> MapspeakError:
        graph = self._graph or await self.fetch_graph()
        bare = bare_type(type_name)
        if bare in kinds_of(known_definitions(graph.dialect)):
            # Only rclpy leaves out a type that mapspeak could describe: it could not send it.
            package = bare.partition("/")[0].replace("_", "-")
            return NOT_INSTALLED.error(type=type_name, package=package)
        near = await self._find_types(type_name)
        meant = f" The nearest that are known: {', '.join(near)}." if near else ""
        return UNKNOWN_TYPE.error(type=type_name, meant=meant)

    async def _check_type_name(self, type_name: str) -> None:
        if not TYPE.fullmatch(type_name):
            near = await self._find_types(type_name)
            meant = f"It may be {', '.join(near)}. " if near else ""
            raise NO_TYPE.error(type=type_name[:80], meant=meant)

    async def _check_definition(self, name: str, text: str) -> None:
        """Return when every line of a definition is one, and every type within is known."""
        for line in find_odd_lines(text):
            raise ODD_LINE.error(type=name, line=line[:80])
        fields = parse_definition(name, text).fields
        for within in dict.fromkeys(field.type for field in fields if field.is_message):
            if within not in self._taught and not await self.connection.fetch_definitions(within):
                raise UNKNOWN_WITHIN.error(type=name, within=within)

    async def _find_types(self, wanted: str) -> list[str]:
        """Return the known types most like a name; first those that end as it does."""
        graph = self._graph or await self.fetch_graph()
        texts = {**known_definitions(graph.dialect), **self._taught}
        kinds = dict.fromkeys(graph.types.values(), "msg") | kinds_of(texts)
        last = f"/{wanted.strip('/').rpartition('/')[2].lower()}"
        ending = sorted(name for name in kinds if name.lower().endswith(last))
        near = dict.fromkeys([*ending, *find_nearest(bare_type(wanted), kinds)])
        return [await self.say_type(name, kind=kinds[name]) for name in list(near)[:MOST_NEAR]]


def full_name(name: str) -> str:
    """Return a name with its leading slash.

    Raises:
        LinkError: ROS allows no such name.
    """
    full = f"/{name.strip().strip('/')}"
    if not NAME.fullmatch(full):
        raise NO_NAME.error(name=name[:80])
    return full


def _find_type_by_name(action: str) -> str | None:
    """Return the type that comes with mapspeak and is called as the action: /spin is a Spin."""
    wanted = action.rpartition("/")[2].replace("_", "").lower()
    goals = (name for name in known_definitions(Dialect.ROS2) if name.endswith("_Goal"))
    types = (name.removesuffix("_Goal") for name in goals)
    return next((name for name in types if name.partition("/")[2].lower() == wanted), None)


def actions_of(graph: RosGraph) -> tuple[str, ...]:
    """Return all actions; ROS 1 shows them by their topics."""
    if graph.dialect is Dialect.ROS2:
        return graph.actions
    goals = (name for name, kind in graph.types.items() if kind.endswith(ACTION_GOAL))
    return tuple(sorted(name.removesuffix("/goal") for name in goals if name.endswith("/goal")))


def require_ros(session: Session, *, toolsets: Iterable[str], tools: Iterable[str] = ()) -> None:
    """Return when no tool of ROS is wanted, or they can work.

    Raises:
        ConfigError: One is wanted of a robot that is no ROS robot.
    """
    is_wanted = "ros" in toolsets or any(name.startswith("ros_") for name in tools)
    if is_wanted and session.ros is None:
        raise refuse_without_ros(NO_ROS_TOOLS)
