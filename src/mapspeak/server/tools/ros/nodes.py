"""The tools about nodes and their parameters."""

from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any

from pydantic import Field

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.ros.census import ask_each
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.port import find_nearest
from mapspeak.safety import SetParameter
from mapspeak.server.text.ros.listening import (
    list_page,
    match_names,
    page_of,
    say_node,
)
from mapspeak.server.text.ros.outcomes import (
    NO_PARAMETER,
    NO_PARAMETER_TO_DELETE,
    OTHER_KIND,
    READ_AT_START,
    say_deleted,
    say_new,
    say_set,
)
from mapspeak.server.text.values import cut, say_descriptor, say_kind, show_value
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.ros.inquiry import full_name
from mapspeak.server.tools.ros.topics import Filter, Page
from mapspeak.server.tools.toolset import ToolEffect, tool

MOST_DESCRIBED = 5
DESCRIBE = "rcl_interfaces/srv/DescribeParameters"

Node = Annotated[str, Field(description="full name, such as /bt_navigator", max_length=200)]
ParameterNode = Annotated[
    str, Field(description="full name of the node; / for ROS 1's global ones", max_length=200)
]
Parameter = Annotated[str, Field(description="its name within the node", max_length=200)]
Value = Annotated[
    Any, Field(description="true or false, a number, a text or a list; null deletes it")
]


class NodeTools:
    """The nodes, and their parameters."""

    def __init__(self, ros: RosAccess) -> None:
        self._inquiry = ros.inquiry

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
        name, connection = full_name(node), self._inquiry.connection
        await self._inquiry.check_node(name)
        return cut(say_node(name, await connection.fetch_node(name), connection.own_ends))

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
        fetch = partial(self._inquiry.connection.fetch_parameter, name)
        values = await ask_each(page_of(chosen, page), fetch)
        notes = await self._describe(name, chosen) if len(chosen) <= MOST_DESCRIBED else {}
        lines = {each: f"{each}: {_show(values.get(each))}{notes.get(each, '')}" for each in chosen}
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
        name, connection = _node_name(node), self._inquiry.connection
        self._inquiry.check_policy(SetParameter(node=name, name=parameter, value=value))
        if value is None:
            if await connection.fetch_parameter(name, parameter) is None:
                raise NO_PARAMETER_TO_DELETE.error(node=name, name=parameter[:80])
            await connection.set_parameter(name, parameter, None)
            return say_deleted(name, parameter)
        is_ros1 = await self._inquiry.fetch_dialect() is Dialect.ROS1
        before = await connection.fetch_parameter(name, parameter)
        notes = [READ_AT_START] if is_ros1 else []
        if before is None and name != "/":
            notes.insert(0, await self._say_missing(name, parameter, is_made=is_ros1))
        if is_ros1:
            value = keep_kind(before, value, name=f"{parameter} of {name}")
        await connection.set_parameter(name, parameter, value)
        after = await connection.fetch_parameter(name, parameter)
        return say_set(name, parameter, before, after, notes)

    async def _say_missing(self, node: str, parameter: str, *, is_made: bool) -> str:
        """Say of a parameter that is not set whether it is new, and which are like it.

        Raises:
            LinkError: There is no such node, or it has no such parameter and makes none.
        """
        connection = self._inquiry.connection
        known = await connection.fetch_parameter_names(node)
        if parameter in known:
            return ""
        if not known:
            await self._inquiry.check_node(node)
        near = find_nearest(parameter, known)
        if is_made:
            return say_new(near)
        shown = ", ".join(near or known[:5])
        has = f"It has {len(known)}, such as {shown}." if known else "It has none."
        raise NO_PARAMETER.error(node=node, name=parameter[:80], has=has)

    async def _fetch_names(self, node: str) -> tuple[str, ...]:
        try:
            names = await self._inquiry.connection.fetch_parameter_names(node)
        except LinkError:
            await self._inquiry.check_node(node)
            raise
        if not names and node != "/":
            await self._inquiry.check_node(node)
        return names

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
        entries = answer.get("descriptors") or []
        described = [each for each in entries if isinstance(each, Mapping)]
        return {str(each.get("name")): say_descriptor(each) for each in described}


def keep_kind(before: object, value: object, *, name: str) -> object:
    """Return a new value of the kind that the old one has, which ROS 1 itself would not keep.

    Raises:
        LinkError: It is of another kind.
    """
    if before is None:
        return value
    old, new = say_kind(before), say_kind(value)
    if old != new:
        raise OTHER_KIND.error(name=name, old=old, shown=show_value(before), new=new)
    return float(value) if type(before) is float and type(value) is int else value


def _show(value: object) -> str:
    return show_value(value.message if isinstance(value, LinkError) else value)


def _node_name(node: str) -> str:
    return "/" if node.strip() == "/" else full_name(node)
