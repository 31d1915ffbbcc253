"""Where records stand in a semantic map file, and what plain ones say, without a YAML parser.

A YAML parser needs a second for a thousand waypoints. So the text is cut at its keys and at the
dashes of its lists, and what mapspeak wrote itself is read by a few patterns.
"""

import json
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass

from mapspeak.memory.store.yamltext import Data
from mapspeak.memory.store.yamlwriting import is_plain, is_plain_in_flow

_KEY = re.compile(r"""\n["']?([A-Za-z_]\w*)["']?[ \t]*:(?=[ \t\n]|\Z)""")
_CONTENT = re.compile(r"\n( *)([^ #\n].?)")
_LIST_KEY = re.compile(r"[^:\n]+:[ \t]*(?:#[^\n]*)?(?=\n|\Z)")
_UNUSUAL_BREAKS = "\r\x85\u2028\u2029"


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A key of the file with all that stands below it.

    Attributes:
        key: Empty for what stands in front of the first key.
        head: Its text, or that in front of its first item.
        items: The texts of a list's items, each to the next dash or key.
        indent: The column of their dashes.
    """

    key: str
    head: str
    items: tuple[str, ...] = ()
    indent: int = 2


def cut(text: str, list_keys: Collection[str]) -> tuple[Section, ...]:
    """Cut a text, whose lines end in a line feed, into sections; one where it is laid out oddly.

    Args:
        list_keys: Keys whose lists are cut into items.
    """
    if any(each in text for each in _UNUSUAL_BREAKS):
        return (Section(key="", head=text),)
    text = "\n" + text
    keys = list(_KEY.finditer(text))
    starts = [match.start() + 1 for match in keys]
    ends = [*starts[1:], len(text)][: len(starts)]
    sections = [
        _cut_section(match[1], text, start, end, is_list=match[1] in list_keys)
        for match, start, end in zip(keys, starts, ends, strict=True)
    ]
    return (Section(key="", head=text[1 : starts[0] if starts else None]), *sections)


def _cut_section(key: str, text: str, start: int, end: int, *, is_list: bool) -> Section:
    head = _LIST_KEY.match(text, start, end) if is_list else None
    first = _CONTENT.search(text, head.end(), end) if head else None
    if first is None or not re.fullmatch(r"-[ \t\n]?", first[2]):
        return Section(key=key, head=text[start:end])
    indent = len(first[1])
    # To look for line feeds is several times as fast as for ^.
    dashes = re.compile(rf"\n {{{indent}}}-(?=[ \t\n]|\Z)").finditer(text, first.start(), end)
    starts = [match.start() + 1 for match in dashes]
    items = (text[a:b] for a, b in zip(starts, [*starts[1:], end], strict=True))
    return Section(key=key, head=text[start : starts[0]], items=tuple(items), indent=indent)


def split_end(item: str, indent: int) -> tuple[str, str]:
    """Split what belongs to no item off an item's end: blank lines, and comments in front of it."""
    end = len(item)
    while True:
        end = len(item[:end].rstrip(" \t\n"))
        line_start = item.rfind("\n", 0, end) + 1
        line = item[line_start:end].lstrip(" ")
        if not line.startswith("#") or end - line_start - len(line) > indent or not line_start:
            break
        end = line_start
    line_end = item.find("\n", end)
    return (item, "") if line_end < 0 else (item[: line_end + 1], item[line_end + 1 :])


_ENTRY = re.compile(r"([a-z_]+):(?: +(\S.*))?")
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
_TIME = re.compile(r"\d{4}-\d\d-\d\dT[\d:.]+(?:Z|[+-]\d\d:\d\d)")
_QUOTE = r'"(?:[^"\\]|\\["\\n])*"'
_QUOTED = re.compile(_QUOTE)
_FLOW_ENTRY = re.compile(rf"([a-z_]+): (\{{[^{{}}]*\}}|{_QUOTE}|[^,{{}}\[\]\"]+)(?:, (?=.)|\Z)")
_FLOW_ITEM = re.compile(rf"({_QUOTE}|[^,{{}}\[\]\"]+)(?:, (?=.)|\Z)")


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
        return [_read_flow_scalar(item[1]) for item in _read_flow(_FLOW_ITEM, text[1:-1])]
    if text.startswith("{") and text.endswith("}"):
        return _read_flow_mapping(text[1:-1])
    if _QUOTED.fullmatch(text):
        return str(json.loads(text))
    _sure(is_plain(text) or _NUMBER.fullmatch(text) or _TIME.fullmatch(text))
    return text


def _read_flow(pattern: re.Pattern[str], text: str) -> Iterator[re.Match[str]]:
    """Return the parts of the text within brackets."""
    at = 0
    while at < len(text):
        part = pattern.match(text, at)
        if part is None:
            raise _UnsureError
        yield part
        at = part.end()


def _read_flow_mapping(text: str) -> Data:
    mapping: dict[str, Data] = {}
    for key, value in (part.groups() for part in _read_flow(_FLOW_ENTRY, text)):
        _sure(key not in mapping)
        is_mapping = value.startswith("{")
        mapping[key] = _read_flow_mapping(value[1:-1]) if is_mapping else _read_flow_scalar(value)
    _sure(mapping)
    return mapping


def _read_flow_scalar(text: str) -> str:
    if text.startswith('"'):
        return str(json.loads(text))
    _sure(is_plain_in_flow(text) or _NUMBER.fullmatch(text) or _TIME.fullmatch(text))
    return text


def _sure(is_sure: object) -> None:
    if not is_sure:
        raise _UnsureError
