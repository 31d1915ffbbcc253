"""Messages of rclpy as mappings: arrays are taken over as they lie in memory."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from mapspeak.links.ros2.fields import BYTES, NUMBERS, FieldType, fields_of

Reader = Callable[[Any], Any]


def read_message(message: Any) -> dict[str, Any]:  # noqa: ANN401 - rclpy has no types
    """Gives a message as rosbridge does: uint8[] as bytes, other numbers as numpy arrays."""
    return {
        name: getattr(message, name) if read is None else read(getattr(message, name))
        for name, read in _readers_of(message.__class__)
    }


@cache
def _readers_of(message_class: Any) -> tuple[tuple[str, Reader | None], ...]:  # noqa: ANN401
    return tuple((name, _reader_of(kind)) for name, kind in fields_of(message_class).items())


def _reader_of(kind: FieldType) -> Reader | None:
    if kind.is_message:
        return _read_all if kind.is_list else read_message
    if kind.base == "octet":
        return _join if kind.is_list else _read_octet
    if not kind.is_list:
        return None
    if kind.base in BYTES:
        return bytes
    return np.asarray if kind.base in NUMBERS else list


def _read_all(messages: Any) -> list[dict[str, Any]]:  # noqa: ANN401 - rclpy has no types
    return [read_message(message) for message in messages]


def _join(octets: Any) -> bytes:  # noqa: ANN401 - likewise
    return b"".join(octets)


def _read_octet(octet: bytes) -> int:
    return octet[0]
