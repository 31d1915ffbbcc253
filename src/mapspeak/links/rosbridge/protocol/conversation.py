"""One connection's talk, as far as it has a memory: frames in, events out, never an exception."""

from typing import Any

from mapspeak.links.rosbridge.protocol.bounds import (
    MAX_FRAME_BYTES,
    FragmentStore,
    FrameError,
    FrameFault,
    Raw,
)
from mapspeak.links.rosbridge.protocol.codec import decode_cbor, decode_json, decode_png
from mapspeak.links.rosbridge.protocol.operations import (
    Event,
    FrameRefused,
    GoalEnded,
    GoalFedBack,
    Published,
    ServiceAnswered,
    StatusNoted,
)

MAX_WRAPPINGS = 3
"""A fragmented png is two layers of wrapping; nothing needs more."""
MAX_DETAIL_LENGTH = 200
LIGHT_BYTES = 32_768
"""A frame up to this size is read within a few milliseconds, unless more is wrapped in it."""
SIGNS_OF_MORE = (b"fragment", b"png", b"\\u")


class Conversation:
    """Understands what a rosbridge server sends over one connection.

    Args:
        max_bytes: The largest message that is taken, whole or in pieces.
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

        The last piece of a message completes all of it, and a small picture may hold a large text;
        an escape may hide that it does.
        """
        return len(frame) <= LIGHT_BYTES and not any(sign in frame for sign in SIGNS_OF_MORE)

    def receive(self, frame: Raw, *, is_text: bool) -> Event | None:
        """Return what a frame says, JSON in UTF-8 or CBOR; None while the message is incomplete."""
        try:
            decode = decode_json if is_text else decode_cbor
            return self._understand(self._checked(frame, decode), n_wrappings=0)
        except FrameError as error:
            return FrameRefused(error.fault, error.detail[:MAX_DETAIL_LENGTH])

    def _checked(self, frame: Raw, decode: Any) -> Any:  # noqa: ANN401 - ROS data enters here
        if len(frame) > self._max_bytes:
            raise FrameError(FrameFault.TOO_LARGE, f"{len(frame)} > {self._max_bytes} bytes")
        return decode(frame)

    def _understand(self, operation: Any, *, n_wrappings: int) -> Event | None:  # noqa: ANN401
        if not isinstance(operation, dict):
            raise FrameError(FrameFault.UNKNOWN_OPERATION, type(operation).__name__)
        match operation.get("op"):
            case "publish":
                return _published(operation)
            case "service_response":
                return _service_answered(operation)
            case "action_feedback":
                return _goal_fed_back(operation)
            case "action_result":
                return _goal_ended(operation)
            case "status":
                return _status_noted(operation)
            case "fragment" | "png" if n_wrappings < MAX_WRAPPINGS:
                return self._unwrap(operation, n_wrappings=n_wrappings + 1)
            case other:
                raise FrameError(FrameFault.UNKNOWN_OPERATION, str(other)[:40])

    def _unwrap(self, operation: dict[str, Any], *, n_wrappings: int) -> Event | None:
        frame: Raw | None
        if operation["op"] == "fragment":
            frame = self._fragments.add(operation)
            if frame is None:
                return None
        else:
            frame = decode_png(_text(operation, "data"))
        return self._understand(self._checked(frame, decode_json), n_wrappings=n_wrappings)


def _published(operation: dict[str, Any]) -> Published:
    message = operation.get("msg")
    if not isinstance(message, dict):
        raise FrameError(FrameFault.MISSING_FIELD, "msg")
    return Published(topic=_text(operation, "topic"), message=message)


def _service_answered(operation: dict[str, Any]) -> ServiceAnswered:
    return ServiceAnswered(
        call_id=_text(operation, "id"),
        # Old servers do not say; they answered only what succeeded.
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


def _text(operation: dict[str, Any], key: str) -> str:
    value = operation.get(key)
    if not isinstance(value, str):
        raise FrameError(FrameFault.MISSING_FIELD, key)
    return value
