"""Operations for a rosbridge server, and its events, one value per kind.

`Conversation` keeps the state of one connection: frames in, events out, never an exception.
"""

import math
from collections.abc import Mapping
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
from mapspeak.ros.messages.fields import check_name, check_type

MAX_DETAIL_LENGTH = 200
LIGHT_BYTES = 32_768
"""A frame up to this size is read within a few milliseconds, unless more is wrapped in it."""
SIGNS_OF_MORE = (b"fragment", b"\\u")


class EventKind(StrEnum):
    """What a server tells, by the name of the operation."""

    PUBLISHED = "publish"
    ANSWERED = "service_response"
    FED_BACK = "action_feedback"
    ENDED = "action_result"
    NOTED = "status"


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerEvent:
    """One operation of the server.

    Attributes:
        key: The topic of a message, the id of a call or a goal, the level of a remark.
        values: The message, the response or the result, which may hold numpy arrays; a text with
            the reason where a call failed or a goal was refused.
        is_result: False for a call that failed and a goal that was refused; says nothing about a
            goal's success.
        status: Of a goal that ended, as in action_msgs/GoalStatus: 4 succeeded, 5 cancelled,
            6 aborted; None if unsaid.
    """

    kind: EventKind
    key: str
    values: Any
    is_result: bool = True
    status: int | None = None


@dataclass(frozen=True, slots=True)
class FrameRefused:
    """A frame that could not be understood, and was left away; the detail is for the log."""

    fault: FrameFault
    detail: str


Event = ServerEvent | FrameRefused


class Conversation:
    """Parses the frames that a rosbridge server sends over one connection.

    Args:
        max_bytes: The largest accepted message, whole or in fragments.

    Attributes:
        fragments: Of messages that have come in part.
    """

    def __init__(self, *, max_bytes: int = MAX_FRAME_BYTES) -> None:
        self._max_bytes = max_bytes
        self.fragments = FragmentStore(max_bytes=max_bytes)

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
            whole = self.fragments.add(operation)
            if whole is None:
                return None
            return self._understand(self._checked(whole, decode_json), is_whole=True)
        if name not in list(EventKind):
            raise FrameError(FrameFault.UNKNOWN_OPERATION, str(name)[:40])
        return _read(EventKind(name), operation)


_VALUES = {EventKind.PUBLISHED: "msg", EventKind.NOTED: "msg"}
_KEYS = {EventKind.PUBLISHED: "topic", EventKind.NOTED: "level"}


def _read(kind: EventKind, operation: dict[str, Any]) -> ServerEvent:
    key = operation.get(name := _KEYS.get(kind, "id"))
    if not isinstance(key, str):
        raise FrameError(FrameFault.MISSING_FIELD, name)
    values = operation.get(name := _VALUES.get(kind, "values"), {})
    is_message = kind in (EventKind.PUBLISHED, EventKind.FED_BACK)
    if is_message and not isinstance(operation.get(name), dict):
        raise FrameError(FrameFault.MISSING_FIELD, name)
    status = operation.get("status")
    return ServerEvent(
        kind=kind,
        key=key,
        values=values,
        # Old servers leave this out; they answered only successful calls.
        is_result=operation.get("result", True) is True,
        status=status if isinstance(status, int) and not isinstance(status, bool) else None,
    )


MAX_NESTING = 32


class Encoding(StrEnum):
    """The server's encoding of a topic's messages; of several asked for, it takes the last here."""

    JSON = "none"
    PNG = "png"
    CBOR = "cbor"


def write_operation(operation: str, **fields: Any) -> bytes:  # noqa: ANN401 - ROS JSON leaves here
    """Return an operation as the server takes it, without the fields that are None.

    Raises:
        LinkError: A name or type is invalid, or a number is not finite: a robot would act on it.
    """
    said = {key: value for key, value in fields.items() if value is not None}
    for key in said.keys() & {"topic", "service", "action"}:
        check_name(said[key])
    for key in said.keys() & {"type", "action_type"}:
        check_type(said[key])
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
