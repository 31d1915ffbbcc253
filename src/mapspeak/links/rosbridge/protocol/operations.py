"""What we ask of a rosbridge server, and what it tells, one value per kind."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
import orjson

from mapspeak.errors import LinkError
from mapspeak.links.rosbridge.protocol.bounds import FrameFault
from mapspeak.ros.messages.fields import NAME, TYPE, Message


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Published:
    """A message on a topic.

    Attributes:
        message: Its fields; may hold numpy arrays.
    """

    topic: str
    message: Message


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceAnswered:
    """The answer to one call.

    Attributes:
        is_success: The service was there and did not fail.
        values: Its response; a text with the reason where it failed.
    """

    call_id: str
    is_success: bool
    values: Any


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalFedBack:
    """Feedback of an action."""

    goal_id: str
    values: Message


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalEnded:
    """The end of an action.

    Attributes:
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
    """

    level: str
    text: str


@dataclass(frozen=True, slots=True)
class FrameRefused:
    """A frame that could not be understood, and was left away; the detail is for the log."""

    fault: FrameFault
    detail: str


Event = Published | ServiceAnswered | GoalFedBack | GoalEnded | StatusNoted | FrameRefused


MAX_DEPTH = 32


class Encoding(StrEnum):
    """How the server writes the messages of a topic."""

    JSON = "none"
    CBOR = "cbor"
    PNG = "png"


def write_operation(operation: str, **fields: Any) -> bytes:  # noqa: ANN401 - ROS JSON leaves here
    """Return an operation as the server takes it; fields that are None are left away.

    Raises:
        LinkError: A name or a type is none, or a number is not finite: a robot would act on it.
    """
    said = {key: value for key, value in fields.items() if value is not None}
    for key in ("topic", "service", "action"):
        if key in said:
            _check_name(said[key])
    for key in ("type", "action_type"):
        if key in said:
            _check_type(said[key])
    _check_numbers(said, depth=0)
    try:
        return orjson.dumps({"op": operation, **said}, option=orjson.OPT_SERIALIZE_NUMPY)
    except orjson.JSONEncodeError as error:
        raise LinkError(
            f"A message cannot be written as JSON: {error}.",
            hint="Give numbers, texts, lists and objects only.",
        ) from error


def _check_numbers(value: object, *, depth: int) -> None:
    if depth > MAX_DEPTH:
        raise LinkError(
            f"A message is nested more than {MAX_DEPTH} levels deep.",
            hint="Give the fields of the ROS type, and nothing else.",
        )
    if isinstance(value, float) and not math.isfinite(value):
        raise _not_finite(value)
    if isinstance(value, np.ndarray) and value.dtype.kind == "f" and not np.isfinite(value).all():
        raise _not_finite("NaN or infinity in an array")
    if isinstance(value, Mapping):
        for part in value.values():
            _check_numbers(part, depth=depth + 1)
    elif isinstance(value, list | tuple):
        for part in value:
            _check_numbers(part, depth=depth + 1)


def _not_finite(shown: object) -> LinkError:
    return LinkError(
        f"A message for the robot holds {shown}.", hint="Give finite numbers: it would act on them."
    )


def _check_type(type_name: str) -> None:
    if TYPE.fullmatch(type_name) is None:
        raise LinkError(
            f"{type_name[:80]!r} is not the name of a ROS type.",
            hint="It looks like geometry_msgs/msg/Twist (ROS 2) or geometry_msgs/Twist (ROS 1).",
        )


def _check_name(name: str) -> None:
    if NAME.fullmatch(name) is None:
        raise LinkError(
            f"{name[:80]!r} is not the name of a ROS topic, service or action.",
            hint="It looks like /camera/image_raw: letters, digits, _ and /.",
        )
