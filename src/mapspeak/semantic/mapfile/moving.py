"""A file whose places have all moved with their map, in one change."""

from dataclasses import replace

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.semantic.events.event import Event
from mapspeak.semantic.mapfile.document import MapDocument, parse_document
from mapspeak.semantic.mapfile.editing import edited_record
from mapspeak.semantic.mapfile.eventrewriting import changed_events
from mapspeak.semantic.mapfile.rewriting import with_entry
from mapspeak.semantic.mapfile.schema import record_data

__all__ = ["moved"]


def moved(document: MapDocument, motion: Pose, *, entries: dict[str, str]) -> MapDocument:
    """Gives the file with every waypoint and event moved.

    Args:
        document: The file.
        motion: From the frame of its poses to the new one.
        entries: Keys of the file itself that change with it, such as `map`.

    Raises:
        SemanticMapError: The file is laid out in a way that cannot be written to.
    """
    if document.records and not document.layout.spans:
        raise _layout_error(document)
    after = document
    for key, value in entries.items():
        after = with_entry(after, key, value)
    events = {each.event.id: _moved_event(each.event, motion) for each in after.events.values()}
    after = _reparsed(after, changed_events(after, events))
    return _reparsed(after, _with_moved_records(after, motion))


def _with_moved_records(document: MapDocument, motion: Pose) -> str:
    pieces, end = [], 0
    for record in sorted(document.records.values(), key=lambda each: each.start):
        waypoint = record.reading.waypoint
        new = waypoint.moved(motion)
        block = document.text[record.start : record.end]
        changed = edited_record(block, old=record_data(waypoint), new=record_data(new))
        pieces += [document.text[end : record.start], changed]
        end = record.end
    return "".join([*pieces, document.text[end:]])


def _moved_event(event: Event, motion: Pose) -> Event:
    return replace(
        event,
        at=None if event.at is None else motion.transform(event.at),
        outlines=tuple(tuple(map(motion.transform, outline)) for outline in event.outlines),
    )


def _reparsed(document: MapDocument, text: str) -> MapDocument:
    changed = parse_document(document.encoded(text), source=document.source, previous=document)
    if changed.records.keys() != document.records.keys():
        raise _layout_error(document)
    return changed


def _layout_error(document: MapDocument) -> SemanticMapError:
    return SemanticMapError(
        f"mapspeak reads {document.source}, but cannot write to its layout.",
        hint="Put `waypoints:` at the start of a line and each waypoint below it as `- name: ...`. "
        "Nothing was written.",
    )
