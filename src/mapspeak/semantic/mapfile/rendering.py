"""Writes values as YAML that people like to read, and that reads back the same."""

import json
import re

from mapspeak.semantic.mapfile.tree import Data

MAX_COLUMNS = 100
"""A list that would be wider stands with one item a line."""

_BARE_KEYS = frozenset(
    {"x", "y", "yaw_deg", "bearing_deg", "range_m", "stamp_s", "recorded_at", "from", "until"}
)
"""Their values are numbers or times, and stand without quotes."""

_OTHER_MEANING = frozenset({"true", "false", "yes", "no", "on", "off", "null", "y", "n"})
_SPECIAL_IN_BLOCK = re.compile(r":(?= |$)| #")
_SPECIAL_IN_FLOW = re.compile(r"[,\[\]{}:#?]")


def is_plain(text: str) -> bool:
    """True when every YAML reader takes the unquoted text, on a line of its own, for itself."""
    return (
        text[:1].isalpha()
        and text.isprintable()
        and not text.endswith(" ")
        and not _SPECIAL_IN_BLOCK.search(text)
        and text.casefold() not in _OTHER_MEANING
    )


def is_plain_in_flow(text: str) -> bool:
    """True when every YAML reader takes the unquoted text, within brackets, for itself."""
    return is_plain(text) and not _SPECIAL_IN_FLOW.search(text)


def flow_text(data: Data, key: str = "") -> str:
    """Gives a value on one line; the key it stands under says whether it is a number."""
    if data is None:
        return "null"
    if isinstance(data, str):
        return data if key in _BARE_KEYS or is_plain_in_flow(data) else _quoted(data)
    if isinstance(data, list):
        return f"[{', '.join(flow_text(item) for item in data)}]"
    entries = (f"{name}: {flow_text(value, name)}" for name, value in data.items())
    return f"{{{', '.join(entries)}}}"


def line_text(data: Data, key: str = "") -> str:
    """Gives a value that ends its line, outside of brackets."""
    if isinstance(data, str) and is_plain(data):
        return data
    return flow_text(data, key)


def entry_text(key: str, data: Data, *, indent: int) -> str:
    """Gives `key: value` without the first line's indentation, over several lines where needed."""
    below = "\n" + " " * (indent + 2)
    if isinstance(data, str) and "\n" in data:
        lines = (below + line if line else "\n" for line in data.split("\n"))
        return f"{key}: |-{''.join(lines)}"
    if isinstance(data, list) and _is_better_below(data, len(key) + indent):
        return f"{key}:" + "".join(f"{below}- {line_text(item)}" for item in data)
    return f"{key}: {line_text(data, key)}"


def record_text(data: dict[str, Data], *, indent: int) -> str:
    """Gives one waypoint as an item of the list `waypoints`, with its final line break."""
    margin = " " * (indent + 2)
    entries = [entry_text(key, value, indent=indent + 2) for key, value in data.items()]
    return " " * indent + "- " + f"\n{margin}".join(entries) + "\n"


def _is_better_below(items: list[Data], used_columns: int) -> bool:
    has_mapping = any(isinstance(item, dict) for item in items)
    return has_mapping or used_columns + len(flow_text(items)) > MAX_COLUMNS


def _quoted(text: str) -> str:
    # JSON's quotes are YAML's, except for characters that JSON would write as a surrogate pair.
    return json.dumps(text, ensure_ascii=False)
