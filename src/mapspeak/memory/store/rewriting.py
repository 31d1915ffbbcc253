"""A changed file: a record, an event or all places written; every other character as it was."""

from collections.abc import Iterable
from collections.abc import Set as AbstractSet
from dataclasses import replace

from mapspeak.errors import SemanticMapError
from mapspeak.memory.events import Event
from mapspeak.memory.frames import Frames
from mapspeak.memory.quoting import name_key
from mapspeak.memory.store.document import MapDocument, parse_text
from mapspeak.memory.store.editing import edited_record, entry_text, record_text
from mapspeak.memory.store.eventschema import event_data
from mapspeak.memory.store.frameschema import frame_data, read_frames
from mapspeak.memory.store.memorystore import free_event_id
from mapspeak.memory.store.schema import FILE_VERSION, record_data
from mapspeak.memory.store.tree import (
    Data,
    ListNode,
    MappingNode,
    line_and_column,
)
from mapspeak.memory.waypoint import Waypoint

_GREETING = "# mapspeak semantic map. Edit freely: comments and order are kept.\n"
_INDENT = 2
_OPTIONAL_KEYS = ("stamp_s", "recorded_at", "room_id", "picture", "frame", "gone")


def bound_to(document: MapDocument, map_id: str | None) -> MapDocument:
    """Return the file with the map that its waypoints belong to, where it does not say one."""
    if document.map_id is not None or map_id is None:
        return document
    return with_entry(document, "map", map_id)


def with_entry(document: MapDocument, key: str, value: str) -> MapDocument:
    """Return the file with one key of its own, beside the records, saying something else."""
    text = document.text
    entry = entry_text(key, value, indent=0)
    present = document.root.find_value(key) if document.root else None
    is_listed = document.root is not None and document.root.find_value("waypoints") is not None
    if present is not None:
        start, end = map(document.layout.offset_in_text, (present.start, present.end))
        text = text[:start].rstrip(" ") + entry.removeprefix(f"{key}:") + text[end:]
    elif is_listed:
        start = _start_of_records(document)
        text = text[:start] + entry + "\n" + text[start:]
    elif document.root is not None:
        text = _ended(text) + entry + "\n"
    else:
        text = _ended(text or _GREETING) + f"version: {FILE_VERSION}\n{entry}\n"
    return _reparsed(document, text)


def with_waypoint(document: MapDocument, waypoint: Waypoint) -> MapDocument:
    """Return the file with a waypoint written: in its own record if its name is there already.

    Raises:
        SemanticMapError: The file is laid out in a way that cannot be written to.
    """
    key = name_key(waypoint.name)
    record = document.records.get(key)
    said = record_data(waypoint)
    if record is None:
        text = _with_record(document, said)
    else:
        start, end = document.span_of(key)
        _require_cut(document, start)
        change = (start, end, record_data(record.waypoint), said)
        text = _edited(document, [change], "waypoints")
    written = _reparsed(document, text, keys=document.records.keys() | {key})
    if record_data(written.records[key].waypoint) != said:
        raise _layout_error(document, document.span_of(key)[0] if record else len(document.text))
    return written


def with_waypoints(document: MapDocument, waypoints: Iterable[Waypoint]) -> MapDocument:
    """Return the file with several waypoints written, bound to the map that they are of."""
    for waypoint in waypoints:
        document = with_waypoint(bound_to(document, waypoint.map_id), waypoint)
    return document


def without_waypoint(document: MapDocument, key: str) -> MapDocument:
    """Return the file without the record of a `name_key`; without any change where none has it.

    Raises:
        SemanticMapError: The file is laid out in a way that cannot be written to.
    """
    if key not in document.records:
        return document
    start, end = document.span_of(key)
    _require_cut(document, start)
    text = document.text
    # Of a blank line on either side, one is enough.
    if text[:start].endswith("\n\n") and text[end : end + 1] in ("", "\n"):
        start -= 1
    return _reparsed(document, text[:start] + text[end:], keys=document.records.keys() - {key})


def with_event(document: MapDocument, event: Event) -> tuple[MapDocument, Event]:
    """Return the file with an event written: in its own record if its id is there already.

    Returns:
        The file, and the event as it reads there, with its id.

    Raises:
        SemanticMapError: The file is laid out in a way that cannot be written to.
    """
    named = event if event.id else replace(event, id=free_event_id(document.events))
    record = document.events.get(named.id)
    if record is None:
        text = _with_new_item(document, "events", event_data(named))
    else:
        change = (record.start, record.end, event_data(record.event), event_data(named))
        text = _edited(document, [change], "events")
    changed = _reparsed(document, text, list_key="events")
    written = changed.events.get(named.id)
    if written is None or event_data(written.event) != event_data(named):
        raise _layout_error(document, 0, "events")
    return changed, written.event


def with_frames(document: MapDocument, frames: Frames) -> MapDocument:
    """Return the file with frames that read otherwise, or that it did not have, written.

    Raises:
        SemanticMapError: The file is laid out in a way that cannot be written to.
    """
    changes, known = list[_Change](), document.frames.by_id
    for frame, node in read_frames(document.root):
        start, end = map(document.layout.offset_in_text, (node.start, node.end))
        written = frames.by_id.get(frame.id, frame)
        if written != frame:
            changes.append((start, end, frame_data(frame), frame_data(written)))
    after = document
    if changes:
        after = _reparsed(after, _edited(after, changes, "frames"), list_key="frames")
    for frame in frames.items:
        if frame.id not in known:
            text = _with_new_item(after, "frames", frame_data(frame))
            after = _reparsed(after, text, list_key="frames")
    if [frame_data(each) for each in after.frames.items] != list(map(frame_data, frames.items)):
        raise _layout_error(document, 0, "frames")
    return after


