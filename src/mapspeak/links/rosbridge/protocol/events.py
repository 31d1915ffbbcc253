"""What a rosbridge server tells us, one value per kind."""

from dataclasses import dataclass
from typing import Any

from mapspeak.ros.messages import Message


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Published:
    """A message on a topic.

    Attributes:
        topic: As the server names it.
        message: Its fields; may hold numpy arrays.
    """

    topic: str
    message: Message


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceAnswered:
    """The answer to one call.

    Attributes:
        call_id: The id the call was sent with.
        is_success: The service was there and did not fail.
        values: Its response; a text with the reason where it failed.
    """

    call_id: str
    is_success: bool
    values: Any


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalFedBack:
    """Feedback of an action.

    Attributes:
        goal_id: The id the goal was sent with.
        values: The feedback message.
    """

    goal_id: str
    values: Message


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalEnded:
    """The end of an action.

    Attributes:
        goal_id: The id the goal was sent with.
        status: As in action_msgs/GoalStatus: 4 succeeded, 5 cancelled, 6 aborted; None if unsaid.
        is_result: False when the goal was refused; says nothing about success.
        values: The result message; a text with the reason where it was refused.
    """

    goal_id: str
    status: int | None
    is_result: bool
    values: Any


@dataclass(frozen=True, slots=True, kw_only=True)
class StatusNoted:
    """A remark of the server.

    Attributes:
        level: "error", "warning", "info" or "none".
        text: The remark.
        operation_id: What it is about; None where the server does not say.
    """

    level: str
    text: str
    operation_id: str | None


@dataclass(frozen=True, slots=True)
class FrameRefused:
    """A frame that could not be understood, and was left away.

    Attributes:
        reason: What is wrong with it.
    """

    reason: str


Event = Published | ServiceAnswered | GoalFedBack | GoalEnded | StatusNoted | FrameRefused
