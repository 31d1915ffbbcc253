"""A semantic map file that has been read: its records, and where each stands in the text.

A YAML parser needs a second for a thousand waypoints. So the text is cut at the dashes of the list
`waypoints`, and a record whose text was seen before is not read again. A file laid out in another
way is read as a whole, slowly.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from operator import add

from pydantic import ValidationError

from mapspeak.errors import SemanticMapError
from mapspeak.memory.events import Event
from mapspeak.memory.quoting import name_key, quote_name
from mapspeak.memory.store.eventschema import read_events
from mapspeak.memory.store.layout import (
    Layout,
    LineEnds,
    find_records,
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
class Reading:
    """What the text of one record says, kept so that it need not be read again.

    Attributes:
        key: The `name_key` of its name.
        misspelt: Keys that look like known ones, each with the known one.
    """

    waypoint: Waypoint
    key: str
    misspelt: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Record:
    """What a record says and where it stands in the text."""

    reading: Reading
    start: int
    end: int


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
        source: How messages call the file.
        text: All of it, with lines that end in a line feed.
        line_ends: How its lines end.
        root: Its top mapping without the records; None where the file says nothing.
        layout: Where the records stand in the text.
        records: By `name_key`, in the order of the file.
        events: By their ids, likewise.
        map_id: The map that the file says it belongs to, if any.
        warnings: Keys that look misspelt.
    """

    source: str
    text: str
    line_ends: LineEnds = field(repr=False)
    has_bom: bool
    root: MappingNode | None
    layout: Layout
    records: Mapping[str, Record]
    events: Mapping[str, EventRecord]
    map_id: str | None
    warnings: tuple[str, ...]
    readings: Mapping[str, Reading] = field(repr=False)

    @property
    def content(self) -> bytes:
        """The file's bytes."""
        return self.encoded(self.text)

    def find_entry(self, key: str) -> str | None:
        """Return what the file says under a key of its own, beside the records."""
        node = self.root.find_value(key) if self.root else None
        return node.data if isinstance(node, ScalarNode) else None

    def encoded(self, text: str) -> bytes:
        """Return a text in the bytes of this file: its line ends, its byte order mark."""
        return ((_BOM if self.has_bom else "") + self.line_ends.restored(text)).encode()

    def to_map(self) -> SemanticMap:
        """Return the remembered places."""
        waypoints = tuple(record.reading.waypoint for record in self.records.values())
        return SemanticMap(map_id=self.map_id, waypoints=waypoints, warnings=self.warnings)


def parse_document(
    content: bytes, *, source: str, previous: MapDocument | None = None
) -> MapDocument:
    """Read a semantic map file.

    Args:
        source: How messages call the file.
        previous: What was read from it before; spares reading unchanged records again.

    Raises:
        SemanticMapError: It has a fault; the message names the line and the column.
    """
    decoded = _decoded(content, source)
    text = decoded.removeprefix(_BOM)
    if "\r" in text:
        text = text.replace("\r\n", "\n")
    try:
        layout, root = _cut(text, previous)
        map_id = _map_id(root, layout)
        known = previous.readings if previous and previous.map_id == map_id else {}
        listed = (Record(_read_node(n, map_id), n.start, n.end) for n in _list_items(root))
        records = [*_cut_records(text, layout, map_id, known), *listed]
        by_key = _by_key(records)
        events = _events(root, layout)
    except TextError as fault:
        raise _at_its_place(fault, source, text) from fault
    return MapDocument(
        source=source,
        text=text,
        line_ends=LineEnds.of(decoded.removeprefix(_BOM)),
        has_bom=decoded.startswith(_BOM),
        root=root,
        layout=layout,
        records=by_key,
        events=events,
        map_id=map_id,
        warnings=tuple(_warnings(text, root, records)),
        readings={text[record.start : record.end]: record.reading for record in records},
    )


# --- text ------------------------------------------------------------------------------------


def _decoded(content: bytes, source: str) -> str:
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        message = f"{source}, line {line}: byte {error.start} is not UTF-8."
        raise SemanticMapError(message, hint="Save the file with the encoding UTF-8.") from error


