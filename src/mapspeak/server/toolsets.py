"""Every toolset by its name."""

from mapspeak.server.mapview.representations import Representation
from mapspeak.server.tools.drive import DriveTools, ViewTools
from mapspeak.server.tools.explore import ExploreTools
from mapspeak.server.tools.finding import FindTools
from mapspeak.server.tools.look import LookTools
from mapspeak.server.tools.memory import MemoryTools
from mapspeak.server.tools.paper import PaperTools
from mapspeak.server.tools.places import PlaceTools
from mapspeak.server.tools.ros.actions import ActionTools
from mapspeak.server.tools.ros.commands import RosCommands
from mapspeak.server.tools.ros.goals import ActionBook
from mapspeak.server.tools.ros.inquiry import RosInquiry
from mapspeak.server.tools.ros.measuring import MeasuringTools
from mapspeak.server.tools.ros.nodes import NodeTools
from mapspeak.server.tools.ros.services import ServiceTools
from mapspeak.server.tools.ros.topics import TopicTools
from mapspeak.server.tools.routes import RouteTools
from mapspeak.server.tools.toolset import Tool, tools_of
from mapspeak.session import Session


def build_toolsets(
    session: Session, representation: Representation = Representation.PICTURE_TABLE
) -> dict[str, list[Tool]]:
    """Return every toolset by its name, in the order in which tools are listed.

    Args:
        session: What the tools work on.
        representation: How look_at_map shows the map.
    """
    find = FindTools(session)
    return {
        "look": tools_of(LookTools(session, representation)),
        "places": tools_of(find, PlaceTools(session)),
        "drive": tools_of(DriveTools(session), ViewTools(session)),
        "explore": tools_of(ExploreTools(session)),
        "routes": tools_of(RouteTools(session)),
        "paper": tools_of(PaperTools(session)),
        "memory": tools_of(find, MemoryTools(session)),
        "ros": _ros_tools(session),
    }


def _ros_tools(session: Session) -> list[Tool]:
    inquiry = RosInquiry(session)
    commands = RosCommands(lambda: inquiry.connection)
    overview, *nodes = tools_of(NodeTools(inquiry, commands))
    others = tools_of(
        TopicTools(session, inquiry, commands),
        MeasuringTools(session, inquiry),
        ServiceTools(session, inquiry, commands),
        ActionTools(inquiry, commands, ActionBook(inquiry, commands)),
    )
    return [overview, *others, *nodes]
