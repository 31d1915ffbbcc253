"""A changed file: one record written, replaced or taken out, every other character as it was."""

from mapspeak.errors import SemanticMapError
from mapspeak.semantic.mapfile.document import MapDocument, parse_document
from mapspeak.semantic.mapfile.editing import edited_record
from mapspeak.semantic.mapfile.rendering import entry_text, record_text
from mapspeak.semantic.mapfile.schema import FILE_VERSION, record_data
from mapspeak.semantic.mapfile.tree import Data, ListNode, line_and_column
from mapspeak.semantic.waypoint import Waypoint, name_key

_GREETING = "# mapspeak semantic map. Edit freely: comments and order are kept.\n"
_OPTIONAL_KEYS = ("stamp_s", "recorded_at", "room_id", "picture")


def bound_to(document: MapDocument, map_id: str) -> MapDocument:
    """Gives the file with the map that its waypoints belong to."""
    return with_entry(document, "map", map_id)


def with_entry(document: MapDocument, key: str, value: str) -> MapDocument:
    """Gives the file with one key of its own, beside the records, saying something else."""
    text = document.text
    entry = entry_text(key, value, indent=0)
    present = document.root.find_value(key) if document.root else None
    listed = document.root.find_key("waypoints") if document.root else None
    if present is not None:
        start, end = map(document.layout.offset_in_text, (present.start, present.end))
        text = text[:start].rstrip(" ") + entry.removeprefix(f"{key}:") + text[end:]
    elif listed is not None:
        start = document.layout.offset_in_text(listed.start)
        text = text[:start] + entry + "\n" + text[start:]
    elif document.root is not None:
        text = _ended(text) + entry + "\n"
    else:
        text = _ended(text or _GREETING) + f"version: {FILE_VERSION}\n{entry}\n"
    return _reparsed(document, text, keys=set(document.records))


def with_waypoint(document: MapDocument, waypoint: Waypoint) -> MapDocument:
    """Gives the file with a waypoint written: in its own record if its name is there already.

    Raises:
        SemanticMapError: The file is laid out in a way that cannot be written to.
    """
    key = name_key(waypoint.name)
    record = document.records.get(key)
    said = record_data(waypoint)
    if record is None:
        text = _with_record(document, said)
    else:
        _require_cut(document, record.start)
        block = document.text[record.start : record.end]
        changed = edited_record(block, old=record_data(record.reading.waypoint), new=said)
        text = document.text[: record.start] + changed + document.text[record.end :]
    written = _reparsed(document, text, keys={*document.records, key})
    if record_data(written.records[key].reading.waypoint) != said:
        raise _layout_error(document, record.start if record else len(document.text))
    return written


def without_waypoint(document: MapDocument, key: str) -> MapDocument:
    """Gives the file without one record; comments around it stay.

    Raises:
        SemanticMapError: The file is laid out in a way that cannot be written to.
    """
    record = document.records[key]
    _require_cut(document, record.start)
    before, after = document.text[: record.start], document.text[record.end :]
    if before.endswith("\n\n") and after.startswith("\n"):
        after = after[1:]
    return _reparsed(document, before + after, keys=set(document.records) - {key})


def _with_record(document: MapDocument, said: dict[str, Data]) -> str:
    layout, text = document.layout, document.text
    shown = {k: v for k, v in said.items() if v is not None or k not in _OPTIONAL_KEYS}
    record = record_text(shown, indent=layout.indent)
    if not layout.spans:
        return _with_first_record(document, record)
    last_end = layout.spans[-1][1]
    is_airy = len(layout.spans) < 2 or text[layout.spans[-2][1] :].startswith("\n")
    gap = "\n" if is_airy else ""
    return _ended(text[:last_end]) + gap + record + text[last_end:]


def _with_first_record(document: MapDocument, record: str) -> str:
    text, root = document.text, document.root
    if root is None:
        return _ended(text or _GREETING) + f"version: {FILE_VERSION}\nwaypoints:\n{record}"
    key, listed = root.find_key("waypoints"), root.find_value("waypoints")
    if key is None or listed is None:
        return _ended(text) + f"waypoints:\n{record}"
    if isinstance(listed, ListNode) and listed.items:
        raise _layout_error(document, key.start)
    line_end = _line_end(text, listed.end)
    head = text[: listed.start].rstrip(" ") + text[listed.end : line_end]
    return f"{head}\n{record}{text[line_end + 1 :]}"


def _require_cut(document: MapDocument, start: int) -> None:
    if not document.layout.spans:
        raise _layout_error(document, start)


def _reparsed(document: MapDocument, text: str, *, keys: set[str]) -> MapDocument:
    """Reads the changed text before anybody relies on it."""
    try:
        changed = parse_document(document.encoded(text), source=document.source, previous=document)
    except SemanticMapError as error:
        raise _layout_error(document, 0) from error
    if set(changed.records) != keys:
        raise _layout_error(document, 0)
    return changed


def _layout_error(document: MapDocument, offset: int) -> SemanticMapError:
    line, _ = line_and_column(document.text, offset)
    return SemanticMapError(
        f"{document.source}, line {line}: mapspeak reads this layout, but cannot write to it.",
        hint="Put `waypoints:` at the start of a line and each waypoint below it as `- name: ...`, "
        "its other keys on lines of their own. Nothing was written.",
    )


def _ended(text: str) -> str:
    return text if not text or text.endswith("\n") else text + "\n"


def _line_end(text: str, offset: int) -> int:
    end = text.find("\n", offset)
    return len(text) if end < 0 else end
