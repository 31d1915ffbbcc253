"""Reads records laid out as mapspeak lays them out, many times as fast as a YAML parser.

It answers only where it is sure to agree with `tree.parse_tree`, else None; a test holds the two
against each other.
"""

import json
import re

from mapspeak.semantic.mapfile.rendering import is_plain, is_plain_in_flow
from mapspeak.semantic.mapfile.tree import Data

_ENTRY = re.compile(r"([a-z_]+):(?: +(\S.*))?")
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
_TIME = re.compile(r"\d{4}-\d\d-\d\dT[\d:.]+(?:Z|[+-]\d\d:\d\d)")
_QUOTED = re.compile(r'"(?:[^"\\]|\\["\\n])*"')


class _UnsureError(Exception):
    """This text needs the YAML parser."""


def read_record(block: str) -> dict[str, Data] | None:
    """Gives what one item of the list `waypoints` says; None when a YAML parser must decide."""
    try:
        return _read_lines(block.rstrip("\n").split("\n"))
    except _UnsureError:
        return None


def _read_lines(lines: list[str]) -> dict[str, Data]:
    margin, dash, first_entry = lines[0].partition("- ")
    _sure(dash and not margin.strip(" "))
    record: dict[str, Data] = {}
    items: list[Data] | None = None
    entry_margin, item_margin = f"{margin}  ", f"{margin}    - "
    for line in (entry_margin + first_entry, *lines[1:]):
        _sure(line.isprintable())
        if line.startswith(item_margin) and items is not None:
            items.append(_read_value(line.removeprefix(item_margin)))
            continue
        key, value = _read_entry(line, entry_margin)
        _sure(items != [] and key not in record)
        items = [] if value is None else None
        record[key] = items if value is None else _read_value(value)
    _sure(items != [])
    return record


def _read_entry(line: str, margin: str) -> tuple[str, str | None]:
    entry = _ENTRY.fullmatch(line, len(margin))
    if entry is None or not line.startswith(margin):
        raise _UnsureError
    return entry[1], entry[2]


def _read_value(text: str) -> Data:
    if text == "[]":
        return []
    if text.startswith("[") and text.endswith("]"):
        return [_read_flow_scalar(item) for item in text[1:-1].split(", ")]
    if text.startswith("{") and text.endswith("}"):
        return _read_flow_mapping(text[1:-1])
    if _QUOTED.fullmatch(text):
        return str(json.loads(text))
    _sure(is_plain(text) or _NUMBER.fullmatch(text) or _TIME.fullmatch(text))
    return text


def _read_flow_mapping(text: str) -> Data:
    mapping: dict[str, Data] = {}
    for part in text.split(", "):
        entry = _ENTRY.fullmatch(part)
        if entry is None or entry[2] is None or entry[1] in mapping:
            raise _UnsureError
        mapping[entry[1]] = _read_flow_scalar(entry[2])
    return mapping


def _read_flow_scalar(text: str) -> str:
    _sure(is_plain_in_flow(text) or _NUMBER.fullmatch(text) or _TIME.fullmatch(text))
    return text


def _sure(is_sure: object) -> None:
    if not is_sure:
        raise _UnsureError
