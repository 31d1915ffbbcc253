"""Where records stand in a semantic map file, and what plain ones say, without a YAML parser."""

import json
import re
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from operator import itemgetter

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
    if first is None or _has_unusual_breaks(text):
        return whole(text)
    indent, start = len(first[1]), first.start()
    end = _list_end(text, start, len(text), indent)
    spans = _spans(text, start, end, indent)
    if not spans or spans[0][0] != start:
        return whole(text)
    return Layout(spans=spans, indent=indent, start=start, end=end)


@dataclass(frozen=True, slots=True, kw_only=True)
class Relocation:
    """Where the records stand after a text was changed among them.

    Attributes:
        n_before: So many records in front of the change are what they were.
        n_behind: So many behind it, likewise.
    """

    layout: Layout
    n_before: int
    n_behind: int


def find_records_again(text: str, *, old_text: str, old: Layout) -> Relocation | None:
    """Find the records of a text of which most was looked at before.

    Returns:
        None where something in front of them changed, or the way in which they are laid out.
    """
    n_head, n_tail = _count_shared(old_text, text)
    longer, stop = len(text) - len(old_text), len(old_text) - n_tail
    if not old.spans or n_head <= old.start:
        return None
    # One record earlier, which may go on where its neighbour lost its dash.
    n_before = max(bisect_right(old.spans, n_head, key=itemgetter(0)) - 2, 0)
    behind = old.spans[bisect_right(old.spans, stop, key=itemgetter(0)) :]
    start = old.spans[n_before][0]
    stop = behind[0][0] + longer if behind else len(text)
    end = _list_end(text, start, stop, old.indent)
    spans = _spans(text, start, end, old.indent)
    is_cut = bool(spans) and spans[0][0] == start
    if not is_cut or (behind and end != stop) or _has_unusual_breaks(text[start:stop]):
        return None
    layout = Layout(
        spans=(*old.spans[:n_before], *spans, *((a + longer, b + longer) for a, b in behind)),
        indent=old.indent,
        start=old.start,
        end=old.end + longer if behind else end,
    )
    return Relocation(layout=layout, n_before=n_before, n_behind=len(behind))


def _has_unusual_breaks(text: str) -> bool:
    return any(each in text for each in _UNUSUAL_BREAKS)


def _item(indent: int) -> str:
    return rf" {{{indent}}}-(?=[ \t\n]|\Z)"


def _list_end(text: str, start: int, end: int, indent: int) -> int:
    """Return where the first line begins that belongs to no record."""
    # To look for line feeds is several times as fast as for ^.
    behind = re.compile(rf"\n(?!{_item(indent)}) {{0,{indent}}}[^ #\n]")
    after = behind.search(text, start, end)
    return after.start() + 1 if after else end


def _spans(text: str, start: int, end: int, indent: int) -> tuple[tuple[int, int], ...]:
    dashes = re.compile(rf"\n{_item(indent)}").finditer(text, start - 1, end)
    starts = [match.start() + 1 for match in dashes]
    ends = [*starts[1:], end][: len(starts)]
    return tuple((a, _content_end(text, a, b, indent)) for a, b in zip(starts, ends, strict=True))


def _count_shared(first: str, second: str) -> tuple[int, int]:
    """Return how many characters two texts share at their beginning, and of the rest at the end."""
    n_most = min(len(first), len(second))
    n_head = _bisect_shared(n_most, lambda a, b: first[a:b] == second[a:b])
    i, j = len(first), len(second)
    n_tail = _bisect_shared(
        n_most - n_head, lambda a, b: first[i - b : i - a] == second[j - b : j - a]
    )
    return n_head, n_tail


def _bisect_shared(n_most: int, is_shared: Callable[[int, int], bool]) -> int:
    n_shared = 0
    while n_shared < n_most:
        middle = (n_shared + n_most + 1) // 2
        if is_shared(n_shared, middle):
            n_shared = middle
        else:
            n_most = middle - 1
    return n_shared


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
    _sure(dash and not margin.strip(" ") and "".join(lines).isprintable())
    record: dict[str, Data] = {}
    items: list[Data] | None = None
    entry_margin, item_margin = f"{margin}  ", f"{margin}    - "
    for line in (entry_margin + first_entry, *lines[1:]):
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
