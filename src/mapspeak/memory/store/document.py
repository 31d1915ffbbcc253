"""A semantic map file that has been read: its records, and where each stands in the text.

A YAML parser needs a second for a thousand waypoints. So the text is cut at the dashes of the list
`waypoints`, and a record whose text was seen before is not read again. A file laid out in another
way is read as a whole, slowly.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice

from pydantic import ValidationError

from mapspeak.errors import SemanticMapError
from mapspeak.memory.events import Event
from mapspeak.memory.frames import Frames
from mapspeak.memory.quoting import name_key, quote_name
from mapspeak.memory.store.eventschema import read_events
from mapspeak.memory.store.frameschema import read_frames
from mapspeak.memory.store.layout import (
    Layout,
    find_records,
    find_records_again,
    read_plain_record,
    whole,
)
from mapspeak.memory.store.schema import (
    fault_in,
    find_misspelt_keys,
    find_misspelt_keys_of_file,
    map_id_from,
    waypoint_from,
)
from mapspeak.memory.store.tree import (
    Data,
    ListNode,
    MappingNode,
    Node,
    ScalarNode,
    TextError,
    line_and_column,
    parse_tree,
)
from mapspeak.memory.waypoint import SemanticMap, Waypoint

_BOM = "\ufeff"
_MAX_WARNINGS = 5


@dataclass(frozen=True, slots=True)
class Record:
    """What a record says.

    Attributes:
        misspelt: Keys that look like known ones, each with the known one.
    """

    waypoint: Waypoint
    key: str
    misspelt: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class EventRecord:
    """What an event's record says and where it stands in the text."""

    event: Event
    start: int
    end: int


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MapDocument:
    """A semantic map file that was read without a fault.

    Attributes:
        text: All of it, with lines that end in a line feed.
        line_end: What most of its lines end in, and all that are written.
        root: Its top mapping without the records; None where the file says nothing.
        records: By `name_key`, in the order of the file.
        spans: Where each record stands in the text, in the same order.
        events: By their ids, likewise.
        frames: All but the file's own.
    """

    source: str
    text: str
    line_end: str = field(repr=False)
    has_bom: bool
    root: MappingNode | None
    layout: Layout
    records: Mapping[str, Record]
    spans: tuple[tuple[int, int], ...]
    events: Mapping[str, EventRecord]
    map_id: str | None
    frames: Frames
    warnings: tuple[str, ...]

    @property
    def content(self) -> bytes:
        """The file's bytes."""
        return self.encoded(self.text)

    def span_of(self, key: str) -> tuple[int, int]:
        """Return where the record of a `name_key` stands in the text."""
        return self.spans[list(self.records).index(key)]

    def find_entry(self, key: str) -> str | None:
        """Return what the file says under a key of its own, beside the records."""
        node = self.root.find_value(key) if self.root else None
        return node.data if isinstance(node, ScalarNode) else None

    def encoded(self, text: str) -> bytes:
        """Return a text in the bytes of this file: its line ends, its byte order mark."""
        bom = _BOM if self.has_bom else ""
        return (bom + text.replace("\n", self.line_end)).encode()

    def to_map(self) -> SemanticMap:
        """Return the remembered places."""
        waypoints = tuple(record.waypoint for record in self.records.values())
        return SemanticMap(
            map_id=self.map_id,
            waypoints=waypoints,
            frames=self.frames,
            warnings=self.warnings,
        )


def parse_document(
    content: bytes, *, source: str, previous: MapDocument | None = None
) -> MapDocument:
    """Read a semantic map file.

    Args:
        previous: What was read from it before; spares reading unchanged records again.

    Raises:
        SemanticMapError: It has a fault; the message names the line and the column.
    """
    decoded = _decoded(content, source)
    return parse_text(
        decoded.removeprefix(_BOM).replace("\r\n", "\n"),
        source=source,
        line_end="\r\n" if 2 * decoded.count("\r\n") > decoded.count("\n") else "\n",
        has_bom=decoded.startswith(_BOM),
        previous=previous,
    )


