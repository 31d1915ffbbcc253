"""ROS messages and their values as a model reads them: short, whatever they hold."""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

LONGEST_ANSWER = 20_000
"""No answer has more letters; most have a tenth of that."""
LONGEST_LINE = 90
LONGEST_TEXT = 200
LONGEST_MESSAGE = 3_000
MOST_NUMBERS = 9
MOST_ITEMS = 3
MOST_WORDS = 20
MOST_NESTED = 10
INDENT = "  "
TIMES = ({"sec", "nanosec"}, {"secs", "nsecs"})
NUMBERS = int | float | np.integer | np.floating
KINDS = (
    "not set", "bool", "integer", "double", "string",
    "bytes", "bools", "integers", "doubles", "strings",
)  # fmt: skip
"""By rcl_interfaces/ParameterType."""
PLAIN = {bool: "true or false", int: "a number", float: "a number", str: "a text"}


def cut(text: str, *, most: int = LONGEST_ANSWER) -> str:
    """Return the first letters of a text, and say how many there were."""
    if len(text) <= most:
        return text
    return f"{text[: most - 60]}\n... cut: {len(text):,} letters in all."


def show_message(message: Mapping[str, Any]) -> str:
    """Return a message's fields, one to a line; large lists by their size, range and beginning."""
    lines = [line for name, value in message.items() for line in _lines(str(name), value, 0)]
    return cut("\n".join(lines or ["(a message without fields)"]), most=LONGEST_MESSAGE)


def show_value(value: object) -> str:
    """Return a value on one line."""
    return cut(_inline(value, 0), most=LONGEST_MESSAGE)


def _lines(name: str, value: object, depth: int) -> list[str]:
    head = f"{INDENT * depth}{name}:"
    short = f"{head} {_inline(value, depth)}"
    if len(short) <= LONGEST_LINE or depth > MOST_NESTED:
        return [short]
    if isinstance(value, Mapping):
        inner: dict[str, object] = {str(key): each for key, each in value.items()}
    elif isinstance(value, list | tuple) and any(isinstance(each, Mapping) for each in value):
        head = f"{head} {len(value)} in a list"
        inner = {f"[{number}]": each for number, each in enumerate(value[:MOST_ITEMS])}
    else:
        return [short]
    return [head, *(line for key, each in inner.items() for line in _lines(key, each, depth + 1))]


def _inline(value: object, depth: int) -> str:
    match value:
        case Mapping():
            shown = _inline_mapping(value, depth)
        case list() | tuple():
            shown = _inline_list(value, depth)
        case np.ndarray():
            shown = _show_array(value)
        case bytes() | bytearray() | memoryview():
            shown = f"[{len(value):,} bytes]"
        case str():
            shown = _show_text(value)
        case bool() | np.bool_():
            shown = str(bool(value)).lower()
        case int() | float() | np.integer() | np.floating():
            shown = _show_number(value)
        case _:
            shown = "null" if value is None else f"({type(value).__name__})"
    return shown


def _inline_mapping(value: Mapping[Any, Any], depth: int) -> str:
    if set(value) in TIMES:
        whole, rest = value.values()
        if isinstance(whole, int) and isinstance(rest, int) and abs(whole) < 1e12:
            return f"{whole + rest / 1e9:.3f} s"
    if depth > MOST_NESTED:
        return "{...}"
    return f"{{{', '.join(f'{key}: {_inline(each, depth + 1)}' for key, each in value.items())}}}"


def _inline_list(value: Sequence[Any], depth: int) -> str:
    is_numbers = all(isinstance(each, NUMBERS | None) for each in value)
    if is_numbers and len(value) > MOST_NUMBERS:
        try:  # ROS 1 writes NaN and infinity as null.
            return _show_array(np.array([math.nan if x is None else x for x in value], dtype=float))
        except (OverflowError, ValueError):
            return f"[{len(value):,} numbers]"
    most = MOST_WORDS if all(isinstance(each, str) for each in value) else MOST_ITEMS
    most = MOST_NUMBERS if is_numbers else most
    more = [f"... {len(value) - most:,} more"] if len(value) > most else []
    return f"[{', '.join([*(_inline(each, depth + 1) for each in value[:most]), *more])}]"


def _show_array(values: NDArray[Any]) -> str:
    flat = values.ravel()
    if flat.dtype.kind not in "iufb":
        return f"[{flat.size:,} values]"
    if flat.size <= MOST_NUMBERS:
        return f"[{', '.join(_show_number(each) for each in flat)}]"
    finite = flat[np.isfinite(flat)]
    shape = f"{flat.size:,} numbers" if values.ndim == 1 else f"numbers, shape {values.shape}"
    if not finite.size:
        return f"[{shape}, none finite]"
    low, high = finite.min(), finite.max()
    odd = f", {flat.size - finite.size:,} not finite" if finite.size < flat.size else ""
    if low == high:
        return f"[{shape}, all {_show_number(low)}{odd}]"
    first = ", ".join(_show_number(each) for each in flat[:3])
    return f"[{shape}, {_show_number(low)} to {_show_number(high)}{odd}; first {first}]"


def _show_number(value: NUMBERS) -> str:
    if isinstance(value, int | np.integer):
        return str(value) if abs(int(value)) < 2**64 else "a huge number"
    return f"{float(value):.6g}"


def _show_text(text: str) -> str:
    # On one line, whatever is in it: a text must not look like another field.
    if len(text) <= LONGEST_TEXT:
        return json.dumps(text, ensure_ascii=False)
    shown = json.dumps(f"{text[:LONGEST_TEXT]}...", ensure_ascii=False)
    return f"{shown} ({len(text):,} letters)"


def say_descriptor(entry: Mapping[str, Any]) -> str:
    """Return an rcl_interfaces/ParameterDescriptor in brackets; empty where it says nothing."""
    kind = entry.get("type")
    parts = [KINDS[kind]] if isinstance(kind, int) and 0 <= kind < len(KINDS) else []
    parts += ["read only"] if entry.get("read_only") is True else []
    for key in ("floating_point_range", "integer_range"):
        for limits in entry.get(key) or []:
            if isinstance(limits, Mapping):
                parts.append(f"{limits.get('from_value')} to {limits.get('to_value')}")
    texts = (entry.get("description"), entry.get("additional_constraints"))
    parts += [show_value(text) for text in texts if text]
    return f" ({', '.join(parts)})" if parts else ""


def say_kind(value: object) -> str:
    """Return the kind of a parameter's value."""
    return PLAIN.get(type(value), "a list or a table")
