"""The tools about nodes and their parameters, and about the system as a whole."""

from collections.abc import Mapping
from typing import Annotated, Any

import anyio
from pydantic import Field

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.port import RosGraph, find_nearest
from mapspeak.safety import SetParameter
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import list_some
from mapspeak.server.tools.ros.census import mark_ours
from mapspeak.server.tools.ros.commands import RosCommands
from mapspeak.server.tools.ros.inquiry import RosInquiry, full_name
from mapspeak.server.tools.ros.reports import (
    PAGE_SIZE,
    Filter,
    Page,
    cut,
    list_page,
    match_names,
    show_value,
)
from mapspeak.server.tools.toolset import ToolEffect, tool

MOST_DESCRIBED = 5
MOST_AT_ONCE = 8
MOST_NAMED = 40
CLOCK = "/clock"
DESCRIBE = "rcl_interfaces/srv/DescribeParameters"
KINDS = (
    "not set", "bool", "integer", "double", "string",
    "bytes", "bools", "integers", "doubles", "strings",
)  # fmt: skip
"""By rcl_interfaces/ParameterType."""
NOTABLE = {
    "maps": ("nav_msgs/OccupancyGrid",),
    "velocities": ("geometry_msgs/Twist", "geometry_msgs/TwistStamped"),
    "odometry": ("nav_msgs/Odometry",),
    "scans and clouds": ("sensor_msgs/LaserScan", "sensor_msgs/PointCloud2"),
    "pictures": ("sensor_msgs/Image", "sensor_msgs/CompressedImage"),
}

READ_AT_START = "A node of ROS 1 that runs may notice only when it is started again."
PLAIN = {bool: "true or false", int: "a number", float: "a number", str: "a text"}

Node = Annotated[str, Field(description="full name, such as /bt_navigator", max_length=200)]
ParameterNode = Annotated[
    str, Field(description="full name of the node; / for ROS 1's global ones", max_length=200)
]
Parameter = Annotated[str, Field(description="its name within the node", max_length=200)]
Value = Annotated[
    Any, Field(description="true or false, a number, a text or a list; null deletes it")
]


