"""A changed file: an event written or changed, every other character as it was."""

from dataclasses import replace

from mapspeak.errors import SemanticMapError
from mapspeak.semantic.events.event import Event
from mapspeak.semantic.mapfile.document import MapDocument, parse_document
from mapspeak.semantic.mapfile.editing import edited_record
from mapspeak.semantic.mapfile.eventschema import event_data
from mapspeak.semantic.mapfile.rendering import record_text
from mapspeak.semantic.mapfile.tree import ListNode, MappingNode, Node, ScalarNode

__all__ = ["changed_events", "with_event"]

_INDENT = 2


def with_event(document: MapDocument, event: Event) -> tuple[MapDocument, Event]:
    """Gives the file with an event written: in its own record if its id is there already.

    Returns:
        The file, and the event as it reads there, with its id.

    Raises:
        SemanticMapError: The file is laid out in a way that cannot be written to.
    """
    named = event if event.id else replace(event, id=_free_id(document))
    if named.id in document.events:
        text = changed_events(document, {named.id: named})
    else:
        text = _with_new(document, named)
    changed = _reparsed(document, text)
    written = changed.events.get(named.id)
    if written is None or event_data(written.event) != event_data(named):
        raise _layout_error(document)
    return changed, written.event


def changed_events(document: MapDocument, events: dict[str, Event]) -> str:
    """Gives the file's text with some of its events changed."""
    text = document.text
    for record in sorted(document.events.values(), key=lambda each: -each.start):
        new = events.get(record.event.id)
        if new is None:
            continue
        # As an item of its own, indented as it was: comments and spelling stay.
        line_start = text.rfind("\n", 0, record.start) + 1
        before, block = text[line_start : record.start], text[record.start : record.end]
        if before.strip(" -"):
            raise _layout_error(document)
        item = " " * len(before) + block
        edited = edited_record(item, old=event_data(record.event), new=event_data(new))
        text = text[:line_start] + before + edited[len(before) :] + text[record.end :]
    return text


def _with_new(document: MapDocument, event: Event) -> str:
    text, root = document.text, document.root
    ended = text if not text or text.endswith("\n") else text + "\n"
    said = event_data(event)
    key = root.find_key("events") if root else None
    if root is None or key is None:
        return f"{ended}events:\n{record_text(said, indent=_INDENT)}"
    listed = root.find_value("events")
    if isinstance(listed, ListNode) and listed.items:
        return _behind_last(document, listed, event)
    return _in_empty(document, key, listed, record_text(said, indent=_INDENT))


def _in_empty(document: MapDocument, key: ScalarNode, listed: Node | None, record: str) -> str:
    """Gives the text with a first record below the key, in place of `[]` or null."""
    text = document.text
    # Where nothing stands behind the key, a value has no place of its own.
    is_written = listed is not None and listed.end > listed.start
    node = listed if listed is not None and is_written else key
    start, end = map(document.layout.offset_in_text, (node.start, node.end))
    before, behind = (text[:start], end) if is_written else (text[:end], end)
    if is_written and "#" in text[start:end]:
        raise _layout_error(document)
    line_end = _line_end(text, behind)
    rest = text[behind:line_end].rstrip()
    head = before if rest else before.rstrip(" \t")
    return f"{head}{rest}\n{record}{text[line_end + 1 :]}"


def _behind_last(document: MapDocument, listed: ListNode, event: Event) -> str:
    last = listed.items[-1]
    if listed.is_flow or not isinstance(last, MappingNode):
        raise _layout_error(document)
    text = document.text
    start, end = map(document.layout.offset_in_text, (last.start, last.end))
    line_start = text.rfind("\n", 0, start) + 1
    dash = text[line_start:start].find("-")
    if dash < 0:
        raise _layout_error(document)
    line_end = _line_end(text, end)
    head = text[:line_end] + "\n"
    return head + record_text(event_data(event), indent=dash) + text[line_end + 1 :]


def _free_id(document: MapDocument) -> str:
    numbers = [int(each[1:]) for each in document.events if each[:1] == "E" and each[1:].isdigit()]
    return f"E{max(numbers, default=0) + 1}"


def _reparsed(document: MapDocument, text: str) -> MapDocument:
    try:
        changed = parse_document(document.encoded(text), source=document.source, previous=document)
    except SemanticMapError as error:
        raise _layout_error(document) from error
    if set(changed.records) != set(document.records):
        raise _layout_error(document)
    return changed


def _layout_error(document: MapDocument) -> SemanticMapError:
    return SemanticMapError(
        f"mapspeak reads the events of {document.source}, but cannot write to them.",
        hint="Put `events:` at the start of a line and each event below it as `- text: ...`, its "
        "other keys on lines of their own. Nothing was written.",
    )


def _line_end(text: str, offset: int) -> int:
    end = text.find("\n", offset)
    return len(text) if end < 0 else end
