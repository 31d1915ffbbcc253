"""Several robots behind one server: every tool says which robot it is for.

Which robots there are is fixed by the operator when the server starts; a model chooses among their
names and can reach no other.
"""

from collections.abc import Mapping
from typing import Any

import anyio
from mcp.server import MCPServer, ServerRequestContext
from mcp.server.mcpserver import Context
from mcp.server.mcpserver.exceptions import ToolError
from mcp_types import (
    CallToolResult,
    InputRequiredResult,
    ListToolsResult,
    PaginatedRequestParams,
)
from mcp_types import Tool as ListedTool

from mapspeak import __version__
from mapspeak.errors import ConfigError
from mapspeak.server.app import MapspeakServer
from mapspeak.server.toolsets import STOP, ToolListSubscribers, add_prompts
from mapspeak.server.view.chat import make_apps, offer_page

ARGUMENT = "robot"


class FleetServer(MCPServer[Any]):
    """Complete servers, one per robot, as one: calls go to the robot that they name.

    Args:
        servers: By the robot's name; at least one.

    Raises:
        ConfigError: There are none.
    """

    def __init__(self, servers: Mapping[str, MapspeakServer]) -> None:
        if not servers:
            raise ConfigError("There is no robot to serve.", hint="Name one with --robot.")
        names = ", ".join(servers)
        # All have the same toolsets; a policy may leave some of one robot's tools out.
        fullest = max(servers.values(), key=lambda server: len(server.tool_names))
        super().__init__(
            "mapspeak",
            title="mapspeak: robots' maps, eyes and memories of places",
            instructions=f"{fullest.instructions}\nThere are {len(servers)} robots: {names}. "
            f"Each has its own map, memory and ids; every tool takes `{ARGUMENT}`.",
            version=__version__,
            log_level="WARNING",
            extensions=[make_apps()],
        )
        self._servers = dict(servers)
        self._subscribers = ToolListSubscribers(self)
        for server in servers.values():
            server.subscribers.pass_on(self._subscribers.tell)
        add_prompts(self, fullest.tool_names)

    async def _handle_list_tools(
        self, ctx: ServerRequestContext[Any], params: PaginatedRequestParams | None
    ) -> ListToolsResult:
        self._subscribers.note(ctx)
        listed = await super()._handle_list_tools(ctx, params)
        return offer_page(listed, ctx, robots=list(self._servers))

    async def list_tools(self) -> list[ListedTool]:
        """List each tool once, with the names of the robots that have it."""
        first: dict[str, ListedTool] = {}
        robots_of: dict[str, list[str]] = {}
        for name, server in self._servers.items():
            for tool in await server.list_tools():
                first.setdefault(tool.name, tool)
                robots_of.setdefault(tool.name, []).append(name)
        return [_with_robot(tool, robots_of[name]) for name, tool in first.items()]

    async def call_tool(
        self, name: str, arguments: dict[str, Any], context: Context[Any, Any] | None = None
    ) -> CallToolResult | InputRequiredResult:
        """Call a tool of the robot that is named."""
        own = {key: value for key, value in arguments.items() if key != ARGUMENT}
        robot = arguments.get(ARGUMENT)
        if robot is None and name == STOP:
            return await self._stop_all(own, context)
        server = self._servers.get(robot) if isinstance(robot, str) else None
        if server is None:
            known = ", ".join(self._servers)
            said = f"no robot named {str(robot)[:80]!r}" if robot is not None else "no robot named"
            raise ToolError(f"{name}: {said}. Give `{ARGUMENT}`, one of: {known}.")
        return await server.call_tool(name, own, context)

    async def note_hang_up(self, client: str) -> None:
        """Stop the drives of a client that is gone, those of all robots at once."""
        async with anyio.create_task_group() as tasks:
            for server in self._servers.values():
                tasks.start_soon(server.note_hang_up, client)

    async def _stop_all(
        self, arguments: dict[str, Any], context: Context[Any, Any] | None
    ) -> CallToolResult | InputRequiredResult:
        """Stop all at once: one that does not answer holds up none of the others.

        It takes no robot's name, so that no choice is needed in a hurry.
        """
        said: dict[str, str] = {}
        faults: dict[str, str] = {}

        async def stop(name: str, server: MapspeakServer) -> None:
            try:
                said[name] = _text_of(await server.call_tool(STOP, arguments, context))
            except ToolError as error:
                faults[name] = str(error)

        async with anyio.create_task_group() as tasks:
            for name, server in self._servers.items():
                tasks.start_soon(stop, name, server)
        told = said | faults
        text = "\n".join(f"{name}: {told[name]}" for name in self._servers)
        if faults:
            raise ToolError(text)
        return CallToolResult.model_validate({"content": [{"type": "text", "text": text}]})


def _with_robot(tool: ListedTool, robots: list[str]) -> ListedTool:
    schema = dict(tool.input_schema)
    argument: dict[str, Any] = {"type": "string", "enum": robots, "description": "which robot"}
    required = [ARGUMENT, *schema.get("required", [])]
    if tool.name == STOP:
        argument["description"] = "which robot; all of them when left out"
        required = required[1:]
    schema["properties"] = {ARGUMENT: argument, **schema.get("properties", {})}
    schema |= {"required": required} if required else {}
    return tool.model_copy(update={"input_schema": schema})


def _text_of(answer: CallToolResult | InputRequiredResult) -> str:
    content = answer.content if isinstance(answer, CallToolResult) else []
    return " ".join(part.text for part in content if part.type == "text")
