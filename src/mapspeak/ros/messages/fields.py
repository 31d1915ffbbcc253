"""The fields of a ROS message, taken out one by one: what does not fit is a `LinkError`."""

import base64
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError

Message = Mapping[str, Any]
"""A ROS message as rosbridge gives it: fields by name, arrays as lists, bytes or numpy arrays."""

HINT = "The topic may be of another type than expected: look its type up on the robot."


BASE64_PART = 400_000
"""Characters decoded in one go, a multiple of four: other threads may run in between."""


def decode_base64(text: str) -> bytes:
    """Return the bytes of a base64 text.

    Raises:
        ValueError: It holds other characters.
    """
    parts = (text[start : start + BASE64_PART] for start in range(0, len(text), BASE64_PART))
    return b"".join(base64.b64decode(part, validate=True) for part in parts)


def misfit(name: str, value: object, wanted: str) -> LinkError:
    """Return the error for a field that holds something else."""
    return LinkError(f"A ROS message's field {name!r} is {_shown(value)}, not {wanted}.", hint=HINT)


def _shown(value: object) -> str:
    """Return a value shortly: a hostile message may hold megabytes, and a model would read them."""
    match value:
        case int() if value.bit_length() > 128:
            return "a huge number"
        case str():
            return repr(value if len(value) <= 40 else f"{value[:37]}...")
        case int() | float() | None:
            return repr(value)
        case _:
            return f"a {type(value).__name__}"


def part_of(message: object, name: str) -> Message:
    """Return a field that is a message itself."""
    value = _field(message, name)
    if not isinstance(value, Mapping):
        raise misfit(name, value, "a message")
    return value


def parts_of(message: object, name: str) -> Sequence[object]:
    """Return a field that is a list."""
    value = _field(message, name)
    if not isinstance(value, list | tuple):
        raise misfit(name, value, "a list")
    return value


def text_of(message: object, name: str) -> str:
    """Return a field that is a text."""
    value = _field(message, name)
    if not isinstance(value, str):
        raise misfit(name, value, "a text")
    return value


def number_of(message: object, name: str) -> float:
    """Return a field that is a finite number; ROS 1 writes NaN and infinity as null."""
    value = _field(message, name)
    if isinstance(value, bool) or not isinstance(value, int | float | np.floating | np.integer):
        raise misfit(name, value, "a finite number")
    try:
        number = float(value)
    except OverflowError:
        raise misfit(name, value, "a finite number") from None
    if not math.isfinite(number):
        raise misfit(name, value, "a finite number")
    return number


def whole_of(message: object, name: str, *, low: int, high: int) -> int:
    """Return a field that is a whole number between two limits, both included."""
    value = _field(message, name)
    wanted = f"a whole number from {low} to {high}"
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise misfit(name, value, wanted)
    if not low <= value <= high:
        raise misfit(name, value, wanted)
    return int(value)


def floats_of(message: object, name: str) -> NDArray[np.float64]:
    """Return a field that is a list of numbers; null is NaN, as ROS 1 writes it."""
    value = _field(message, name)
    if isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "iuf":
        return value.astype(np.float64)
    is_list = isinstance(value, list | tuple)
    if not is_list or not set(map(type, value)) <= {int, float, type(None)}:
        raise misfit(name, value, "a list of numbers")
    try:
        return np.array(value, dtype=np.float64)
    except (OverflowError, ValueError, TypeError):
        raise misfit(name, value, "a list of numbers") from None


def _field(message: object, name: str) -> Any:  # noqa: ANN401 - ROS JSON enters here
    if not isinstance(message, Mapping):
        raise LinkError(f"A ROS message is a {type(message).__name__}, not an object.", hint=HINT)
    if name not in message:
        raise LinkError(f"A ROS message has no field {name!r}.", hint=HINT)
    return message[name]
