"""The toolset `ros`: every verb of ROS, over any connection to it."""

from mapspeak.server.tools.ros.actions import ActionTools
from mapspeak.server.tools.ros.commands import RosCommands
from mapspeak.server.tools.ros.goals import ActionBook
from mapspeak.server.tools.ros.inquiry import RosInquiry
from mapspeak.server.tools.ros.measuring import MeasuringTools
from mapspeak.server.tools.ros.nodes import NodeTools
from mapspeak.server.tools.ros.services import ServiceTools
from mapspeak.server.tools.ros.topics import TopicTools
from mapspeak.server.tools.toolset import Tool, ToolEffect
from mapspeak.session import Session


class RosTools:
    """Looking into a ROS system, and acting on it.

    Args:
        session: Holds the connection.
    """

    def __init__(self, session: Session) -> None:
        inquiry = RosInquiry(session)
        commands = RosCommands(lambda: inquiry.connection)
        self._nodes = NodeTools(inquiry, commands)
        self._topics = TopicTools(session, inquiry, commands)
        self._measuring = MeasuringTools(session, inquiry)
        self._services = ServiceTools(session, inquiry, commands)
        self._actions = ActionTools(inquiry, commands, ActionBook(inquiry, commands))

    def tools(self) -> list[Tool]:
        """Return the tools in their order."""
        return [
            Tool(
                function=self._nodes.ros_overview,
                title="The ROS system at a glance",
                effect=ToolEffect.READS,
                is_entry=True,
            ),
            *self._topics.tools(),
            *self._measuring.tools(),
            *self._services.tools(),
            *self._actions.tools(),
            *self._nodes.tools(),
        ]
