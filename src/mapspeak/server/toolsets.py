"""Every toolset by its name, and the tools that are chosen of them."""

from collections.abc import Iterable, Mapping, Sequence

from mapspeak.errors import ConfigError
from mapspeak.server.mapview.representations import Representation
from mapspeak.server.tools.drive import DriveTools, ViewTools
from mapspeak.server.tools.explore import ExploreTools
from mapspeak.server.tools.finding import FindTools
from mapspeak.server.tools.look import LookTools
from mapspeak.server.tools.memory import MemoryTools
from mapspeak.server.tools.paper import PaperTools
from mapspeak.server.tools.places import PlaceTools
from mapspeak.server.tools.ros.actions import ActionTools
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.ros.measuring import MeasuringTools
from mapspeak.server.tools.ros.nodes import NodeTools
from mapspeak.server.tools.ros.services import ServiceTools
from mapspeak.server.tools.ros.topics import TopicTools
from mapspeak.server.tools.routes import RouteTools
from mapspeak.server.tools.skills.book import SkillBook
from mapspeak.server.tools.skills.missions import MissionTools
from mapspeak.server.tools.skills.running import SkillRunTools
from mapspeak.server.tools.toolset import Tool, ToolEffect, tools_of
from mapspeak.session import Session
from mapspeak.skills.runs import SkillRuns

STOP = "stop_robot"


def build_toolsets(
    session: Session,
    representation: Representation = Representation.PICTURE_TABLE,
    ros: RosAccess | None = None,
    runs: SkillRuns | None = None,
    book: SkillBook | None = None,
) -> dict[str, list[Tool]]:
    """Return every toolset by its name, in the order in which tools are listed.

    Args:
        session: The session of the tools.
        representation: How look_at_map shows the map.
        ros: Its way to a ROS system, where there is one.
        runs: The runs of its skills.
        book: Its skills.
    """
    find, ros, runs = FindTools(session), ros or RosAccess(session), runs or SkillRuns()
    book = book or SkillBook(session, ros)
    run_tools = SkillRunTools(runs)
    return {
        "look": tools_of(LookTools(session, representation)),
        "places": tools_of(find, PlaceTools(session)),
        "drive": tools_of(DriveTools(session), ViewTools(session)),
        "explore": tools_of(ExploreTools(session)),
        "routes": tools_of(RouteTools(session)),
        "paper": tools_of(PaperTools(session)),
        "memory": tools_of(find, MemoryTools(session)),
        "ros": tools_of(
            TopicTools(ros),
            MeasuringTools(ros),
            ServiceTools(ros),
            ActionTools(ros),
            NodeTools(ros),
        ),
        "skills": tools_of(run_tools),
        "missions": tools_of(MissionTools(book, runs), run_tools),
    }


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
    # find_place and skill_status stand in two toolsets.
    return list({tool.name: tool for tool in reversed(chosen)}.values())[::-1]


def _check_names(what: str, asked: set[str], known: set[str]) -> None:
    strangers = sorted(asked - known)
    if strangers:
        raise ConfigError(
            f"There is no {what} named {', '.join(map(repr, strangers))}.",
            hint=f"Choose from {', '.join(sorted(known))}.",
        )
