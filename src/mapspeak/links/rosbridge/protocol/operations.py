"""What we ask of a rosbridge server, and what it tells, one value per kind."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
import orjson

from mapspeak.errors import LinkError
from mapspeak.ros import NAME, TYPE
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


MAX_DEPTH = 32


class Encoding(StrEnum):
    """How the server writes the messages of a topic."""

    JSON = "none"
    CBOR = "cbor"
    PNG = "png"


def subscribe(
    topic: str, *, operation_id: str, type_name: str | None, encoding: Encoding, throttle_ms: int
) -> bytes:
    """Ask for a topic's messages, of which only the latest waits at the server.

    Args:
        topic: Its full name.
        operation_id: To unsubscribe with.
        type_name: None leaves it to the server.
        encoding: How messages are to be written.
        throttle_ms: The least time between two messages; 0 for all of them.
    """
    queueing = {"throttle_rate": throttle_ms, "queue_length": 1} if throttle_ms else {}
    return _encode(
        "subscribe",
        id=operation_id,
        topic=_name(topic),
        compression=encoding.value,
        **_type_of(type_name),
        **queueing,
    )


def unsubscribe(topic: str, *, operation_id: str) -> bytes:
    """End what `subscribe` began."""
    return _encode("unsubscribe", id=operation_id, topic=_name(topic))


def advertise(topic: str, *, operation_id: str, type_name: str) -> bytes:
    """Say that messages of a type will be published."""
    return _encode("advertise", id=operation_id, topic=_name(topic), **_type_of(type_name))


def unadvertise(topic: str, *, operation_id: str) -> bytes:
    """End what `advertise` began."""
    return _encode("unadvertise", id=operation_id, topic=_name(topic))


def publish(topic: str, message: Mapping[str, Any]) -> bytes:
    """Publish a message on a topic that has been advertised.

    Raises:
        LinkError: A number in it is NaN or infinite; a robot would act on it.
    """
    return _encode("publish", topic=_name(topic), msg=message)


def call_service(
    service: str, arguments: Mapping[str, Any], *, operation_id: str, type_name: str | None = None
) -> bytes:
    """Call a service; the answer carries the same id."""
    return _encode(
        "call_service",
        id=operation_id,
        service=_name(service),
        args=arguments,
        **_type_of(type_name),
    )


def send_action_goal(
    action: str, arguments: Mapping[str, Any], *, operation_id: str, type_name: str
) -> bytes:
    """Send a goal to an action (ROS 2); feedback and result carry the same id."""
    return _encode(
        "send_action_goal",
        id=operation_id,
        action=_name(action),
        action_type=_type_name(type_name),
        args=arguments,
        feedback=True,
    )


def cancel_action_goal(action: str, *, operation_id: str) -> bytes:
    """Cancel the goal that was sent with that id (ROS 2); nothing answers."""
    return _encode("cancel_action_goal", id=operation_id, action=_name(action))


def authenticate(token: str) -> bytes:
    """Return a token to a server that asks for one before anything else."""
    return _encode("auth", token=token)


def _encode(operation: str, **fields: Any) -> bytes:  # noqa: ANN401 - ROS JSON leaves here
    _check_numbers(fields, depth=0)
    try:
        return orjson.dumps({"op": operation, **fields}, option=orjson.OPT_SERIALIZE_NUMPY)
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


def _type_of(type_name: str | None) -> dict[str, str]:
    return {} if type_name is None else {"type": _type_name(type_name)}


def _type_name(type_name: str) -> str:
    if TYPE.fullmatch(type_name) is None:
        raise LinkError(
            f"{type_name[:80]!r} is not the name of a ROS type.",
            hint="It looks like geometry_msgs/msg/Twist (ROS 2) or geometry_msgs/Twist (ROS 1).",
        )
    return type_name


def _name(name: str) -> str:
    if NAME.fullmatch(name) is None:
        raise LinkError(
            f"{name[:80]!r} is not the name of a ROS topic, service or action.",
            hint="It looks like /camera/image_raw: letters, digits, _ and /.",
        )
    return name