def _at_its_place(fault: TextError, source: str, text: str) -> SemanticMapError:
    line, column = line_and_column(text, fault.offset)
    message = f"{source}, line {line}, column {column}: {fault.message}"
    if fault.other_offset is not None:
        message += f" The other one is on line {line_and_column(text, fault.other_offset)[0]}."
    return SemanticMapError(message, hint=fault.hint)


# --- what stands beside the records ----------------------------------------------------------


def _cut(text: str, previous: MapDocument | None) -> tuple[Layout, MappingNode | None]:
    layout = find_records(text)
    root = None
    if previous is not None and previous.layout.spans and layout.spans:
        # Only records may have changed: what was read before holds.
        is_same = previous.layout.skeleton(previous.text) == layout.skeleton(text)
        root = previous.root if is_same else None
    root = root or _root(text, layout)
    if layout.spans and _list_items(root):
        # A part of the list stands where its dashes do not show it.
        return whole(text), _root(text, whole(text))
    return layout, root


def _root(text: str, layout: Layout) -> MappingNode | None:
    try:
        root = parse_tree(layout.skeleton(text))
    except TextError as fault:
        raise fault.moved(layout.offset_in_text) from fault
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


def _map_id(root: MappingNode | None, layout: Layout) -> str | None:
    if root is None:
        return None
    try:
        return map_id_from(root.data)
    except ValidationError as error:
        raise fault_in(root, error).moved(layout.offset_in_text) from error


def _events(root: MappingNode | None, layout: Layout) -> dict[str, EventRecord]:
    try:
        found = read_events(root)
    except TextError as fault:
        raise fault.moved(layout.offset_in_text) from fault
    place = layout.offset_in_text
    return {
        event.id: EventRecord(event, place(node.start), place(node.end)) for event, node in found
    }


# --- records ---------------------------------------------------------------------------------


def _cut_records(
    text: str, layout: Layout, map_id: str | None, known: Mapping[str, Reading]
) -> Iterator[Record]:
    for start, end in layout.spans:
        block = text[start:end]
        try:
            yield Record(known.get(block) or _read_block(block, map_id), start, end)
        except TextError as fault:
            raise fault.moved(partial(add, start)) from fault


def _read_block(block: str, map_id: str | None) -> Reading:
    data = read_plain_record(block)
    if data is not None:
        try:
            return _reading(data, map_id)
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


def _read_node(node: Node, map_id: str | None) -> Reading:
    try:
        return _reading(node.data, map_id)
    except ValidationError as error:
        raise fault_in(node, error) from error
    except SemanticMapError as error:
        raise TextError(error.message, hint=error.hint, offset=node.start) from error


def _reading(data: Data, map_id: str | None) -> Reading:
    waypoint = waypoint_from(data, map_id=map_id)
    return Reading(waypoint, name_key(waypoint.name), tuple(find_misspelt_keys(data)))


def _by_key(records: Iterable[Record]) -> dict[str, Record]:
    by_key: dict[str, Record] = {}
    for record in records:
        twin = by_key.setdefault(record.reading.key, record)
        if twin is not record:
            raise TextError(
                f"Two waypoints are called {quote_name(record.reading.waypoint.name)}.",
                hint="Rename or remove one of them; case and spaces make no difference.",
                offset=record.start,
                other_offset=twin.start,
            )
    return by_key


def _warnings(text: str, root: MappingNode | None, records: Sequence[Record]) -> Iterator[str]:
    for key, known in find_misspelt_keys_of_file(root.data if root else {}):
        yield f"The key {quote_name(key)} of the file is not used; '{known}' would be."
    misspelt = [(record, *keys) for record in records for keys in record.reading.misspelt]
    for record, key, known in misspelt[:_MAX_WARNINGS]:
        line, _ = line_and_column(text, record.start)
        what = f"{quote_name(key)} of {quote_name(record.reading.waypoint.name)}"
        yield f"The key {what} (line {line}) is not used; '{known}' would be."
    if len(misspelt) > _MAX_WARNINGS:
        yield f"{len(misspelt) - _MAX_WARNINGS} more keys look misspelt."