def parse_text(
    text: str, *, source: str, line_end: str, has_bom: bool, previous: MapDocument | None
) -> MapDocument:
    """Read the text of a semantic map file, whose lines end in a line feed.

    Raises:
        SemanticMapError: As for `parse_document`.
    """
    try:
        scan = _scan(text, previous)
        layout, root = scan.layout, scan.root
        with _moved(layout.offset_in_text):
            map_id = _map_id(root)
            events = {each.id: (each, node) for each, node in read_events(root)}
            frames = Frames(tuple(frame for frame, _ in read_frames(root)))
        records, spans = _records(text, scan, map_id)
        by_key = _by_key(records, spans)
    except TextError as fault:
        raise _at_its_place(fault, source, text) from fault
    return MapDocument(
        source=source,
        text=text,
        line_end=line_end,
        has_bom=has_bom,
        root=root,
        layout=layout,
        records=by_key,
        spans=spans,
        events={
            key: EventRecord(event, *map(layout.offset_in_text, (node.start, node.end)))
            for key, (event, node) in events.items()
        },
        map_id=map_id,
        frames=frames,
        warnings=tuple(_warnings(text, root, records, spans)),
    )


# --- text ------------------------------------------------------------------------------------


def _decoded(content: bytes, source: str) -> str:
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        message = f"{source}, line {line}: byte {error.start} is not UTF-8."
        raise SemanticMapError(message, hint="Save the file with the encoding UTF-8.") from error


@contextmanager
def _moved(place: Callable[[int], int]) -> Iterator[None]:
    """Tell a fault in a part of the text at its place in the whole."""
    try:
        yield
    except TextError as fault:
        raise fault.moved(place) from fault


def _at_its_place(fault: TextError, source: str, text: str) -> SemanticMapError:
    line, column = line_and_column(text, fault.offset)
    message = f"{source}, line {line}, column {column}: {fault.message}"
    if fault.other_offset is not None:
        message += f" The other one is on line {line_and_column(text, fault.other_offset)[0]}."
    return SemanticMapError(message, hint=fault.hint)


# --- what stands beside the records ----------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Scan:
    """What can be told of a text before its records are read.

    Attributes:
        before: Records at its beginning that were read before.
        behind: Likewise at its end.
        known: Others that were read before, by their text.
    """

    layout: Layout
    root: MappingNode | None
    before: tuple[Record, ...] = ()
    behind: tuple[Record, ...] = ()
    known: Mapping[str, Record] = field(default_factory=dict)


def _scan(text: str, previous: MapDocument | None) -> _Scan:
    again = None if previous is None else _scan_again(text, previous)
    if again is not None:
        return again
    layout = find_records(text)
    root = _root(text, layout)
    if layout.spans and _list_items(root):
        # A part of the list stands where its dashes do not show it.
        layout = whole(text)
        return _Scan(layout=layout, root=_root(text, layout))
    known = _by_text(previous, 0, len(previous.spans)) if previous else {}
    return _Scan(layout=layout, root=root, known=known)


def _scan_again(text: str, previous: MapDocument) -> _Scan | None:
    again = find_records_again(text, old_text=previous.text, old=previous.layout)
    if again is None:
        return None
    layout, root = again.layout, previous.root
    if layout.skeleton(text) != previous.layout.skeleton(previous.text):
        root = _root(text, layout)
        with _moved(layout.offset_in_text):
            is_like_before = not _list_items(root) and _map_id(root) == previous.map_id
        if not is_like_before:
            return None
    records = tuple(previous.records.values())
    i_behind = len(records) - again.n_behind
    return _Scan(
        layout=layout,
        root=root,
        before=records[: again.n_before],
        behind=records[i_behind:],
        known=_by_text(previous, again.n_before, i_behind),
    )


def _by_text(document: MapDocument, first: int, stop: int) -> dict[str, Record]:
    records = islice(document.records.values(), first, stop)
    spans = document.spans[first:stop]
    return {document.text[a:b]: each for (a, b), each in zip(spans, records, strict=True)}


def _root(text: str, layout: Layout) -> MappingNode | None:
    with _moved(layout.offset_in_text):
        root = parse_tree(layout.skeleton(text))
    if root is None or isinstance(root, MappingNode):
        return root
    raise TextError(
        "The file is not a mapping of keys to values.",
        hint="Begin with `version: 1` and `waypoints:`, each at the start of a line.",
        offset=root.start,
    )


