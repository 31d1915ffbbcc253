"""Where records stand in a semantic map file, and what plain ones say, without a YAML parser."""

import json
import re
from dataclasses import dataclass

from mapspeak.memory.store.editing import is_plain, is_plain_in_flow
from mapspeak.memory.store.tree import Data

_LIST_KEY = re.compile(r"^waypoints:[ \t]*(?:#[^\n]*)?$", re.MULTILINE)
_CONTENT = re.compile(r"^( *)([^ #\n])", re.MULTILINE)
_UNUSUAL_BREAKS = "\r\x85\u2028\u2029"


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Where the records stand.

    Attributes:
        spans: From each dash's line to behind the record's last line; comments between records
            belong to none.
        indent: The column of the dashes.
        start: Of the first record; the end of the text where there is none.
        end: Of the last record and the comments behind it; likewise.
    """

    spans: tuple[tuple[int, int], ...]
    indent: int
    start: int
    end: int

    def skeleton(self, text: str) -> str:
        """Return the text without its records."""
        return text[: self.start] + text[self.end :]

    def offset_in_text(self, offset_in_skeleton: int) -> int:
        """Return where in the text a place of the skeleton stands."""
        is_before = offset_in_skeleton < self.start
        return offset_in_skeleton + (0 if is_before else self.end - self.start)


def find_records(text: str) -> Layout:
    """Find the records of a text whose lines end in a line feed."""
    key = _LIST_KEY.search(text)
    first = _CONTENT.search(text, key.end()) if key else None
    if first is None or any(each in text for each in _UNUSUAL_BREAKS):
        return whole(text)
    indent = len(first[1])
    item = rf" {{{indent}}}-(?=[ \t\n]|\Z)"
    # To look for line feeds is several times as fast as for ^.
    dash = re.compile(rf"\n{item}")
    if not dash.match(text, first.start() - 1):
        return whole(text)
    # What begins a line that belongs to no record.
    behind = re.compile(rf"\n(?!{item}) {{0,{indent}}}[^ #\n]")
    after = behind.search(text, first.start())
    end = after.start() + 1 if after else len(text)
    starts = [match.start() + 1 for match in dash.finditer(text, first.start() - 1, end)]
    ends = [*starts[1:], end]
    spans = tuple((a, _content_end(text, a, b, indent)) for a, b in zip(starts, ends, strict=True))
    return Layout(spans=spans, indent=indent, start=first.start(), end=end)


def whole(text: str) -> Layout:
    """Return the layout of a text whose records cannot be told apart by their dashes."""
    return Layout(spans=(), indent=2, start=len(text), end=len(text))


def _content_end(text: str, start: int, end: int, indent: int) -> int:
    """Cut blank lines, and comments that stand no further right than the dash, off the end."""
    while True:
        end = start + len(text[start:end].rstrip(" \t\n"))
        line_start = text.rfind("\n", start, end) + 1
        line = text[line_start:end].lstrip(" ")
        if not line.startswith("#") or end - line_start - len(line) > indent or line_start <= start:
            break
        end = line_start
    line_end = text.find("\n", end)
    return len(text) if line_end < 0 else line_end + 1


_ENTRY = re.compile(r"([a-z_]+):(?: +(\S.*))?")
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
_TIME = re.compile(r"\d{4}-\d\d-\d\dT[\d:.]+(?:Z|[+-]\d\d:\d\d)")
_QUOTED = re.compile(r'"(?:[^"\\]|\\["\\n])*"')


class _UnsureError(Exception):
    """This text needs the YAML parser."""


def read_plain_record(block: str) -> dict[str, Data] | None:
    """Return what one item of the list `waypoints` says; None when a YAML parser must decide."""
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
