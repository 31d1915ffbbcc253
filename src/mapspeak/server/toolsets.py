"""What a server offers: toolsets, the tools chosen of them, prompts, and who hears of changes.

The exploration prompt is the paper's appendix word for word. The paper describes its semantic
filtering policy without quoting it; the three categories are in the paper's words, and what is
left out is said by `mapspeak.memory`, which holds every record to it.
"""

from collections.abc import Awaitable, Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import partial
from importlib import resources
from typing import Any

from mcp.server import MCPServer, NotificationOptions, ServerRequestContext
from mcp.server.connection import Connection
from mcp.server.subscriptions import ToolsListChanged

from mapspeak.errors import ConfigError, say_nearest
from mapspeak.memory import LEFT_OUT
from mapspeak.server.reports.representations import Representation
from mapspeak.server.tools.drive import DriveTools, ViewTools
from mapspeak.server.tools.explore import ExploreTools
from mapspeak.server.tools.look import LookTools
from mapspeak.server.tools.memory import MemoryTools
from mapspeak.server.tools.paper import PaperTools
from mapspeak.server.tools.places import FindTools, PlaceTools
from mapspeak.server.tools.ros.actions import ActionTools
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.ros.measuring import MeasuringTools
from mapspeak.server.tools.ros.nodes import NodeTools
from mapspeak.server.tools.ros.services import ServiceTools
from mapspeak.server.tools.ros.topics import TopicTools
from mapspeak.server.tools.routes import RouteTools
from mapspeak.server.tools.skills.book import SkillBook
from mapspeak.server.tools.skills.tools import MissionTools, SkillRunTools
from mapspeak.server.tools.toolset import Tool, ToolEffect, tools_of
from mapspeak.session import Session

STOP = "stop_robot"
IN_PAPERS_PROMPTS = ("navigate_to", "wait_for_goal", "look_through_camera")
"""What the paper's prompts ask for besides its own tools: they run by the toolset alone."""
SEMANTIC_DATA = ("write_semantic_data", "get_semantic_data")
"""Those of the paper's tools without which there is no memory."""


def build_toolsets(
    session: Session,
    representation: Representation = Representation.PICTURE_TABLE,
    ros: RosAccess | None = None,
    book: SkillBook | None = None,
) -> dict[str, list[Tool]]:
    """Return every toolset by its name, in the order in which tools are listed.

    Args:
        session: The session of the tools.
        representation: How look_at_map shows the map.
        ros: Its way to a ROS system, where there is one.
        book: Its skills.
    """
    find, ros = FindTools(session), ros or RosAccess(session)
    look = tools_of(LookTools(session, representation))
    drive, paper = tools_of(DriveTools(session), ViewTools(session)), tools_of(PaperTools(session))
    book = book or SkillBook(session, ros)
    run_tools = SkillRunTools(book.runs)
    return {
        "look": look,
        "places": tools_of(find, PlaceTools(session)),
        "drive": drive,
        "explore": tools_of(ExploreTools(session)),
        "routes": tools_of(RouteTools(session)),
        "paper": [*_named(IN_PAPERS_PROMPTS, look, drive), *paper],
        "memory": [*_named(SEMANTIC_DATA, paper), *tools_of(find, MemoryTools(session))],
        "ros": tools_of(
            TopicTools(ros),
            MeasuringTools(ros),
            ServiceTools(ros),
            ActionTools(ros),
            NodeTools(ros),
        ),
        "skills": tools_of(run_tools),
        "missions": tools_of(MissionTools(book), run_tools),
    }


def _named(names: Collection[str], *groups: Sequence[Tool]) -> Iterator[Tool]:
    return (tool for group in groups for tool in group if tool.name in names)


