"""Messages of rclpy as plain values, and plain values as messages."""

import array
import base64
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from mapspeak.links.rclpy.types import (
    BYTES,
    NUMBERS,
    FieldType,
    fields_of,
    find_message,
    name_of,
    write_definition,
)
from mapspeak.ros.definitions import TypeBook, check_message

Reader = Callable[[Any], Any]


def read_message(message: Any) -> dict[str, Any]:  # noqa: ANN401 - rclpy has no types
    """Return a message as rosbridge does: uint8[] as bytes, other numbers as numpy arrays."""
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


RosMessage = Any  # rclpy has no types


def write_message(message_class: Any, values: object) -> RosMessage:  # noqa: ANN401
    """Return a message with the values of a mapping; the fields it leaves out keep their defaults.

    Raises:
        LinkError: Something does not fit; says which field.
    """
    checked = check_message(_book_of(message_class), name_of(message_class), values)
    return _fill(message_class, checked)


@cache
def _book_of(message_class: Any) -> TypeBook:  # noqa: ANN401 - rclpy has no types
    texts: dict[str, str] = {}
    _describe(message_class, texts)
    return TypeBook(texts)


def _describe(message_class: Any, texts: dict[str, str]) -> None:  # noqa: ANN401 - likewise
    fields = fields_of(message_class)
    texts[name_of(message_class)] = write_definition(message_class)
    for kind in fields.values():
        if kind.is_message and kind.base not in texts:
            _describe(find_message(kind.base), texts)


def _fill(message_class: Any, values: Mapping[str, Any]) -> RosMessage:  # noqa: ANN401 - likewise
    message = message_class()
    fields = fields_of(message_class)
    for name, value in values.items():
        setattr(message, name, _write_field(fields[name], value, getattr(message, name)))
    return message


def _write_field(kind: FieldType, value: Any, default: Any) -> Any:  # noqa: ANN401
    if kind.is_list and isinstance(value, str):
        value = base64.b64decode(value, validate=True)
    if kind.is_list and kind.base in NUMBERS:
        return _write_numbers(value, default)
    if kind.is_message:
        inner = find_message(kind.base)
        return [_fill(inner, each) for each in value] if kind.is_list else _fill(inner, value)
    if kind.base == "octet":
        octets = [bytes([each % 256]) for each in (value if kind.is_list else [value])]
        return octets if kind.is_list else octets[0]
    return value.tolist() if isinstance(value, np.ndarray) else value


def _write_numbers(values: Any, default: Any) -> Any:  # noqa: ANN401
    """Return many numbers as rclpy keeps them."""
    is_fixed = isinstance(default, np.ndarray)
    dtype = default.dtype if is_fixed else np.dtype(default.typecode)
    if isinstance(values, bytes | bytearray | memoryview):
        values = np.frombuffer(values, np.uint8)
    packed = np.ascontiguousarray(values, dtype=dtype)
    return packed if is_fixed else array.array(default.typecode, packed.tobytes())
