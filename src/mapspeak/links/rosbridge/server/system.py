"""A ROS as rosbridge's operations find it: topics, services and types, whoever stands behind."""

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.links.rosbridge.server.hub import Hub
from mapspeak.links.rosbridge.server.interfaces import Interfaces
from mapspeak.links.rosbridge.server.nav2 import Nav2
from mapspeak.links.rosbridge.server.services import Services
from mapspeak.ros.messages import Dialect

LONGEST_COMPLAINT = 1000
LOGGED_ERROR = 8
"""rosgraph_msgs/Log.ERROR."""


class RosSystem:
    """What clients find.

    Attributes:
        dialect: Which ROS.
        hub: Its topics; on ROS 1 /rosout is one of them.
        services: Its services.
        interfaces: Its message types.
        nav2: The navigation of ROS 2; None where there is none.
    """

    def __init__(self, hub: Hub, interfaces: Interfaces, *, dialect: Dialect) -> None:
        self.dialect = dialect
        self.hub = hub
        self.services = Services()
        self.interfaces = interfaces
        self.nav2: Nav2 | None = None

    def complain(self, text: str) -> None:
        """Says what was wrong with an operation where rosbridge says it: on ROS 1, to /rosout."""
        if self.dialect is Dialect.ROS1:
            said = text[:LONGEST_COMPLAINT].encode(errors="replace").decode()
            entry = {"level": LOGGED_ERROR, "name": "/rosbridge_websocket", "msg": said}
            self.hub.publish("/rosout", self.interfaces.fill("rosgraph_msgs/Log", entry))


def refusal(error: MapspeakError) -> str:
    """Gives the text of an error as rosbridge answers it."""
    return error.message if isinstance(error, LinkError) else str(error)
