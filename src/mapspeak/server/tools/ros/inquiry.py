"""Queries to a ROS system: names checked, types described, the latest graph kept."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import anyio

from mapspeak.errors import ConfigError, LinkError
from mapspeak.installation import shell_command
from mapspeak.ros.definitions.checking import describe_type
from mapspeak.ros.definitions.texts import (
    find_parts,
    kinds_of,
    known_definitions,
    split_parts,
)
from mapspeak.ros.definitions.types import TypeBook, find_odd_lines, parse_definition
from mapspeak.ros.messages.fields import NAME, TYPE, Dialect, bare_type
from mapspeak.ros.port import RosConnection, RosGraph, find_nearest
from mapspeak.server.text.offered import lead
from mapspeak.session import Session

NO_ROS = "This robot is no ROS robot: the simulated one is none."
ACTION_GOAL = "ActionGoal"
MOST_NEAR = 5
KEPT_S = 1.0
"""How long a list of names counts as fresh, in wall time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Described:
    """The definition of a type.

    Attributes:
        type: As "package/Type".
        parts: The names of its parts: itself, or those of a service or an action.
        book: Holds them and all types within.
    """

    type: str
    parts: tuple[str, ...]
    book: TypeBook

    @property
    def kind(self) -> str:
        """The kind of the type: "msg", "srv" or "action"."""
        return {1: "msg", 2: "srv", 3: "action"}[len(self.parts)]

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
            raise LinkError(NO_ROS, hint=_say_how_to_get_ros())
        return connection

    @property
    def now_s(self) -> float:
        """Robot time."""
        return self._session.robot.now_s

    async def fetch_graph(self) -> RosGraph:
        """Return the topics and actions there are, as they were a second ago at most."""
        if self._graph is None or anyio.current_time() > self._asked_s + KEPT_S:
            return await self._renew_graph()
        # The kept graph does not answer for a robot that has gone.
        await self.connection.wait_until_connected()
        return self._graph

    async def fetch_topics(self) -> RosGraph:
        """Return the topics as they were a second ago at most; the actions may be older."""
        if self._graph is not None and anyio.current_time() > self._listed_s + KEPT_S:
            return await self._renew_topics(self._graph)
        if self._graph is None:
            return await self._renew_graph()
        await self.connection.wait_until_connected()
        return self._graph

    async def fetch_dialect(self) -> Dialect:
        """Return which ROS it is."""
        return (self._graph or await self.fetch_graph()).dialect

    async def find_topic_type(self, topic: str) -> str | None:
        """Return a topic's type as "package/Type"; ask again only for an unknown topic."""
        graph = self._graph
        if graph is None or topic not in graph.types:
            graph = await (self._renew_graph() if graph is None else self._renew_topics(graph))
        return graph.types.get(topic)

    async def fetch_topic_type(self, topic: str) -> str:
        """Return a topic's type as "package/Type".

        Raises:
            LinkError: There is no such topic; names those most like it.
        """
        found = await self.find_topic_type(topic)
        if found is None:
            raise self.stranger("topic", topic, self._graph.types if self._graph else ())
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
            raise self.stranger("service", service, services) from None

    async def fetch_actions(self) -> tuple[str, ...]:
        """Return all actions; ROS 1 shows them by their topics."""
        return actions_of(await self.fetch_graph())

    async def check_action(self, action: str) -> None:
        """Check that there is such an action.

        Raises:
            LinkError: There is none; names those most like it.
        """
        if action not in await self.fetch_actions():
            actions = actions_of(await self._renew_graph())
            if action not in actions:
                raise self.stranger("action", action, actions)

    async def fetch_action_type(self, action: str) -> str:
        """Return an action's type as "package/Type".

        rosapi 2.1 does not tell it: then it is the one of that name, as Nav2 names its actions.

        Raises:
            LinkError: There is no such action, or its type is unknown.
        """
        await self.check_action(action)
        try:
            return await self.connection.fetch_action_type(action)
        except LinkError as error:
            found = _find_type_by_name(action)
            if found is None:
                raise LinkError(
                    f"The robot does not tell the type of {action}: {error.message}",
                    hint="Give it as type, as `ros2 action list -t` says on the robot.",
                ) from error
            return found

    async def check_node(self, node: str) -> None:
        """Check that there is such a node.

        Raises:
            LinkError: There is none; names those most like it.
        """
        nodes = await self.connection.fetch_nodes()
        if node not in nodes:
            raise self.stranger("node", node, nodes)

    async def describe(self, type_name: str) -> Described:
        """Return the definition of a type.

        Raises:
            LinkError: It is not a type's name, or is unknown; says how to describe it.
        """
        await self._check_type_name(type_name)
        bare = bare_type(type_name)
        texts = await self.connection.fetch_definitions(type_name)
        if not texts:
            # Only the client that taught us knows it.
            texts = self._taught
        parts = find_parts(texts, bare)
        if not parts:
            raise await self._unknown_type(type_name)
        return Described(type=bare, parts=parts, book=TypeBook({**self._taught, **texts}))

    async def _unknown_type(self, type_name: str) -> LinkError:
        graph = self._graph or await self.fetch_graph()
        package = bare_type(type_name).partition("/")[0]
        if bare_type(type_name) in kinds_of(known_definitions(graph.dialect)):
            # Only rclpy leaves out a type that mapspeak could describe: it could not send it.
            return LinkError(
                f"Unknown type {type_name}: the ROS on this machine does not have it.",
                hint=f"Install it: `sudo apt install ros-$ROS_DISTRO-{package.replace('_', '-')}`, "
                "or source the workspace that has it, and start mapspeak again.",
            )
        near = await self._find_types(type_name)
        meant = f" The nearest that are known: {', '.join(near)}." if near else ""
        return LinkError(
            f"Unknown type {type_name}: neither the robot nor mapspeak describes it.{meant}",
            hint=lead(
                "Give its definition to {ros_type}, as `ros2 interface show` (ROS 1: `rosmsg "
                "show -r`, `rossrv show -r`) prints it on the robot, with --- between the parts."
            ),
        )

    async def teach(self, type_name: str, definition: str) -> None:
        """Keep the definition of an otherwise unknown type while the session lasts.

        Raises:
            LinkError: It is not a type's name, or the robot or mapspeak knows that type, or the
                text is not a definition.
        """
        await self._check_type_name(type_name)
        if await self.connection.fetch_definitions(type_name):
            raise LinkError(
                f"What a {type_name} looks like is known already.",
                hint=lead("Call {ros_type} without a definition to see it."),
            )
        texts = split_parts(type_name, definition)
        for name, text in texts.items():
            await self._check_definition(name, text)
        self._taught |= texts

    async def said(self, type_name: str, *, kind: str = "msg") -> str:
        """Return a type as this ROS writes it, such as "nav_msgs/msg/Path"."""
        dialect = await self.fetch_dialect()
        package, _, last = bare_type(type_name).partition("/")
        return f"{package}/{kind}/{last}" if dialect is Dialect.ROS2 else f"{package}/{last}"

    async def _check_type_name(self, type_name: str) -> None:
        if TYPE.fullmatch(type_name):
            return
        near = await self._find_types(type_name)
        meant = f"It may be {', '.join(near)}. " if near else ""
        raise LinkError(
            f"{type_name[:80]!r} is no full name of a type.",
            hint=f"{meant}It looks like geometry_msgs/msg/Twist (ROS 2) or geometry_msgs/Twist "
            "(ROS 1).",
        )

    async def _check_definition(self, name: str, text: str) -> None:
        """Return when every line of a definition is one, and every type within is known."""
        for line in find_odd_lines(text):
            raise LinkError(
                f"The definition of {name} has a line that defines nothing: {line[:80]!r}.",
                hint="A line is a type and a name, as in `float64 x`, or a constant: `uint8 A=1`.",
            )
        fields = parse_definition(name, text).fields
        for kind in dict.fromkeys(field.type for field in fields if field.is_message):
            is_known = kind in self._taught or await self.connection.fetch_definitions(kind)
            if not is_known:
                raise LinkError(
                    f"The definition of {name} holds the type {kind}, which nobody knows.",
                    hint=lead("Give the definition of {kind} to {ros_type} first.", kind=kind),
                )

    async def _find_types(self, wanted: str) -> list[str]:
        """Return the known types most like a name; first those that end as it does."""
        graph = self._graph or await self.fetch_graph()
        texts = {**known_definitions(graph.dialect), **self._taught}
        kinds = dict.fromkeys(graph.types.values(), "msg") | kinds_of(texts)
        last = f"/{wanted.strip('/').rpartition('/')[2].lower()}"
        ending = sorted(name for name in kinds if name.lower().endswith(last))
        near = [*ending, *find_nearest(bare_type(wanted), kinds)]
        nearest = list(dict.fromkeys(near))[:MOST_NEAR]
        return [await self.said(name, kind=kinds[name]) for name in nearest]

    async def _renew_graph(self) -> RosGraph:
        await self.connection.wait_until_connected()
        self._graph = await self.connection.fetch_graph()
        self._asked_s = self._listed_s = anyio.current_time()
        return self._graph

    async def _renew_topics(self, graph: RosGraph) -> RosGraph:
        await self.connection.wait_until_connected()
        self._graph = replace(graph, types=await self.connection.fetch_topics())
        self._listed_s = anyio.current_time()
        return self._graph

    @staticmethod
    def stranger(what: str, name: str, known: Iterable[str]) -> LinkError:
        """Return the error for a name that is not there."""
        names = sorted(known)
        near = find_nearest(name, names)
        if not names:
            return LinkError(f"The robot has no {what}s at all.", hint="Start its ROS nodes.")
        said = f"The nearest of {len(names)}:" if near else f"There are {len(names)}, such as"
        return LinkError(
            f"The robot has no {what} {name[:80]!r}.",
            hint=f"{said} {', '.join(near or names[:5])}. ros_{what}s lists all.",
        )


def full_name(name: str) -> str:
    """Return a name with its leading slash.

    Raises:
        LinkError: ROS allows no such name.
    """
    full = f"/{name.strip().strip('/')}"
    if not NAME.fullmatch(full):
        raise LinkError(
            f"{name[:80]!r} is no name in ROS.", hint="It looks like /map or /robot1/cmd_vel."
        )
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
        raise ConfigError(
            f"The ros toolset needs a ROS robot. {NO_ROS}", hint=_say_how_to_get_ros()
        )


def _say_how_to_get_ros() -> str:
    return (
        f"`{shell_command('simulate --rosbridge')}` makes the simulated robot one; connect "
        "to that, or to any other, with --robot ws://HOST:9090."
    )