def _list_items(root: MappingNode | None) -> tuple[Node, ...]:
    node = root.find_value("waypoints") if root else None
    return node.items if isinstance(node, ListNode) else ()


def _map_id(root: MappingNode | None) -> str | None:
    if root is None:
        return None
    try:
        return map_id_from(root.data)
    except ValidationError as error:
        raise fault_in(root, error) from error


# --- records ---------------------------------------------------------------------------------


def _records(
    text: str, scan: _Scan, map_id: str | None
) -> tuple[tuple[Record, ...], tuple[tuple[int, int], ...]]:
    spans, records = scan.layout.spans, list(scan.before)
    for start, end in spans[len(scan.before) : len(spans) - len(scan.behind)]:
        block = text[start:end]
        record = scan.known.get(block)
        if record is None or record.waypoint.map_id != map_id:
            with _moved(start.__add__):
                record = _read_block(block, map_id)
        records.append(record)
    # Where they stand otherwise, the dashes showed none.
    nodes = _list_items(scan.root)
    others = (_read_node(node, map_id) for node in nodes)
    return (*records, *scan.behind, *others), (*spans, *((n.start, n.end) for n in nodes))


def _read_block(block: str, map_id: str | None) -> Record:
    data = read_plain_record(block)
    if data is not None:
        try:
            return _record(data, map_id)
        except ValidationError:
            pass  # Read again below, to say where the fault is.
    tree = parse_tree(block)
    items = tree.items if isinstance(tree, ListNode) else ()
    if len(items) == 1:
        return _read_node(items[0], map_id)
    raise TextError(
        "This is not one waypoint.",
        hint="Begin each waypoint with `- name:`, with its other keys below `name`.",
        offset=len(block) - len(block.lstrip()),
    )


def _read_node(node: Node, map_id: str | None) -> Record:
    try:
        return _record(node.data, map_id)
    except ValidationError as error:
        raise fault_in(node, error) from error
    except SemanticMapError as error:
        raise TextError(error.message, hint=error.hint, offset=node.start) from error


def _record(data: Data, map_id: str | None) -> Record:
    waypoint = waypoint_from(data, map_id=map_id)
    misspelt = tuple(find_misspelt_keys(data))
    return Record(waypoint, name_key(waypoint.name), misspelt)


def _by_key(records: Sequence[Record], spans: Sequence[tuple[int, int]]) -> dict[str, Record]:
    by_key = {record.key: record for record in records}
    if len(by_key) < len(records):
        raise _twins(records, spans)
    return by_key


def _twins(records: Sequence[Record], spans: Sequence[tuple[int, int]]) -> TextError:
    starts: dict[str, int] = {}
    for record, (start, _) in zip(records, spans, strict=True):
        other = starts.setdefault(record.key, start)
        if other != start:
            return TextError(
                f"Two waypoints are called {quote_name(record.waypoint.name)}.",
                hint="Rename or remove one of them; case and spaces make no difference.",
                offset=start,
                other_offset=other,
            )
    raise AssertionError  # There are two of one name.


def _warnings(
    text: str,
    root: MappingNode | None,
    records: Sequence[Record],
    spans: Sequence[tuple[int, int]],
) -> Iterator[str]:
    for key, known in find_misspelt_keys_of_file(root.data if root else {}):
        yield f"The key {quote_name(key)} of the file is not used; '{known}' would be."
    misspelt = [
        (record, span[0], *keys)
        for record, span in zip(records, spans, strict=True)
        if record.misspelt
        for keys in record.misspelt
    ]
    for record, start, key, known in misspelt[:_MAX_WARNINGS]:
        line, _ = line_and_column(text, start)
        what = f"{quote_name(key)} of {quote_name(record.waypoint.name)}"
        yield f"The key {what} (line {line}) is not used; '{known}' would be."
    if len(misspelt) > _MAX_WARNINGS:
        yield f"{len(misspelt) - _MAX_WARNINGS} more keys look misspelt."
