"""ROS messages and lists as a model reads them: short, whatever they hold, a page at a time."""

import fnmatch
import json
import math
import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import anyio
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from mapspeak.ros.port import RosConnection

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


def show_message(message: Mapping[str, Any]) -> str:
    """Return a message's fields, one to a line; large lists by their size, range and beginning."""
    if not message:
        return "(a message without fields)"
    lines: list[str] = []
    for name, value in message.items():
        lines += _lines(str(name), value, 0)
    return cut("\n".join(lines), most=LONGEST_MESSAGE)


def show_value(value: object) -> str:
    """Return a value on one line."""
    return cut(_inline(value, 0), most=LONGEST_MESSAGE)


def cut(text: str, *, most: int = LONGEST_ANSWER) -> str:
    """Return the first letters of a text, and say how many there were."""
    if len(text) <= most:
        return text
    return f"{text[: most - 60]}\n... cut: {len(text):,} letters in all."


def _lines(name: str, value: object, depth: int) -> list[str]:
    short = f"{INDENT * depth}{name}: {_inline(value, depth)}"
    if len(short) <= LONGEST_LINE or depth > MOST_NESTED:
        return [short]
    if isinstance(value, Mapping):
        inner = [line for key, each in value.items() for line in _lines(str(key), each, depth + 1)]
        return [f"{INDENT * depth}{name}:", *inner]
    if isinstance(value, list | tuple) and any(isinstance(each, Mapping) for each in value):
        lines = [f"{INDENT * depth}{name}: {len(value)} in a list"]
        for number, each in enumerate(value[:MOST_ITEMS]):
            lines += _lines(f"[{number}]", each, depth + 1)
        return lines
    return [short]


def _inline(value: object, depth: int) -> str:
    if isinstance(value, Mapping):
        return _inline_mapping(value, depth)
    if isinstance(value, list | tuple):
        return _inline_list(value, depth)
    return _show_plain(value)


def _show_plain(value: object) -> str:
    match value:
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
    if value and all(isinstance(each, NUMBERS | None) for each in value):
        return _show_numbers(value)
    most = MOST_WORDS if all(isinstance(each, str) for each in value) else MOST_ITEMS
    shown = [_inline(each, depth + 1) for each in value[:most]]
    if len(value) > most:
        shown.append(f"... {len(value) - most:,} more")
    return f"[{', '.join(shown)}]"


def _show_numbers(values: Sequence[Any]) -> str:
    """Return a list of numbers; ROS 1 writes NaN and infinity as null."""
    try:
        numbers = np.array([math.nan if each is None else each for each in values], dtype=float)
    except (OverflowError, ValueError):
        return f"[{len(values):,} numbers]"
    if len(values) <= MOST_NUMBERS:
        return f"[{', '.join(_inline(each, 0) for each in values)}]"
    return _show_array(numbers)


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


PAGE_SIZE = 40

Filter = Annotated[
    str | None,
    Field(description='part of a name, or a pattern: "scan", "/robot1/*"', max_length=200),
]
Page = Annotated[int, Field(description="1 is the first", ge=1, le=1000)]


def match_names(names: Mapping[str, str] | Sequence[str], pattern: str | None) -> list[str]:
    """Return the names that a pattern fits; one without a star fits any part.

    Args:
        names: Those of a mapping are also chosen by the words of the lines that tell them.
        pattern: None fits all.
    """
    lines = names if isinstance(names, Mapping) else {name: name for name in names}
    if not pattern:
        return list(lines)
    wanted = (pattern if any(sign in pattern for sign in "*?[") else f"*{pattern}*").lower()
    return [name for name, line in lines.items() if fnmatch.filter(_words(line), wanted)]


def _words(line: str) -> list[str]:
    """Return the words of a line, types also as "package/Type"."""
    words = line.lower().split()
    return [*words, *(re.sub("/(msg|action)/", "/", each) for each in words)]


def list_page(
    what: str, lines: Mapping[str, str], pattern: str | None, page: int, n_all: int | None = None
) -> str:
    """Return a heading and a page of lines.

    Args:
        what: The items are, in the plural.
        lines: By name: all, or those that were chosen already.
        pattern: Fits the names that are told.
        page: 1 is the first.
        n_all: How many there are to choose from; None where all are given.
    """
    names = match_names(lines, pattern)
    n_all = len(lines) if n_all is None else n_all
    of_all = "" if len(names) == n_all else f" of {n_all}"
    head = f"{what}: {len(names)}{of_all}"
    n_pages = max(1, -(-len(names) // PAGE_SIZE))
    if page > n_pages:
        last = "the only one" if n_pages == 1 else "the last"
        return f"{head}. There is no page {page}: page {n_pages} is {last}."
    if n_pages > 1:
        head += f", page {page} of {n_pages}"
    shown = names[(page - 1) * PAGE_SIZE : page * PAGE_SIZE]
    return "\n".join([head, *(lines[name] for name in shown)])


def say_loss(connection: RosConnection, *, since_s: float) -> str:
    """Say that the connection is lost, or was lost after a moment; empty where it held.

    Args:
        connection: To the robot.
        since_s: That moment, by the event loop's clock; minus infinity where nothing was asked or
            heard before.
    """
    lost_s = connection.lost_for_s
    if lost_s is not None:
        return (
            f"The connection was lost {lost_s:.1f} s ago and is not back yet: this is as old as "
            "that."
        )
    up_s = connection.connected_for_s
    if up_s is not None and anyio.current_time() - up_s > since_s > -math.inf:
        return (
            f"The connection was lost meanwhile and is back since {up_s:.1f} s: what came before "
            "may be old."
        )
    return ""
