"""The client of an action: one for each connection and action, shared by all callers."""

from mapspeak.ros.actions.client import ActionClient
from mapspeak.ros.actions.ros1 import Ros1ActionClient
from mapspeak.ros.actions.ros2 import Ros2ActionClient
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.port import RosConnection


def open_action(
    connection: RosConnection, action: str, *, dialect: Dialect, type_name: str
) -> ActionClient:
    """Return the client of an action."""
    known = connection.started.actions.get(action)
    if isinstance(known, ActionClient):
        # A wrong type must not stay for ever.
        is_right = known.type_name == type_name or known.ends_others
        if is_right or known.is_busy:
            return known
    kind = Ros2ActionClient if dialect is Dialect.ROS2 else Ros1ActionClient
    client = kind(connection, action, type_name=type_name)
    connection.started.actions[action] = client
    return client
