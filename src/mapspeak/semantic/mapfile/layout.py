"""Cuts the file into its records by the dashes of the list `waypoints`, without a YAML parser.

The cut is right wherever YAML's own rule on indentation is kept: what belongs to an item stands
further right than its dash. Each piece is still read by a YAML parser, which reports the others.
"""

import re
from dataclasses import dataclass

_LIST_KEY = re.compile(r"^waypoints:[ \t]*(?:#[^\n]*)?$", re.MULTILINE)
_CONTENT = re.compile(r"^( *)([^ #\n])", re.MULTILINE)
_UNUSUAL_BREAK = re.compile("[\r\x85\u2028\u2029]")


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
        """Gives the text without its records."""
        return text[: self.start] + text[self.end :]

    def offset_in_text(self, offset_in_skeleton: int) -> int:
        """Gives where in the text a place of the skeleton stands."""
        is_before = offset_in_skeleton < self.start
        return offset_in_skeleton + (0 if is_before else self.end - self.start)


def find_records(text: str) -> Layout:
    """Finds the records of a text whose lines end in a line feed."""
    key = _LIST_KEY.search(text)
    first = _CONTENT.search(text, key.end()) if key else None
    if first is None or _UNUSUAL_BREAK.search(text):
        return whole(text)
    indent = len(first[1])
    item = rf" {{{indent}}}-(?:[ \t\n]|\Z)"
    dash = re.compile(rf"^{item}", re.MULTILINE)
    behind = re.compile(rf"^(?!{item}) {{0,{indent}}}[^ #\n]", re.MULTILINE)
    if not dash.match(text, first.start()):
        return whole(text)
    after = behind.search(text, first.start())
    end = after.start() if after else len(text)
    starts = [match.start() for match in dash.finditer(text, first.start(), end)]
    ends = [*starts[1:], end]
    spans = tuple((a, _content_end(text, a, b, indent)) for a, b in zip(starts, ends, strict=True))
    return Layout(spans=spans, indent=indent, start=starts[0], end=end)


def whole(text: str) -> Layout:
    """Gives the layout of a text whose records cannot be told apart by their dashes."""
    return Layout(spans=(), indent=2, start=len(text), end=len(text))


def _content_end(text: str, start: int, end: int, indent: int) -> int:
    """Cuts blank lines, and comments that stand no further right than the dash, off the end."""
    while True:
        end = start + len(text[start:end].rstrip(" \t\n"))
        line_start = text.rfind("\n", start, end) + 1
        line = text[line_start:end].lstrip(" ")
        if not line.startswith("#") or end - line_start - len(line) > indent or line_start <= start:
            break
        end = line_start
    line_end = text.find("\n", end)
    return len(text) if line_end < 0 else line_end + 1
