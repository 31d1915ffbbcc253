"""The map in the chat (MCP Apps): a page that a client shows beside the answer of look_at_map.

Clients that do not say that they show such pages are offered the same tools as ever. The page asks
for the map by a tool of its own, which no model sees, and which counts as nobody's call: a page
that is left open keeps no drive alive and fills no log.
"""

from collections.abc import Sequence
from functools import partial
from typing import Annotated, Any

from mcp.server import ServerRequestContext
from mcp.server.apps import APP_MIME_TYPE, Apps, client_supports_apps
from mcp.server.mcpserver.resources import FunctionResource
from mcp_types import CallToolResult, ListToolsResult, TextContent, ToolAnnotations
from mcp_types import Tool as ListedTool
from pydantic import Field

from mapspeak.errors import MapspeakError
from mapspeak.server.view.document import GridView, RobotLook
from mapspeak.server.view.overlay import Overlay
from mapspeak.server.view.pages import build_chat_page
from mapspeak.session import Session

URI = "ui://mapspeak/map.html"
LOOK_AT_MAP = "look_at_map"
VIEW_MAP = "view_map"
ROBOT = "robot"
MOST_KNOWN = 4096

Known = Annotated[
    list[Annotated[str, Field(max_length=40)]] | None,
    Field(description="names of tiles that the page has", max_length=MOST_KNOWN),
]


def make_apps() -> Apps:
    """Return the extension with the page, which is made when it is read."""
    apps = Apps()
    apps.add_resource(
        FunctionResource(
            uri=URI,
            name="map",
            title="The robot's map",
            description="The map with rooms, frontiers and the robot, to look at and to click.",
            mime_type=APP_MIME_TYPE,
            meta={"ui": {"prefersBorder": True}},
            fn=lambda: build_chat_page().decode(),
        )
    )
    return apps


class ChatView:
    """Answers the pages of one robot."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._robot = RobotLook(session)

    async def view_map(self, known: Known = None) -> CallToolResult:
        """Return the map as the page draws it, without the tiles that it has."""
        try:
            grid = await self._session.robot.fetch_map()
        except MapspeakError as error:
            said = TextContent(type="text", text=str(error))
            return CallToolResult(content=[said], is_error=True)
        compute, world = self._session.compute, self._session.world
        shown = await compute(partial(GridView.whole, grid, known=frozenset(known or ())))
        overlay = Overlay() if world is None else await compute(partial(Overlay.of, world))
        robot = await self._robot.look()
        parts = {"map": shown, "overlay": overlay, "robot": robot}
        told = {name: part.model_dump() for name, part in parts.items()}
        return CallToolResult(content=[], structured_content=told)


def offer_page(
    listed: ListToolsResult, context: ServerRequestContext[Any], robots: Sequence[str] = ()
) -> ListToolsResult:
    """Return the list with the page, for a client that shows pages; else as it is.

    Args:
        listed: What is listed for every client.
        context: Tells what the client can do.
        robots: Their names where there are several.
    """
    if not client_supports_apps(context):
        return listed
    if all(tool.name != LOOK_AT_MAP for tool in listed.tools):
        return listed
    tools = [_with_page(tool) if tool.name == LOOK_AT_MAP else tool for tool in listed.tools]
    return listed.model_copy(update={"tools": [*tools, _describe_view(robots)]})


def _with_page(tool: ListedTool) -> ListedTool:
    return tool.model_copy(update={"meta": {**(tool.meta or {}), "ui": {"resourceUri": URI}}})


def _describe_view(robots: Sequence[str]) -> ListedTool:
    known = {"type": "array", "items": {"type": "string"}}
    robot = {ROBOT: {"type": "string", "enum": list(robots)}} if robots else {}
    return ListedTool(
        name=VIEW_MAP,
        title="The map for its page",
        description="For the page that shows the map.",
        input_schema={"type": "object", "properties": {"known": known, **robot}},
        annotations=ToolAnnotations(read_only_hint=True),
        _meta={"ui": {"resourceUri": URI, "visibility": ["app"]}},
    )