def choose_tools(
    known: Mapping[str, Sequence[Tool]],
    *,
    toolsets: Iterable[str],
    tools: Iterable[str],
    is_read_only: bool,
) -> list[Tool]:
    """Return the chosen tools in their fixed order, with stop_robot where one moves the robot.

    Raises:
        ConfigError: There is no such toolset or tool.
    """
    chosen_sets, chosen_tools = set(toolsets), set(tools)
    _check_names("toolset", chosen_sets, set(known))
    _check_names("tool", chosen_tools, {tool.name for group in known.values() for tool in group})
    chosen = [
        tool
        for toolset, group in known.items()
        for tool in group
        if (toolset in chosen_sets or tool.name in chosen_tools)
        and (not is_read_only or tool.effect in (ToolEffect.READS, ToolEffect.STOPS))
    ]
    if any(tool.effect is ToolEffect.MOVES for tool in chosen) and STOP not in {
        tool.name for tool in chosen
    }:
        # A client that can start the robot can stop it.
        return choose_tools(
            known, toolsets=chosen_sets, tools={*chosen_tools, STOP}, is_read_only=is_read_only
        )
    # Some stand in two toolsets.
    return list({tool.name: tool for tool in chosen}.values())


def _check_names(what: str, asked: set[str], known: set[str]) -> None:
    strangers = sorted(asked - known)
    if strangers:
        near = say_nearest(strangers[0], sorted(known))
        raise ConfigError(
            f"There is no {what} named {', '.join(map(repr, strangers))}.",
            hint=f"{near}Choose from {', '.join(sorted(known))}.",
        )


class ToolListSubscribers:
    """Every client that has asked for the list of tools.

    Clients of the newer protocol listen to a stream that they open; older ones are told over their
    connection, and only once they know that they will be.

    Args:
        server: Whose list it is.
    """

    def __init__(self, server: MCPServer[Any]) -> None:
        self._bus = server._subscriptions  # noqa: SLF001 - what `Context.notify_tools_changed` uses
        self._connections: set[Connection] = set()
        self._others: list[Callable[[], Awaitable[None]]] = []
        lowlevel = server._lowlevel_server  # noqa: SLF001 - the SDK offers no other way
        lowlevel.create_initialization_options = partial(  # type: ignore[method-assign]
            lowlevel.create_initialization_options, NotificationOptions(tools_changed=True)
        )

    def note(self, context: ServerRequestContext[Any]) -> None:
        """Remember a client while it is connected."""
        connection = context.session._connection  # noqa: SLF001 - sessions are one per request
        if connection not in self._connections:
            self._connections.add(connection)
            connection.exit_stack.callback(self._connections.discard, connection)

    def pass_on(self, tell: Callable[[], Awaitable[None]]) -> None:
        """Tell others too: the list is a part of theirs."""
        self._others.append(tell)

    async def tell(self) -> None:
        """Tell all clients that they should ask for the list again."""
        await self._bus.publish(ToolsListChanged())
        for connection in list(self._connections):
            await connection.send_tool_list_changed()
        for tell in self._others:
            await tell()


def read_text(name: str) -> str:
    """Return one of the texts that come with the server, as they stand in `text/`."""
    return (resources.files("mapspeak.server") / "text" / f"{name}.txt").read_text("utf-8").strip()


def policy_text() -> str:
    """Return the semantic filtering policy: what is kept, and what is left out."""
    return "\n".join([read_text("semantic_policy"), *(f"- {line}" for line in LEFT_OUT.values())])


def add_prompts(server: MCPServer, offered: Collection[str]) -> None:
    """Register the paper's exploration prompt and policy where the tool that they name is there."""
    if "write_semantic_data" not in offered:
        return

    @server.prompt(title="Explore and map (the paper's exploration prompt)")
    def exploration() -> str:
        """Explores the building waypoint by waypoint and records what is seen."""
        return f"{read_text('exploration')}\n\n{policy_text()}"

    @server.prompt(title="Semantic map policy")
    def semantic_policy() -> str:
        """Says which observations belong into the semantic map."""
        return policy_text()
