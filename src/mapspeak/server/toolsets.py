"""Every toolset by its name."""

from mapspeak.server.mapview.representations import Representation
from mapspeak.server.tools.drive import DriveTools
from mapspeak.server.tools.explore import ExploreTools
from mapspeak.server.tools.look import LookTools
from mapspeak.server.tools.memory import MemoryTools
from mapspeak.server.tools.paper import PaperTools
from mapspeak.server.tools.places import PlaceTools
from mapspeak.server.tools.ros import RosTools
from mapspeak.server.tools.routes import RouteTools
from mapspeak.server.tools.toolset import Tool
from mapspeak.session import Session


def build_toolsets(
    session: Session, representation: Representation = Representation.PICTURE_TABLE
) -> dict[str, list[Tool]]:
    """Return every toolset by its name, in the order in which tools are listed.

    Args:
        session: What the tools work on.
        representation: How look_at_map shows the map.
    """
    return {
        "look": LookTools(session, representation).tools(),
        "places": PlaceTools(session).tools(),
        "drive": DriveTools(session).tools(),
        "explore": ExploreTools(session).tools(),
        "routes": RouteTools(session).tools(),
        "paper": PaperTools(session).tools(),
        "memory": MemoryTools(session).tools(),
        "ros": RosTools(session).tools(),
    }
