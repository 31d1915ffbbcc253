"""How the goals of a ROS 2 action stand: action_msgs/GoalStatusArray."""

import base64
import binascii
from collections.abc import Iterator

from mapspeak.ros.actions.goal import ActionState
from mapspeak.ros.messages import Message

STATES = {
    1: ActionState.ACCEPTED,
    2: ActionState.RUNNING,
    3: ActionState.CANCELLING,
    4: ActionState.SUCCEEDED,
    5: ActionState.CANCELLED,
    6: ActionState.ABORTED,
}
"""action_msgs/GoalStatus."""


def read_statuses(message: Message) -> Iterator[tuple[str, ActionState]]:
    """Yield id and state of each goal of a list; leave out what is none."""
    entries = message.get("status_list")
    for entry in entries if isinstance(entries, list) else []:
        try:
            # The 16 bytes of an id come as a list, as base64 or as bytes.
            uuid = entry["goal_info"]["goal_id"]["uuid"]
            raw = base64.b64decode(uuid, validate=True) if isinstance(uuid, str) else bytes(uuid)
            yield raw.hex(), STATES[entry["status"]]
        except (KeyError, TypeError, ValueError, binascii.Error):
            continue
