"""Change one record in its own text: what stays the same keeps its spelling and its comments."""

import json
import re
from collections.abc import Iterable, Iterator

from mapspeak.memory.store.tree import (
    Data,
    ListNode,
    MappingNode,
    Node,
    comments_between,
    comments_in,
    comments_within,
    parse_tree,
    without_comments,
)

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
    """Return True when every YAML reader takes the unquoted text, on its own line, as it is."""
    return (
        text[:1].isalpha()
        and text.isprintable()
        and not text.endswith(" ")
        and not _SPECIAL_IN_BLOCK.search(text)
        and text.casefold() not in _OTHER_MEANING
    )


def is_plain_in_flow(text: str) -> bool:
    """Return True when every YAML reader takes the unquoted text, within brackets, for itself."""
    return is_plain(text) and not _SPECIAL_IN_FLOW.search(text)


def flow_text(data: Data, key: str = "") -> str:
    """Return a value on one line; the key it stands under says whether it is a number."""
    if data is None:
        return "null"
    if isinstance(data, str):
        # JSON's quotes are YAML's, except for characters that it would write as surrogate pairs.
        is_bare = key in _BARE_KEYS or is_plain_in_flow(data)
        return data if is_bare else json.dumps(data, ensure_ascii=False)
    if isinstance(data, list):
        return f"[{', '.join(flow_text(item) for item in data)}]"
    entries = (f"{name}: {flow_text(value, name)}" for name, value in data.items())
    return f"{{{', '.join(entries)}}}"


def line_text(data: Data, key: str = "") -> str:
    """Return a value that ends its line, outside of brackets."""
    if isinstance(data, str) and is_plain(data):
        return data
    return flow_text(data, key)


def entry_text(key: str, data: Data, *, indent: int) -> str:
    """Return `key: value` without the first line's indentation, over several lines where needed."""
    below = "\n" + " " * (indent + 2)
    if isinstance(data, str) and "\n" in data:
        lines = (below + line if line else "\n" for line in data.split("\n"))
        return f"{key}: |-{''.join(lines)}"
    if isinstance(data, list):
        has_mapping = any(isinstance(item, dict) for item in data)
        if has_mapping or len(key) + indent + len(flow_text(data)) > MAX_COLUMNS:
            return f"{key}:" + "".join(f"{below}- {line_text(item)}" for item in data)
    return f"{key}: {line_text(data, key)}"


def record_text(data: dict[str, Data], *, indent: int) -> str:
    """Return one waypoint as an item of the list `waypoints`, with its final line break."""
    margin = " " * (indent + 2)
    entries = [entry_text(key, value, indent=indent + 2) for key, value in data.items()]
    return " " * indent + "- " + f"\n{margin}".join(entries) + "\n"


_Edit = tuple[int, int, str]
"""From where to where the text gives way, and what it gives way to."""


def edited_record(block: str, *, old: dict[str, Data], new: dict[str, Data]) -> str:
    """Return the text of one item of `waypoints`, changed from one saying to another."""
    tree = parse_tree(block)
    record = tree.items[0] if isinstance(tree, ListNode) else tree
    if not isinstance(record, MappingNode):
        return block
    editor = _Editor(block)
    return editor.applied(editor.mapping_edits(record, old, new), 0, len(block))


