"""Commands that move the robot or change something, as values to judge."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from mapspeak.geometry import Pose
from mapspeak.memory.quoting import clean_line
from mapspeak.places.goalcheck import GoalCheck

SAME_GOAL_M = 0.1
"""An approved goal stays approved while a changing map moves it by no more than this."""
SAME_GOAL_RAD = math.radians(10)
MOST_SHOWN = 200
MOST_CARRIED = 1_000
"""The most characters that a person reads of what a command carries."""

Message = Mapping[str, Any]


class CommandKind(StrEnum):
    """The kinds of commands, as policy and audit name them."""

    DRIVE = "drive"
    PUBLISH = "publish"
    CALL = "call"
    ACT = "act"
    SET_PARAMETER = "set_parameter"
    SKILL = "skill"


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveCommand:
    """Drives somewhere by the robot's own navigation.

    Attributes:
        check: What the map says of it, closed areas included.
    """

    goal: Pose
    check: GoalCheck
    kind = CommandKind.DRIVE


@dataclass(frozen=True, slots=True, kw_only=True)
class Publish:
    """Publishes one message."""

    topic: str
    type: str
    message: Message
    kind = CommandKind.PUBLISH


@dataclass(frozen=True, slots=True, kw_only=True)
class Call:
    """Calls a service."""

    service: str
    type: str
    arguments: Message
    kind = CommandKind.CALL


@dataclass(frozen=True, slots=True, kw_only=True)
class Act:
    """Sends a goal to an action.

    Attributes:
        type: Its type, as the caller says.
        true_type: Its type, as the robot says; empty when the robot does not tell it.
    """

    action: str
    type: str
    goal: Message
    true_type: str = ""
    kind = CommandKind.ACT


@dataclass(frozen=True, slots=True, kw_only=True)
class SetParameter:
    """Sets a parameter.

    Attributes:
        node: Whose; empty in ROS 1.
    """

    node: str
    name: str
    value: Any
    kind = CommandKind.SET_PARAMETER

    @property
    def full_name(self) -> str:
        """Node and parameter, as patterns see them."""
        return f"{self.node}:{self.name}" if self.node else self.name


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSkill:
    """Runs a skill of the robot, or a mission.

    Attributes:
        needs_word: A person has to agree, whatever the policy says.
    """

    skill: str
    arguments: Message
    needs_word: bool = False
    kind = CommandKind.SKILL


Command = DriveCommand | Publish | Call | Act | SetParameter | RunSkill


def say_command(command: Command) -> str:
    """Return a command in words."""
    match command:
        case DriveCommand(goal=goal):
            return f"drive to ({goal.x:.2f}, {goal.y:.2f}), yaw {goal.yaw_deg:.0f} deg"
        case Publish():
            return f"publish {command.type or 'anything'} on {command.topic}"
        case Call():
            return f"call {command.service}{_in_brackets(command.type)}"
        case Act():
            kind = _in_brackets(command.true_type or command.type)
            return f"send a goal to {command.action}{kind}"
        case RunSkill(skill=skill, arguments=arguments):
            given = ", ".join(f"{name}={value!r}" for name, value in arguments.items())
            return f"run the skill {skill}{_in_brackets(given[:MOST_SHOWN])}"
        case SetParameter():
            value = f" to {str(command.value)[:MOST_SHOWN]!r}"
            is_deleted = command.value is None
            verb = "delete" if is_deleted else "set"
            return f"{verb} {command.full_name}{'' if is_deleted else value}"


def say_whole(command: Command) -> str:
    """Return a command in words with what it carries: a person agrees to no less."""
    match command:
        case Publish(message=carried) | Call(arguments=carried) | Act(goal=carried):
            text = clean_line(json.dumps(carried, ensure_ascii=False, default=str))
            cut = f"... (of {len(text):,} characters)" if len(text) > MOST_CARRIED else ""
            return f"{say_command(command)}: {text[:MOST_CARRIED]}{cut}"
        case _:
            return say_command(command)


def read_action_goal(command: Publish) -> Act | None:
    """Return the goal that a message is by which ROS 1 sends one; None for any other message."""
    action = command.topic.removesuffix("/goal")
    kind = command.type.removesuffix("ActionGoal")
    goal = command.message.get("goal", {})
    if command.topic == action or command.type == kind or not isinstance(goal, Mapping):
        return None
    return Act(action=action, type=kind, goal=goal, true_type=kind)


def _in_brackets(text: str) -> str:
    return f" ({text})" if text else ""


def is_same(one: Command, other: Command) -> bool:
    """Return True when what was approved of one holds for the other."""
    if isinstance(one, DriveCommand) and isinstance(other, DriveCommand):
        return one.goal.is_near(other.goal, off_m=SAME_GOAL_M, turn_rad=SAME_GOAL_RAD)
    return one == other
