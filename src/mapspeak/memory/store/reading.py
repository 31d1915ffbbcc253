"""Read a semantic map file: its records, and the position of each fault."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Protocol, cast

from ruamel.yaml.nodes import MappingNode, Node, SequenceNode

from mapspeak.errors import SemanticMapError
from mapspeak.memory.events import Event
from mapspeak.memory.quoting import quote_name
from mapspeak.memory.store.cutting import Section, cut, read_plain_record
from mapspeak.memory.store.records import (
    FILE,
    LISTS,
    Record,
    WrongRecordError,
    find_misspelt_keys,
    key_of,
    read_map_id,
    read_record,
)
from mapspeak.memory.store.yamltext import Data, TextFaultError, compose, data_of, locate
from mapspeak.memory.waypoint import Waypoint

FIRST_KEYS = {"waypoints": "name", "events": "text", "frames": "id"}

_MAX_WARNINGS = 5


@dataclass(frozen=True, slots=True)
class ListedRecord:
    """A record of the file.

    Attributes:
        text: With what stands behind it, to the next one; None where the file is laid out in a way
            that cannot be written to.
        misspelt: Keys that look like known ones, each with the known one.
    """

    record: Record
    key: str
    text: str | None = None
    misspelt: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class Contents:
    """Content of a file.

    Attributes:
        sections: Without the texts of their items, which are in `lists`.
        lists: The records of each list of `LISTS` by their keys, in the order of the file.
        root: The file's other keys, beside its records.
    """

    sections: tuple[Section, ...] = ()
    lists: Mapping[str, Mapping[str, ListedRecord]] = field(
        default_factory=lambda: {key: {} for key in LISTS}
    )
    root: Mapping[str, Data] = field(default_factory=dict)
    map_id: str | None = None
    warnings: tuple[str, ...] = ()


class KeptContents(Protocol):
    """Records that were parsed in an earlier session: they only save parsing the same texts."""

    def load_records(self) -> Contents | None:
        """Return them; None where none are kept that can be read."""

    def keep_records(self, contents: Contents) -> None:
        """Keep them for a later session; a failure costs only time."""


def read_contents(text: str, previous: Contents) -> Contents:
    """Read a text whose lines end in a line feed.

    Args:
        previous: The previous reading; unchanged records are not parsed again.

    Raises:
        TextFaultError: It has a fault.
    """
    sections = cut(text, LISTS)
    root, map_id = _read_root(sections)
    known = previous.lists if previous.map_id == map_id else Contents().lists
    lists = {key: _read_list(key, sections, root, map_id, known[key]) for key in LISTS}
    said = data_of(root)
    said = said if isinstance(said, dict) else {}
    return Contents(
        sections=tuple(replace(each, items=()) for each in sections),
        lists=lists,
        root=said,
        map_id=map_id,
        warnings=tuple(_find_warnings(said, lists["waypoints"].values(), sections)),
    )


def _read_root(sections: tuple[Section, ...]) -> tuple[MappingNode | None, str | None]:
    """Read the rest beside the records: the heads of all sections, as one document."""
    try:
        root = compose("".join(section.head for section in sections))
        data = data_of(root)
    except TextFaultError as fault:
        line = _line_in_file(fault.line, sections)
        other = None if fault.other_line is None else _line_in_file(fault.other_line, sections)
        moved = fault.moved(line - fault.line)
        moved.other_line = other
        raise moved from fault
    if root is None:
        return None, None
    if not isinstance(root, MappingNode) or not isinstance(data, dict):
        raise TextFaultError(
            "The file is not a mapping of keys to values.",
            hint="Begin with `version: 1` and `waypoints:`, each at the start of a line.",
            line=root.start_mark.line + 1,
            column=root.start_mark.column + 1,
        )
    try:
        return root, read_map_id(data)
    except WrongRecordError as error:
        line, column = locate(root, error.path)
        line = _line_in_file(line, sections)
        raise TextFaultError(error.message, hint=error.hint, line=line, column=column) from error


def _line_in_file(line: int, sections: tuple[Section, ...]) -> int:
    """Return the line number in the file of a line of the joined heads."""
    n_head_lines = n_item_lines = 0
    for section in sections:
        n_head_lines += section.head.count("\n")
        if line <= n_head_lines:
            break
        n_item_lines += sum(item.count("\n") for item in section.items)
    return line + n_item_lines


def _read_list(
    list_key: str,
    sections: tuple[Section, ...],
    root: MappingNode | None,
    map_id: str | None,
    known: Mapping[str, ListedRecord],
) -> dict[str, ListedRecord]:
    """Read the records of a list: those that were cut out, else those of the heads."""
    by_text = {item.text: item for item in known.values()} if list_key == "waypoints" else {}
    texts = [text for each in sections if each.key == list_key for text in each.items]
    node = next((v for k, v in root.value if k.value == list_key), None) if root else None
    nodes = node.value if isinstance(node, SequenceNode) and not texts else []

    def find_line(number: int) -> int:
        if texts:
            return _first_line(list_key, sections, number)
        return _line_in_file(nodes[number].start_mark.line + 1, sections)

    read = list[ListedRecord]()
    for number, each in enumerate(texts or nodes):
        try:
            read.append(by_text.get(each) or read_item(list_key, each, map_id))
        except TextFaultError as fault:
            first = 1 if texts else nodes[number].start_mark.line + 1
            raise fault.moved(find_line(number) - first) from fault
    items = dict[str, ListedRecord]()
    for number, item in enumerate(_with_ids(read)):
        if item.key in items:
            other = list(items).index(item.key)
            raise _twins(list_key, item, line=find_line(number), other_line=find_line(other))
        items[item.key] = item
    return items


def _first_line(list_key: str, sections: tuple[Section, ...], number: int) -> int:
    """Return the line on which an item of a list begins."""
    n_lines = 1
    for section in sections:
        n_lines += section.head.count("\n")
        is_there = section.key == list_key
        n_lines += sum(item.count("\n") for item in section.items[: number if is_there else None])
        if is_there:
            break
    return n_lines


def _twins(list_key: str, item: ListedRecord, *, line: int, other_line: int) -> TextFaultError:
    name = quote_name(item.record.name) if isinstance(item.record, Waypoint) else f"'{item.key}'"
    told = "are called" if list_key == "waypoints" else "have the id"
    return TextFaultError(
        f"Two {list_key} {told} {name}.",
        hint="Rename or remove one of them; case and spaces make no difference.",
        line=line,
        other_line=other_line,
    )


def _with_ids(items: list[ListedRecord]) -> Iterator[ListedRecord]:
    """Return items, where an event that names no id has the first free one from its number on."""
    taken = {item.key for item in items}
    for number, item in enumerate(items, start=1):
        if item.key or not isinstance(item.record, Event):
            yield item
            continue
        key = next(key for n in count(number) if (key := f"E{n}") not in taken)
        taken.add(key)
        yield replace(item, record=replace(item.record, id=key), key=key)


def read_item(list_key: str, place: str | Node, map_id: str | None) -> ListedRecord:
    """Read a record from its text, or where it is laid out in another way, from its node."""
    text = place if isinstance(place, str) else None
    data: Data = None if text is None else read_plain_record(text)
    node = None if data is not None else _node_of(list_key, place)
    data = data_of(node) if node is not None else data
    try:
        record = read_record(list_key, data, map_id)
    except SemanticMapError as error:
        path = error.path if isinstance(error, WrongRecordError) else ()
        line, column = locate(node or _node_of(list_key, place), path)
        raise TextFaultError(error.message, hint=error.hint, line=line, column=column) from error
    misspelt = find_misspelt_keys(data) if list_key == "waypoints" else ()
    return ListedRecord(record, key_of(record), text, tuple(misspelt))


def _node_of(list_key: str, place: str | Node) -> Node:
    """Return the node of an item of a list, given its text or that node."""
    if not isinstance(place, str):
        return place
    tree = compose(place)
    if isinstance(tree, SequenceNode) and len(tree.value) == 1:
        node: Node = tree.value[0]
        return node
    first_key = FIRST_KEYS[list_key]
    raise TextFaultError(
        f"This is not one of the {list_key}.",
        hint=f"Begin each with `- {first_key}:`, with its other keys below `{first_key}`.",
        line=1,
        column=len(place) - len(place.lstrip()) + 1,
    )


def _find_warnings(
    root: dict[str, Data], places: Iterable[ListedRecord], sections: tuple[Section, ...]
) -> Iterator[str]:
    for key, known in find_misspelt_keys(root, FILE):
        yield f"The key {quote_name(key)} of the file is not used; '{known}' would be."
    misspelt = [
        (number, item, *keys) for number, item in enumerate(places) for keys in item.misspelt
    ]
    for number, item, key, known in misspelt[:_MAX_WARNINGS]:
        line = _first_line("waypoints", sections, number)
        what = f"{quote_name(key)} of {quote_name(cast('Waypoint', item.record).name)}"
        yield f"The key {what} (line {line}) is not used; '{known}' would be."
    if len(misspelt) > _MAX_WARNINGS:
        yield f"{len(misspelt) - _MAX_WARNINGS} more keys look misspelt."
