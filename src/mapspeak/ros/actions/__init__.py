"""One client for the actions of ROS 1 and ROS 2: goals sent, followed, and ended for certain."""

from mapspeak.ros.actions.client import USUAL_PATIENCE, ActionClient, Patience
from mapspeak.ros.actions.goal import ActionState, SentGoal
from mapspeak.ros.actions.opening import open_action

__all__ = [
    "USUAL_PATIENCE",
    "ActionClient",
    "ActionState",
    "Patience",
    "SentGoal",
    "open_action",
]