_Change = tuple[int, int, dict[str, Data], dict[str, Data]]
"""From where to where a record stands, what it says, and what it is to say."""


def _edited(document: MapDocument, changes: Iterable[_Change], list_key: str) -> str:
    """Return the file's text with some records changed: comments and spelling stay."""
    text, pieces, end = document.text, list[str](), 0
    for start, stop, old, new in sorted(changes, key=lambda change: change[0]):
        # As an item of its own, indented as it was.
        dash = text[text.rfind("\n", 0, start) + 1 : start]
        if dash.strip(" -"):
            raise _layout_error(document, start, list_key)
        item = edited_record(" " * len(dash) + text[start:stop], old=old, new=new)
        pieces += [text[end:start], item[len(dash) :]]
        end = stop
    return "".join([*pieces, text[end:]])


def _with_record(document: MapDocument, said: dict[str, Data]) -> str:
    layout, text = document.layout, document.text
    shown = {k: v for k, v in said.items() if v is not None or k not in _OPTIONAL_KEYS}
    record = record_text(shown, indent=layout.indent)
    if not layout.spans:
        return _with_first_item(document, "waypoints", record)
    last_end = layout.spans[-1][1]
    is_airy = len(layout.spans) < 2 or text[layout.spans[-2][1] :].startswith("\n")
    gap = "\n" if is_airy else ""
    return _ended(text[:last_end]) + gap + record + text[last_end:]


def _with_new_item(document: MapDocument, list_key: str, said: dict[str, Data]) -> str:
    """Return the text with an item more at the end of a list beside the records."""
    listed = document.root.find_value(list_key) if document.root else None
    if not isinstance(listed, ListNode) or not listed.items:
        return _with_first_item(document, list_key, record_text(said, indent=_INDENT))
    last, text = listed.items[-1], document.text
    start, end = map(document.layout.offset_in_text, (last.start, last.end))
    dash = text[text.rfind("\n", 0, start) + 1 : start].find("-")
    if listed.is_flow or not isinstance(last, MappingNode) or dash < 0:
        raise _layout_error(document, start, list_key)
    line_end = _line_end(text, end)
    return f"{text[:line_end]}\n{record_text(said, indent=dash)}{text[line_end + 1 :]}"


def _with_first_item(document: MapDocument, list_key: str, item: str) -> str:
    """Return the text with a first item below a key, in place of `[]`, null or nothing."""
    text, listed = document.text, document.root and document.root.find_value(list_key)
    if document.root is None and list_key == "waypoints":
        text = _ended(text or _GREETING) + f"version: {FILE_VERSION}\n"
    if listed is None and list_key == "frames":
        start = _start_of_records(document)
        return f"{_ended(text[:start])}{list_key}:\n{item}{text[start:]}"
    if listed is None:
        return _ended(text) + f"{list_key}:\n{item}"
    start, end = map(document.layout.offset_in_text, (listed.start, listed.end))
    if (isinstance(listed, ListNode) and listed.items) or "#" in text[start:end]:
        raise _layout_error(document, start, list_key)
    line_end = _line_end(text, end)
    rest = text[end:line_end].rstrip()
    if start < end and rest:
        # Where a value went, a comment keeps its distance.
        rest = f"  {rest.strip()}"
    head = text[:start].rstrip(" \t") + rest
    return f"{head}\n{item}{text[line_end + 1 :]}"


def _start_of_records(document: MapDocument) -> int:
    """Return where the key `waypoints` stands in the text; its end without one."""
    keys = document.root.entries if document.root else ()
    listed = next((name for name, _ in keys if name.text == "waypoints"), None)
    return len(document.text) if listed is None else document.layout.offset_in_text(listed.start)


def _require_cut(document: MapDocument, start: int) -> None:
    if not document.layout.spans:
        raise _layout_error(document, start)


def _reparsed(
    document: MapDocument,
    text: str,
    *,
    keys: AbstractSet[str] | None = None,
    list_key: str = "waypoints",
) -> MapDocument:
    """Read the changed text before anybody relies on it."""
    try:
        changed = parse_text(
            text,
            source=document.source,
            line_end=document.line_end,
            has_bom=document.has_bom,
            previous=document,
        )
    except SemanticMapError as error:
        raise _layout_error(document, 0, list_key) from error
    if changed.records.keys() != (document.records.keys() if keys is None else keys):
        raise _layout_error(document, 0, list_key)
    return changed


_ITEMS = {
    "waypoints": ("waypoint", "name"),
    "events": ("event", "text"),
    "frames": ("frame", "id"),
}
"""What the items of each list are called, and their first key."""


def _layout_error(
    document: MapDocument, offset: int, list_key: str = "waypoints"
) -> SemanticMapError:
    line, _ = line_and_column(document.text, offset)
    item, first_key = _ITEMS[list_key]
    return SemanticMapError(
        f"{document.source}, line {line}: mapspeak reads this layout, but cannot write to it.",
        hint=f"Put `{list_key}:` at the start of a line and each {item} below it as "
        f"`- {first_key}: ...`, its other keys on lines of their own. Nothing was written.",
    )


def _ended(text: str) -> str:
    return text if not text or text.endswith("\n") else text + "\n"


def _line_end(text: str, offset: int) -> int:
    end = text.find("\n", offset)
    return len(text) if end < 0 else end
