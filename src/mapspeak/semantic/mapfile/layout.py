"""Cuts the file into its records by the dashes of the list `waypoints`, without a YAML parser.

The cut is right wherever YAML's own rule on indentation is kept: what belongs to an item stands
further right than its dash. Each piece is still read by a YAML parser, which reports the others.
"""

import re
from bisect import bisect_left, bisect_right
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
    dash, behind = _patterns(indent)
    if not dash.match(text, first.start()):
        return whole(text)
    after = behind.search(text, first.start())
    end = after.start() if after else len(text)
    spans = _find_spans(text, first.start(), end, indent)
    return Layout(spans=spans, indent=indent, start=first.start(), end=end)


def find_changed_records(text: str, *, before: str, layout: Layout) -> Layout:
    """Finds the records of a text that was changed, by looking only at what changed.

    Args:
        text: As it is now.
        before: As it was.
        layout: Where the records stood in that.
    """
    n_same = _count_same(before, text)
    n_same_behind = _count_same(before[n_same:][::-1], text[n_same:][::-1])
    starts = [start for start, _ in layout.spans]
    # From the record before the first change, whose end may depend on what follows it.
    first = bisect_right(starts, n_same) - 2
    last = bisect_left(starts, len(before) - n_same_behind + 1)
    n_more = len(text) - len(before)
    if first < 0 or len(before) - n_same_behind > layout.end:
        return find_records(text)
    if layout.end < len(before) and text[layout.end + n_more - 1] != "\n":
        # What followed the records has become a part of their last line.
        return find_records(text)
    start, end = starts[first], (starts[last] if last < len(starts) else layout.end) + n_more
    dash, behind = _patterns(layout.indent)
    is_list = dash.match(text, start) and not behind.search(text, start, end)
    if not is_list or _UNUSUAL_BREAK.search(text, start, end):
        return find_records(text)
    spans = (
        *layout.spans[:first],
        *_find_spans(text, start, end, layout.indent),
        *((a + n_more, b + n_more) for a, b in layout.spans[last:]),
    )
    return Layout(spans=spans, indent=layout.indent, start=layout.start, end=layout.end + n_more)


def _patterns(indent: int) -> tuple[re.Pattern[str], re.Pattern[str]]:
    """Gives what begins a record, and what begins a line that belongs to none."""
    item = rf" {{{indent}}}-(?:[ \t\n]|\Z)"
    dash = re.compile(rf"^{item}", re.MULTILINE)
    return dash, re.compile(rf"^(?!{item}) {{0,{indent}}}[^ #\n]", re.MULTILINE)


def _find_spans(text: str, start: int, end: int, indent: int) -> tuple[tuple[int, int], ...]:
    dash, _ = _patterns(indent)
    starts = [match.start() for match in dash.finditer(text, start, end)]
    return tuple(
        (a, _content_end(text, a, b, indent))
        for a, b in zip(starts, [*starts[1:], end], strict=True)
    )


def _count_same(one: str, other: str) -> int:
    """Counts the letters that two texts begin with alike."""
    low, high = 0, min(len(one), len(other))
    while low < high:
        middle = (low + high + 1) // 2
        if one[low:middle] == other[low:middle]:
            low = middle
        else:
            high = middle - 1
    return low


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