class NodeTools:
    """The whole, its nodes, their parameters."""

    def __init__(self, inquiry: RosInquiry, commands: RosCommands) -> None:
        self._inquiry = inquiry
        self._commands = commands

    @tool("The ROS system at a glance", ToolEffect.READS, is_entry=True)
    async def ros_overview(self) -> str:
        """Tell which ROS the robot runs and what there is: topics, services, actions, nodes.

        Use it first of the ros_ tools. Which robot it is was chosen by the operator.
        """
        graph = await self._inquiry.fetch_graph()
        connection = self._inquiry.connection
        nodes, services = await connection.fetch_nodes(), await connection.fetch_services()
        actions, time_s = await self._inquiry.fetch_actions(), await self._fetch_time_s(graph)
        number = "1" if graph.dialect is Dialect.ROS1 else "2"
        lines = [
            f"ROS {number} {graph.distro}".rstrip()
            + _say_times(connection.connected_for_s, time_s),
            f"topics: {len(graph.types)}, services: {len(services)}, nodes: {len(nodes)}",
            *_say_notable(graph),
            f"actions: {list_some(actions, most=MOST_NAMED) or 'none'}",
        ]
        return cut("\n".join(lines))

    async def _fetch_time_s(self, graph: RosGraph) -> float | None:
        """Return robot time: that of /clock where there is one, for all nodes go by it then."""
        if CLOCK in graph.types:
            return self._inquiry.now_s
        return await self._inquiry.connection.fetch_time_s()

    @tool("List ROS nodes", ToolEffect.READS, leads="{ros_node} tells what one does.")
    async def ros_nodes(self, filter: Filter = None, page: Page = 1) -> str:  # noqa: A002
        """List the robot's ROS nodes.

        Use it to see what runs.
        """
        nodes = await self._inquiry.connection.fetch_nodes()
        return list_page("nodes", {name: name for name in nodes}, filter, page)

    @tool("One ROS node", ToolEffect.READS, leads="{ros_parameters} gives its settings.")
    async def ros_node(self, node: Node) -> str:
        """Tell what a ROS node publishes, hears and serves.

        Use it to find out who does what.
        """
        name = full_name(node)
        await self._inquiry.check_node(name)
        links = await self._inquiry.connection.fetch_node(name)
        own = self._inquiry.connection.own_ends
        is_ours = bool(own.node) and name.endswith(f"/{own.node}")
        published = mark_ours(links.publishes, own.publishes if is_ours else ())
        heard = mark_ours(links.subscribes, own.hears if is_ours else ())
        return cut(
            f"{name}\npublishes: {list_some(published, most=MOST_NAMED) or 'nothing'}\n"
            f"hears: {list_some(heard, most=MOST_NAMED) or 'nothing'}\n"
            f"serves: {list_some(links.serves, most=MOST_NAMED) or 'nothing'}"
        )

    @tool("ROS parameters", ToolEffect.READS)
    async def ros_parameters(
        self,
        node: ParameterNode,
        filter: Filter = None,  # noqa: A002
        page: Page = 1,
    ) -> str:
        """List a ROS node's parameters with their values; few are described in full.

        Use it with a filter for one parameter; none listed means there is none.
        """
        name = _node_name(node)
        names = await self._fetch_names(name)
        chosen = match_names(names, filter)
        shown = chosen[(page - 1) * PAGE_SIZE : page * PAGE_SIZE]
        values = await self._fetch_values(name, shown)
        notes = await self._describe(name, chosen) if len(chosen) <= MOST_DESCRIBED else {}
        lines = {
            each: f"{each}: {show_value(values.get(each))}{notes.get(each, '')}" for each in chosen
        }
        return cut(list_page(f"parameters of {name}", lines, None, page, len(names)))

    @tool(
        "Set a ROS parameter",
        ToolEffect.MOVES,
        leads="Use {ros_parameters} first for its value and kind.",
    )
    async def ros_set_parameter(
        self, node: ParameterNode, parameter: Parameter, value: Value
    ) -> str:
        """Set or delete a ROS node's parameter, which may change how the robot moves."""
        name = _node_name(node)
        self._commands.check_name(SetParameter(node=name, name=parameter, value=value))
        if value is None:
            await self._delete(name, parameter)
            return f"{parameter} of {name} is deleted."
        connection = self._inquiry.connection
        is_ros1 = await self._inquiry.fetch_dialect() is Dialect.ROS1
        before = await connection.fetch_parameter(name, parameter)
        notes: list[str] = []
        if before is None and name != "/":
            notes = await self._say_missing(name, parameter, is_made=is_ros1)
        if is_ros1:
            value = keep_kind(before, value, name=f"{parameter} of {name}")
            notes.append(READ_AT_START)
        await connection.set_parameter(name, parameter, value)
        after = await connection.fetch_parameter(name, parameter)
        said = f"{parameter} of {name} was {show_value(before)}, is {show_value(after)} now."
        return " ".join([said, *notes])

    async def _say_missing(self, node: str, parameter: str, *, is_made: bool) -> list[str]:
        """Say of a parameter that is not set whether it is new, and which are like it.

        Raises:
            LinkError: There is no such node, or it has no such parameter and makes none.
        """
        connection = self._inquiry.connection
        known = await connection.fetch_parameter_names(node)
        if parameter in known:
            return []
        nodes = await connection.fetch_nodes()
        if not known and node not in nodes:
            raise self._inquiry.stranger("node", node, nodes)
        near = find_nearest(parameter, known)
        if is_made:
            like = f": the nearest that it had is {near[0]}" if near else ""
            return [f"It is new{like}."]
        shown = near or list(known[:5])
        raise LinkError(
            f"{node} has no parameter {parameter[:80]!r}.",
            hint=f"It has {len(known)}, such as {', '.join(shown)}." if shown else "It has none.",
        )

    async def _delete(self, node: str, parameter: str) -> None:
        if await self._inquiry.connection.fetch_parameter(node, parameter) is None:
            raise LinkError(
                f"{node} has no parameter {parameter[:80]!r}.",
                hint=lead("{ros_parameters} lists them."),
            )
        await self._inquiry.connection.set_parameter(node, parameter, None)

    async def _fetch_names(self, node: str) -> tuple[str, ...]:
        try:
            names = await self._inquiry.connection.fetch_parameter_names(node)
        except LinkError:
            await self._inquiry.check_node(node)
            raise
        if not names and node != "/":
            await self._inquiry.check_node(node)
        return names

    async def _fetch_values(self, node: str, names: list[str]) -> dict[str, Any]:
        values: dict[str, Any] = {}
        limiter = anyio.CapacityLimiter(MOST_AT_ONCE)

        async def fetch(name: str) -> None:
            async with limiter:
                try:
                    values[name] = await self._inquiry.connection.fetch_parameter(node, name)
                except LinkError as error:
                    values[name] = error.message

        async with anyio.create_task_group() as tasks:
            for name in names:
                tasks.start_soon(fetch, name)
        return values

    async def _describe(self, node: str, names: list[str]) -> dict[str, str]:
        """Return a ROS 2 node's descriptions of its parameters."""
        if not names or await self._inquiry.fetch_dialect() is Dialect.ROS1:
            return {}
        try:
            answer = await self._inquiry.connection.call_service(
                f"{node}/describe_parameters", {"names": names}, type_name=DESCRIBE
            )
        except MapspeakError:
            return {}  # Neither a node nor a policy has to let us ask.
        entries = answer.get("descriptors")
        described = [each for each in entries or [] if isinstance(each, Mapping)]
        return {str(each.get("name")): _say_descriptor(each) for each in described}


