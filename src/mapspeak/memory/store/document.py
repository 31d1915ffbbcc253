"""A semantic map file that has been read: its records, and where each stands in the text.

A YAML parser needs a second for a thousand waypoints. So the text is cut at the dashes of the list
`waypoints`, and a record whose text was seen before is not read again. A file laid out in another
way is read as a whole, slowly.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from pydantic import ValidationError

from mapspeak.errors import SemanticMapError
from mapspeak.memory.events import Event
from mapspeak.memory.quoting import name_key, quote_name
from mapspeak.memory.store.eventschema import read_events
from mapspeak.memory.store.layout import Layout, find_records, read_plain_record, whole
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
    """What a record says and where it stands in the text.

    Attributes:
        misspelt: Keys that look like known ones, each with the known one.
    """

    waypoint: Waypoint
    key: str
    misspelt: tuple[tuple[str, str], ...]
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
        text: All of it, with lines that end in a line feed.
        line_end: What most of its lines end in, and all that are written.
        root: Its top mapping without the records; None where the file says nothing.
        records: By `name_key`, in the order of the file.
        events: By their ids, likewise.
    """

    source: str
    text: str
    line_end: str = field(repr=False)
    has_bom: bool
    root: MappingNode | None
    layout: Layout
    records: Mapping[str, Record]
    events: Mapping[str, EventRecord]
    map_id: str | None
    warnings: tuple[str, ...]

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
        bom = _BOM if self.has_bom else ""
        return (bom + text.replace("\n", self.line_end)).encode()

    def to_map(self) -> SemanticMap:
        """Return the remembered places."""
        waypoints = tuple(record.waypoint for record in self.records.values())
        return SemanticMap(map_id=self.map_id, waypoints=waypoints, warnings=self.warnings)


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
    text = decoded.removeprefix(_BOM).replace("\r\n", "\n")
    try:
        layout, root = _cut(text, previous)
        with _moved(layout.offset_in_text):
            map_id = _map_id(root)
            events = {each.id: (each, node) for each, node in read_events(root)}
        records = list(_records(text, layout, root, map_id, previous))
        by_key = _by_key(records)
    except TextError as fault:
        raise _at_its_place(fault, source, text) from fault
    return MapDocument(
        source=source,
        text=text,
        line_end="\r\n" if 2 * decoded.count("\r\n") > decoded.count("\n") else "\n",
        has_bom=decoded.startswith(_BOM),
        root=root,
        layout=layout,
        records=by_key,
        events={
            key: EventRecord(event, *map(layout.offset_in_text, (node.start, node.end)))
            for key, (event, node) in events.items()
        },
        map_id=map_id,
        warnings=tuple(_warnings(text, root, records)),
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
    text: str,
    layout: Layout,
    root: MappingNode | None,
    map_id: str | None,
    previous: MapDocument | None,
) -> Iterator[Record]:
    known = {}
    if previous is not None and previous.map_id == map_id:
        known = {previous.text[each.start : each.end]: each for each in previous.records.values()}
    for start, end in layout.spans:
        block = text[start:end]
        record = known.get(block)
        if record is None:
            with _moved(start.__add__):
                record = _read_block(block, map_id)
        yield replace(record, start=start, end=end)
    for node in _list_items(root):
        yield _read_node(node, map_id)


def _read_block(block: str, map_id: str | None) -> Record:
    data = read_plain_record(block)
    if data is not None:
        try:
            return _record(data, map_id, 0, len(block))
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
        return _record(node.data, map_id, node.start, node.end)
    except ValidationError as error:
        raise fault_in(node, error) from error
    except SemanticMapError as error:
        raise TextError(error.message, hint=error.hint, offset=node.start) from error


def _record(data: Data, map_id: str | None, start: int, end: int) -> Record:
    waypoint = waypoint_from(data, map_id=map_id)
    misspelt = tuple(find_misspelt_keys(data))
    return Record(waypoint, name_key(waypoint.name), misspelt, start, end)


def _by_key(records: Iterable[Record]) -> dict[str, Record]:
    by_key: dict[str, Record] = {}
    for record in records:
        twin = by_key.setdefault(record.key, record)
        if twin is not record:
            raise TextError(
                f"Two waypoints are called {quote_name(record.waypoint.name)}.",
                hint="Rename or remove one of them; case and spaces make no difference.",
                offset=record.start,
                other_offset=twin.start,
            )
    return by_key


def _warnings(text: str, root: MappingNode | None, records: Sequence[Record]) -> Iterator[str]:
    for key, known in find_misspelt_keys_of_file(root.data if root else {}):
        yield f"The key {quote_name(key)} of the file is not used; '{known}' would be."
    misspelt = [(record, *keys) for record in records for keys in record.misspelt]
    for record, key, known in misspelt[:_MAX_WARNINGS]:
        line, _ = line_and_column(text, record.start)
        what = f"{quote_name(key)} of {quote_name(record.waypoint.name)}"
        yield f"The key {what} (line {line}) is not used; '{known}' would be."
    if len(misspelt) > _MAX_WARNINGS:
        yield f"{len(misspelt) - _MAX_WARNINGS} more keys look misspelt."
