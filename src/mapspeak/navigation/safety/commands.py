"""What somebody may want of the robot that moves or changes something, as values to judge."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from mapspeak.geometry import Pose
from mapspeak.navigation.goals import GoalCheck

__all__ = ["Act", "Call", "Command", "Drive", "Kind", "Publish", "SetParameter", "say_command"]

SAME_GOAL_M = 0.5
"""An approved goal stays approved while a changing map moves it by no more than this."""
MOST_SHOWN = 200

Message = Mapping[str, Any]


class Kind(StrEnum):
    """The kinds of commands, as policy and audit name them."""

    DRIVE = "drive"
    PUBLISH = "publish"
    CALL = "call"
    ACT = "act"
    SET_PARAMETER = "set_parameter"


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """Drives somewhere by the robot's own navigation.

    Attributes:
        goal: Where to.
        check: What the map says of it, closed areas included.
    """

    goal: Pose
    check: GoalCheck
    kind = Kind.DRIVE


@dataclass(frozen=True, slots=True, kw_only=True)
class Publish:
    """Publishes one message.

    Attributes:
        topic: Such as "/cmd_vel".
        type: Such as "geometry_msgs/msg/Twist".
        message: Its fields.
    """

    topic: str
    type: str
    message: Message
    kind = Kind.PUBLISH


@dataclass(frozen=True, slots=True, kw_only=True)
class Call:
    """Calls a service.

    Attributes:
        service: Its name.
        type: Its type.
        arguments: Of the request.
    """

    service: str
    type: str
    arguments: Message
    kind = Kind.CALL


@dataclass(frozen=True, slots=True, kw_only=True)
class Act:
    """Sends a goal to an action.

    Attributes:
        action: Its name.
        type: Its type.
        goal: The goal's fields.
    """

    action: str
    type: str
    goal: Message
    kind = Kind.ACT


@dataclass(frozen=True, slots=True, kw_only=True)
class SetParameter:
    """Sets a parameter.

    Attributes:
        node: Whose; empty in ROS 1.
        name: Which.
        value: To what.
    """

    node: str
    name: str
    value: Any
    kind = Kind.SET_PARAMETER

    @property
    def full_name(self) -> str:
        """Node and parameter, as patterns see them."""
        return f"{self.node}:{self.name}" if self.node else self.name


Command = Drive | Publish | Call | Act | SetParameter


def say_command(command: Command) -> str:
    """Gives a command in words."""
    match command:
        case Drive(goal=goal):
            return f"drive to ({goal.x:.2f}, {goal.y:.2f}), yaw {goal.yaw_deg:.0f} deg"
        case Publish():
            return f"publish {command.type} on {command.topic}"
        case Call():
            return f"call {command.service} ({command.type})"
        case Act():
            return f"send a goal to {command.action} ({command.type})"
        case SetParameter(value=None):
            return f"delete {command.full_name}"
        case SetParameter():
            return f"set {command.full_name} to {str(command.value)[:MOST_SHOWN]!r}"


def is_same(one: Command, other: Command) -> bool:
    """True when what was approved of one holds for the other."""
    if isinstance(one, Drive) and isinstance(other, Drive):
        return one.goal.point.distance_to(other.goal.point) <= SAME_GOAL_M
    return one == other