def keep_kind(before: object, value: object, *, name: str) -> object:
    """Return a new value of the kind that the old one has, which ROS 1 itself would not keep.

    Raises:
        LinkError: It is of another kind.
    """
    if before is None:
        return value
    kinds = [PLAIN.get(type(each), "a list or a table") for each in (before, value)]
    if kinds[0] != kinds[1]:
        raise LinkError(
            f"{name} is {kinds[0]} ({show_value(before)}), not {kinds[1]}.",
            hint="Give a value of that kind; to change the kind, delete it first with null.",
        )
    return float(value) if type(before) is float and type(value) is int else value


def _node_name(node: str) -> str:
    return "/" if node.strip() == "/" else full_name(node)


def _say_times(connected_s: float | None, time_s: float | None) -> str:
    connected = "" if connected_s is None else f", connected for {connected_s:.0f} s"
    time = "" if time_s is None else f", robot time {time_s:.1f} s"
    return f"{connected}{time}."


def _say_notable(graph: RosGraph) -> list[str]:
    found = {what: graph.topics_of(*types) for what, types in NOTABLE.items()}
    return [
        f"{what}: {list_some(topics, most=MOST_NAMED)}" for what, topics in found.items() if topics
    ]


def _say_descriptor(entry: Mapping[str, Any]) -> str:
    kind = entry.get("type")
    parts = [KINDS[kind]] if isinstance(kind, int) and 0 <= kind < len(KINDS) else []
    parts += ["read only"] if entry.get("read_only") is True else []
    for key in ("floating_point_range", "integer_range"):
        for limits in entry.get(key) or []:
            if isinstance(limits, Mapping):
                parts.append(f"{limits.get('from_value')} to {limits.get('to_value')}")
    texts = (entry.get("description"), entry.get("additional_constraints"))
    parts += [show_value(text) for text in texts if text]
    return f" ({', '.join(parts)})" if parts else ""
