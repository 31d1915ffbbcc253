"""Mappings as messages of rclpy, which itself looks at nothing: what does not fit is refused here.

A wrong value within a message could end the whole program when ROS packs it.
"""

import array
import base64
import binascii
import difflib
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mapspeak.errors import LinkError
from mapspeak.links.ros2.fields import BYTES, NUMBERS, FieldType, fields_of
from mapspeak.links.ros2.types import find_message, name_of

LARGEST_FLOAT32 = float(np.finfo(np.float32).max)
MOST_SHOWN = 40
WHOLES = {
    f"{sign}int{n_bits}": (0 if sign else -(2 ** (n_bits - 1)), 2 ** (n_bits - (not sign)) - 1)
    for sign in ("", "u")
    for n_bits in (8, 16, 32, 64)
} | {"octet": (0, 255)}

RosMessage = Any  # rclpy has no types


def write_message(message_class: Any, values: Any, *, path: str = "") -> RosMessage:  # noqa: ANN401
    """Gives a message with the values of a mapping; the fields it leaves out keep their defaults.

    Args:
        message_class: Of rclpy.
        values: Fields by name.
        path: Of the message within another one, for what an error says.

    Raises:
        LinkError: Something does not fit; says which field.
    """
    message = message_class()
    fields = fields_of(message_class)
    if not isinstance(values, Mapping):
        raise _misfit(path or "The message", f"an object ({name_of(message_class)})", values)
    for name, value in values.items():
        if name not in fields:
            raise _stranger(str(name), message_class, path)
        inner = f"{path}.{name}" if path else name
        setattr(message, name, _write_field(fields[name], value, getattr(message, name), inner))
    return message


def _write_field(kind: FieldType, value: Any, default: Any, path: str) -> Any:  # noqa: ANN401
    if not kind.is_list:
        return _write_one(kind, value, type(default), path)
    values = _as_sequence(kind, value, path)
    n_values = len(values)
    is_short = kind.length is not None and n_values != kind.length
    if is_short or (kind.most is not None and n_values > kind.most):
        raise _misfit(path, kind.definition, f"{n_values} values")
    if kind.base in NUMBERS:
        return _write_numbers(kind, values, default, path)
    inner = find_message(kind.base) if kind.is_message else None
    return [
        _write_one(kind, each, inner, f"{path}[{number}]") for number, each in enumerate(values)
    ]


def _as_sequence(kind: FieldType, value: Any, path: str) -> Any:  # noqa: ANN401
    if isinstance(value, str) and kind.base in BYTES:
        try:
            return base64.b64decode(value, validate=True)
        except binascii.Error:
            raise _misfit(path, "bytes in base64, or a list", value) from None
    if isinstance(value, bytes | bytearray) and kind.base in BYTES:
        return value
    if not isinstance(value, list | tuple) and not (isinstance(value, np.ndarray) and value.ndim):
        raise _misfit(path, f"a list ({kind.definition})", value)
    return value


def _write_numbers(kind: FieldType, values: Any, default: Any, path: str) -> Any:  # noqa: ANN401
    """Gives many numbers as rclpy keeps them; those in arrays already are looked at as a whole."""
    if isinstance(values, list | tuple):
        # One by one: numpy would quietly take True for 1, and cut fractions off.
        values = [
            _write_one(kind, each, None, f"{path}[{number}]") for number, each in enumerate(values)
        ]
    dtype = default.dtype if isinstance(default, np.ndarray) else np.dtype(default.typecode)
    given = np.frombuffer(values, np.uint8) if isinstance(values, bytes | bytearray) else values
    numbers = np.asarray(given, dtype=None if len(given) else dtype)
    _check_range(kind, numbers, path)
    packed = np.ascontiguousarray(numbers.astype(dtype, copy=False))
    if isinstance(default, np.ndarray):
        return packed
    return array.array(default.typecode, packed.tobytes())


def _check_range(kind: FieldType, numbers: "np.typing.NDArray[Any]", path: str) -> None:
    is_float = kind.base in ("float", "double")
    if numbers.ndim != 1 or numbers.dtype.kind not in ("iuf" if is_float else "iu"):
        raise _misfit(path, f"a list of numbers ({kind.definition})", numbers.dtype)
    if not numbers.size:
        return
    for extreme in (numbers.min(), numbers.max()):
        _write_one(kind, extreme.item(), None, path)


def _write_one(kind: FieldType, value: Any, inner: Any, path: str) -> Any:  # noqa: ANN401
    if kind.is_message:
        return write_message(inner, value, path=path)
    if kind.base in ("float", "double"):
        return _write_float(kind, value, path)
    if kind.base in WHOLES:
        whole = _write_whole(kind, value, path)
        return bytes([whole]) if kind.base == "octet" else whole
    if kind.base == "boolean":
        if not isinstance(value, bool | np.bool_):
            raise _misfit(path, "true or false", value)
        return bool(value)
    return _write_text(kind, value, path)


def _write_float(kind: FieldType, value: Any, path: str) -> float:  # noqa: ANN401
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        raise _misfit(path, f"a number ({kind.definition})", value)
    try:
        number = float(value)
    except (OverflowError, TypeError):
        number = math.inf
    is_too_large = kind.base == "float" and abs(number) > LARGEST_FLOAT32
    if not math.isfinite(number) or is_too_large:
        raise _misfit(path, f"a finite number ({kind.definition})", value)
    return number


def _write_whole(kind: FieldType, value: Any, path: str) -> int:  # noqa: ANN401
    low, high = WHOLES[kind.base]
    is_whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not is_whole or not low <= value <= high:
        raise _misfit(path, f"a whole number from {low} to {high} ({kind.definition})", value)
    return int(value)


def _write_text(kind: FieldType, value: Any, path: str) -> str:  # noqa: ANN401
    is_text = isinstance(value, str) and not any(
        sign == "\0" or "\ud800" <= sign <= "\udfff" for sign in value
    )
    if not is_text or (kind.most_letters is not None and len(value) > kind.most_letters):
        raise _misfit(path, f"a text ({kind.definition})", value)
    text: str = value
    return text


def _stranger(name: str, message_class: Any, path: str) -> LinkError:  # noqa: ANN401
    fields = fields_of(message_class)
    near = difflib.get_close_matches(name, fields, n=1)
    meant = f" Did you mean {near[0]}?" if near else ""
    full = f"{path}.{name}" if path else name
    known = ", ".join(f"{each} ({kind.definition})" for each, kind in fields.items())
    return LinkError(
        f"{name_of(message_class)} has no field {full[:80]!r}.{meant}",
        hint=f"Its fields are {known}.",
    )


def _misfit(path: str, wanted: str, value: object) -> LinkError:
    shown = value if isinstance(value, str) and value.endswith(" values") else repr(value)
    if len(shown) > MOST_SHOWN:
        shown = f"{shown[: MOST_SHOWN - 3]}..."
    return LinkError(
        f"{path} wants {wanted}, not {shown}.", hint="Correct that field and send again."
    )
