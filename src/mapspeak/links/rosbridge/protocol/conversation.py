"""Operations for a rosbridge server, and its events, one value per kind.

`Conversation` keeps the state of one connection: frames in, events out, never an exception.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
import orjson

from mapspeak.errors import LinkError
from mapspeak.links.rosbridge.protocol.bounds import (
    MAX_FRAME_BYTES,
    FragmentStore,
    FrameError,
    FrameFault,
    Raw,
)
from mapspeak.links.rosbridge.protocol.codec import decode_cbor, decode_json
from mapspeak.ros.messages.fields import NAME, TYPE, Message

MAX_DETAIL_LENGTH = 200
LIGHT_BYTES = 32_768
"""A frame up to this size is read within a few milliseconds, unless more is wrapped in it."""
SIGNS_OF_MORE = (b"fragment", b"\\u")


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


class Conversation:
    """Parses the frames that a rosbridge server sends over one connection.

    Args:
        max_bytes: The largest accepted message, whole or in fragments.
    """

    def __init__(self, *, max_bytes: int = MAX_FRAME_BYTES) -> None:
        self._max_bytes = max_bytes
        self._fragments = FragmentStore(max_bytes=max_bytes)

    @property
    def n_bytes_held(self) -> int:
        """Of messages that have come in part."""
        return self._fragments.n_bytes

    def is_light(self, frame: bytes | bytearray) -> bool:
        """Return whether reading a frame is a matter of milliseconds at the worst.

        The last piece of a message completes all of it; an escape may hide that it is one.
        """
        return len(frame) <= LIGHT_BYTES and not any(sign in frame for sign in SIGNS_OF_MORE)

    def receive(self, frame: Raw, *, is_text: bool) -> Event | None:
        """Return the event of a frame, JSON in UTF-8 or CBOR; None for a part of a message."""
        try:
            decode = decode_json if is_text else decode_cbor
            return self._understand(self._checked(frame, decode), is_whole=False)
        except FrameError as error:
            return FrameRefused(error.fault, error.detail[:MAX_DETAIL_LENGTH])

    def _checked(self, frame: Raw, decode: Any) -> Any:  # noqa: ANN401 - ROS data enters here
        if len(frame) > self._max_bytes:
            raise FrameError(FrameFault.TOO_LARGE, f"{len(frame)} > {self._max_bytes} bytes")
        return decode(frame)

    def _understand(self, operation: Any, *, is_whole: bool) -> Event | None:  # noqa: ANN401
        if not isinstance(operation, dict):
            raise FrameError(FrameFault.UNKNOWN_OPERATION, type(operation).__name__)
        name = operation.get("op")
        if name == "fragment" and not is_whole:
            whole = self._fragments.add(operation)
            if whole is None:
                return None
            return self._understand(self._checked(whole, decode_json), is_whole=True)
        if not isinstance(name, str) or name not in _READERS:
            raise FrameError(FrameFault.UNKNOWN_OPERATION, str(name)[:40])
        return _READERS[name](operation)


def _published(operation: dict[str, Any]) -> Published:
    message = operation.get("msg")
    if not isinstance(message, dict):
        raise FrameError(FrameFault.MISSING_FIELD, "msg")
    return Published(topic=_text(operation, "topic"), message=message)


def _service_answered(operation: dict[str, Any]) -> ServiceAnswered:
    return ServiceAnswered(
        call_id=_text(operation, "id"),
        # Old servers leave this out; they answered only successful calls.
        is_success=operation.get("result", True) is True,
        values=operation.get("values", {}),
    )


def _goal_fed_back(operation: dict[str, Any]) -> GoalFedBack:
    values = operation.get("values")
    if not isinstance(values, dict):
        raise FrameError(FrameFault.MISSING_FIELD, "values")
    return GoalFedBack(goal_id=_text(operation, "id"), values=values)


def _goal_ended(operation: dict[str, Any]) -> GoalEnded:
    status = operation.get("status")
    return GoalEnded(
        goal_id=_text(operation, "id"),
        status=status if isinstance(status, int) and not isinstance(status, bool) else None,
        is_result=operation.get("result", True) is True,
        values=operation.get("values", {}),
    )


def _status_noted(operation: dict[str, Any]) -> StatusNoted:
    return StatusNoted(
        level=str(operation.get("level"))[:40],
        text=str(operation.get("msg"))[:MAX_DETAIL_LENGTH],
    )


_READERS: dict[str, Callable[[dict[str, Any]], Event]] = {
    "publish": _published,
    "service_response": _service_answered,
    "action_feedback": _goal_fed_back,
    "action_result": _goal_ended,
    "status": _status_noted,
}


def _text(operation: dict[str, Any], key: str) -> str:
    value = operation.get(key)
    if not isinstance(value, str):
        raise FrameError(FrameFault.MISSING_FIELD, key)
    return value


MAX_NESTING = 32


class Encoding(StrEnum):
    """The server's encoding of the messages of a topic."""

    JSON = "none"
    CBOR = "cbor"


def write_operation(operation: str, **fields: Any) -> bytes:  # noqa: ANN401 - ROS JSON leaves here
    """Return an operation as the server takes it, without the fields that are None.

    Raises:
        LinkError: A name or type is invalid, or a number is not finite: a robot would act on it.
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
    if depth > MAX_NESTING:
        raise LinkError(
            f"A message is nested more than {MAX_NESTING} levels deep.",
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