class _Editor:
    """Plans the edits of one text."""

    def __init__(self, text: str) -> None:
        self._text = text

    def applied(self, edits: Iterable[_Edit], start: int, end: int) -> str:
        """Return a stretch of the text with the edits that lie in it made."""
        pieces = []
        for begin, stop, new in sorted(edits, key=lambda edit: edit[:2]):
            pieces += [self._text[start:begin], new]
            start = stop
        return "".join([*pieces, self._text[start:end]])

    # --- mappings ----------------------------------------------------------------------------

    def mapping_edits(
        self, node: MappingNode, old: dict[str, Data], new: dict[str, Data]
    ) -> Iterator[_Edit]:
        """Return the edits that make a mapping say what is new; unknown keys stay."""
        added: dict[str, Data] = {}
        for key in dict.fromkeys((*old, *new)):
            before, after, place = old.get(key), new.get(key), node.find_value(key)
            if before == after:
                continue
            if place is None:
                added |= {key: after} if after else {}
            elif isinstance(place, MappingNode) and isinstance(after, dict):
                yield from self.mapping_edits(place, _as_mapping(before), after)
            elif isinstance(place, ListNode) and isinstance(after, list):
                yield self._list_edit(place, list(before or ()), after)
            else:
                yield self._scalar_edit(node, place, key, after)
        if added:
            yield self._insertion(node, added)

    def _insertion(self, node: MappingNode, added: dict[str, Data]) -> _Edit:
        last = node.entries[-1][1].end
        if node.is_flow:
            entries = (f", {key}: {flow_text(value, key)}" for key, value in added.items())
            return (last, last, "".join(entries))
        column, end = self._column(node.start), self._line_end(last)
        margin = "\n" + " " * column
        lines = (margin + entry_text(key, value, indent=column) for key, value in added.items())
        return (end, end, "".join(lines))

    def _scalar_edit(self, parent: MappingNode, node: Node, key: str, new: Data) -> _Edit:
        if parent.is_flow:
            return self._one_line_edit(node, flow_text(new, key))
        if self._rest_of_line(node) or comments_within(self._text, node):
            return self._one_line_edit(node, line_text(new, key))
        entry = entry_text(key, new, indent=self._column(parent.start))
        value = entry.removeprefix(f"{key}:")
        return (node.start, node.end, value if node.start == node.end else value.lstrip(" "))

    def _one_line_edit(self, node: Node, value: str) -> _Edit:
        space = " " if self._text[node.start - 1 : node.start] == ":" else ""
        comments = comments_within(self._text, node)
        return (node.start, node.end, space + value + self._behind(node, comments))

    # --- lists -------------------------------------------------------------------------------

    def _list_edit(self, node: ListNode, old: list[Data], new: list[Data]) -> _Edit:
        if not node.items:
            return self._one_line_edit(node, flow_text(new))
        return (self._flow_list_edit if node.is_flow else self._block_list_edit)(node, old, new)

    def _flow_list_edit(self, node: ListNode, old: list[Data], new: list[Data]) -> _Edit:
        sources, gone = _sources(old, new)
        spans = [(item.start, item.end) for item in node.items]
        pieces = [
            flow_text(item) if i is None else self._continued(node.items[i], spans[i], old[i], item)
            for item, i in zip(new, sources, strict=True)
        ]
        comments = comments_between(self._text, node.start, node.end, node.items)
        comments += [c for i in gone for c in comments_within(self._text, node.items[i])]
        value = f"[{', '.join(pieces)}]"
        return (node.start, node.end, value + self._behind(node, comments))

    def _block_list_edit(self, node: ListNode, old: list[Data], new: list[Data]) -> _Edit:
        sources, gone = _sources(old, new)
        dashes = list(self._dashes(node))
        spans = list(zip(dashes, [*dashes[1:], self._line_end(node.end)], strict=True))
        lines = [
            f"- {line_text(item)}"
            if i is None
            else self._continued(node.items[i], spans[i], old[i], item)
            for item, i in zip(new, sources, strict=True)
        ]
        comments = [c for i in gone for c in comments_in(self._text, *spans[i], [node.items[i]])]
        margin = "\n" + " " * self._column(dashes[0])
        value = margin.join([*(lines or ["  []"]), *comments])
        return (dashes[0], spans[-1][1], value)

    def _continued(self, node: Node, span: tuple[int, int], old: Data, new: Data) -> str:
        edits: Iterable[_Edit] = ()
        if isinstance(node, MappingNode):
            edits = self.mapping_edits(node, _as_mapping(old), _as_mapping(new))
        elif old != new:
            edits = [(node.start, node.end, flow_text(new))]
        return self.applied(edits, *span).rstrip()

    def _dashes(self, node: ListNode) -> Iterator[int]:
        end = node.start
        for item in node.items:
            # A comment may hold a dash, too.
            yield end + without_comments(self._text[end : item.start]).index("-")
            end = item.end

    # --- places ------------------------------------------------------------------------------

    def _behind(self, node: Node, comments: list[str]) -> str:
        """Return comments to stand behind a value, and a new line if more than comments follows."""
        if not comments:
            return ""
        is_followed = self._rest_of_line(node)[:1] not in ("", "#")
        line_break = "\n" + " " * self._column(node.start) if is_followed else ""
        return f"  {'  '.join(comments)}{line_break}"

    def _rest_of_line(self, node: Node) -> str:
        return self._text[node.end : self._line_end(node.end)].strip()

    def _column(self, offset: int) -> int:
        return offset - (self._text.rfind("\n", 0, offset) + 1)

    def _line_end(self, offset: int) -> int:
        end = self._text.find("\n", offset)
        return len(self._text) if end < 0 else end


def _sources(old: list[Data], new: list[Data]) -> tuple[list[int | None], list[int]]:
    """Find which old item each new one continues, and the old ones that none continues.

    An item continues one that says the same, or else one with the same label.
    """
    left = dict(enumerate(old))
    sources: list[int | None] = [None] * len(new)
    for likeness in (lambda item: item, _label):
        for index, item in enumerate(new):
            if sources[index] is None:
                like = (i for i, other in left.items() if likeness(other) == likeness(item))
                sources[index] = next(like, None)
                left = {i: other for i, other in left.items() if i != sources[index]}
    return sources, list(left)


def _as_mapping(item: Data) -> dict[str, Data]:
    return item if isinstance(item, dict) else {"label": item}


def _label(item: Data) -> Data:
    return _as_mapping(item)["label"]
