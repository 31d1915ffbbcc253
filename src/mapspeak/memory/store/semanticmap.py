"""The semantic map's file: read by everybody, written by mapspeak, edited by people.

Reading and writing are synchronous and safe between processes and threads: a store holds nothing
but what it read last.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from mapspeak.errors import SemanticMapError
from mapspeak.memory.events import Event
from mapspeak.memory.frames import Frames
from mapspeak.memory.merging import Merge, merge_waypoint
from mapspeak.memory.quoting import clean_line, name_key
from mapspeak.memory.store.document import MapDocument, parse_document
from mapspeak.memory.store.durable import DurableFile, Fingerprint
from mapspeak.memory.store.memorystore import (
    WriteReceipt,
    event_in_its_frame,
    in_its_frame,
    require_same_map,
)
from mapspeak.memory.store.rewriting import (
    bound_to,
    with_event,
    with_frames,
    with_waypoint,
    with_waypoints,
    without_waypoint,
)
from mapspeak.memory.walls import WallFolder
from mapspeak.memory.waypoint import SemanticMap, Waypoint

LOCK_TIMEOUT_S = 5.0

_N_TRIES = 5
"""How often a write starts anew because an editor saved the file in the same moment."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Seen:
    """The file as it was read last."""

    fingerprint: Fingerprint | None
    document: MapDocument | None
    fault: SemanticMapError | None


class SemanticMapStore:
    """The semantic map in one YAML file.

    Args:
        path: The file; it and its folder need not exist yet.
        map_id: The map that the robot is on. None takes the file for what it says it is.
    """

    def __init__(
        self, path: Path, *, map_id: str | None = None, lock_timeout_s: float = LOCK_TIMEOUT_S
    ) -> None:
        self.path = path
        self.walls = WallFolder(path)
        self.map_id = clean_line(map_id or "") or None
        self._file = DurableFile(path, lock_timeout_s=lock_timeout_s)
        self._seen: _Seen | None = None

    def read(self) -> SemanticMap:
        """Return all remembered places; look into the file only where it changed.

        A file that was broken by hand since gives the places read before, with a warning.
        """
        seen = self._look()
        if seen.document is None:
            raise _raised_again(seen.fault)
        places = seen.document.to_map()
        return replace(places, warnings=(*places.warnings, *self._warnings(seen)))

    def read_events(self) -> tuple[Event, ...]:
        """Return all events of the file, also those that are over."""
        return tuple(record.event for record in self._document().events.values())

    def read_entry(self, key: str) -> str | None:
        """Return what the file says under a key of its own."""
        return self._document().find_entry(key)

    def write_event(self, event: Event) -> Event:
        """Write an event, in its own record where its id is there already."""

        def write(document: MapDocument) -> MapDocument:
            bound = document if event.frame else bound_to(document, self.map_id)
            return with_event(bound, _event_in_its_frame(document, event))[0]

        _, after = self.rewrite(write)
        ids = [event.id] if event.id else list(after.events)[-1:]
        return after.events[ids[0]].event

    def write(self, waypoint: Waypoint) -> WriteReceipt:
        """Create a waypoint, or change the record of that name."""
        return self._write(waypoint, lambda _, placed: placed)

    def write_all(self, change: Callable[[SemanticMap], Iterable[Waypoint]]) -> None:
        """Write many waypoints, all or none; into the file of whichever map they are of."""
        self.rewrite(lambda document: with_waypoints(document, change(document.to_map())))

    def remember(
        self, waypoint: Waypoint, *, gone: Iterable[str] = ()
    ) -> tuple[WriteReceipt, Merge]:
        """Join a waypoint with what is remembered under its name."""
        labels = tuple(gone)
        merges: list[Merge] = []

        def join(before: Waypoint | None, placed: Waypoint) -> Waypoint:
            merges.append(merge_waypoint(before, placed, gone=labels))
            return merges[-1].waypoint

        receipt = self._write(waypoint, join)
        return receipt, merges[-1]

    def remove(self, name: str) -> Waypoint | None:
        """Take a record out of the file, with the comments in it."""
        key = name_key(name)
        if key not in self._document().records:
            return None
        before, _ = self.rewrite(lambda document: without_waypoint(document, key))
        return _known(before, key)

    def write_frames(self, change: Callable[[Frames], Frames]) -> Frames:
        """Write what is known of frames; no record changes."""
        _, after = self.rewrite(lambda document: with_frames(document, change(document.frames)))
        return after.frames

    def _write(
        self, waypoint: Waypoint, change: Callable[[Waypoint | None, Waypoint], Waypoint]
    ) -> WriteReceipt:
        map_id = self.map_id or waypoint.map_id
        require_same_map(waypoint, self.map_id)
        keys: list[str] = []

        def write(document: MapDocument) -> MapDocument:
            find = partial(_known, document)
            placed = in_its_frame(waypoint, find_known=find, frames=document.frames)
            keys.append(name_key(placed.name))
            bound = document if waypoint.frame else bound_to(document, map_id)
            return with_waypoint(bound, change(_known(document, keys[-1]), placed))

        before, after = self.rewrite(write)
        return WriteReceipt(
            waypoint=after.records[keys[-1]].waypoint,
            previous=_known(before, keys[-1]),
        )

    def _document(self) -> MapDocument:
        seen = self._look()
        if seen.document is None:
            raise _raised_again(seen.fault)
        return seen.document

    def rewrite(
        self, change: Callable[[MapDocument], MapDocument]
    ) -> tuple[MapDocument, MapDocument]:
        """Replace the file by a changed one and return both, whoever else writes meanwhile.

        Args:
            change: Called with the file as it is, once or more often; whichever map it belongs to.

        Raises:
            SemanticMapError: The file has a fault, cannot be written, or is held by another
                program. Nothing was changed.
        """
        self._look()  # Others do not wait while this reads what it never read before.
        with self._file.locked():
            for _ in range(_N_TRIES):
                seen = self._look()
                if seen.document is None or seen.fault is not None:
                    raise _raised_again(seen.fault)
                after = change(seen.document)
                fingerprint = self._file.replace(after.content, expected=seen.fingerprint)
                if fingerprint is not None:
                    self._seen = _Seen(fingerprint=fingerprint, document=after, fault=None)
                    return seen.document, after
        message = f"Another program changes {self.path} all the time; nothing was written."
        raise SemanticMapError(message, hint="End that program, then write again.")

    def _look(self) -> _Seen:
        """Return what the file says now, reading only what changed."""
        seen = self._seen
        last = seen.document if seen else None
        try:
            if seen is not None and seen.fingerprint == self._file.fingerprint():
                return seen
            content, fingerprint = self._file.read()
        except SemanticMapError as fault:
            # Not kept: a permission can change while the file does not.
            return _Seen(fingerprint=None, document=last, fault=fault)
        try:
            document = parse_document(content, source=str(self.path), previous=last)
            seen = _Seen(fingerprint=fingerprint, document=document, fault=None)
        except SemanticMapError as fault:
            seen = _Seen(fingerprint=fingerprint, document=last, fault=fault)
        self._seen = seen
        return seen

    def _warnings(self, seen: _Seen) -> Iterator[str]:
        if seen.fault is not None:
            yield f"{seen.fault} Until then, the waypoints read before are given."


def _event_in_its_frame(document: MapDocument, event: Event) -> Event:
    record = document.events.get(event.id)
    return event_in_its_frame(event, None if record is None else record.event, document.frames)


def _known(document: MapDocument, key: str) -> Waypoint | None:
    record = document.records.get(key)
    return None if record is None else record.waypoint


def _raised_again(fault: SemanticMapError | None) -> SemanticMapError:
    """Return a fresh copy of a kept fault, which would gather traces otherwise."""
    assert fault is not None, "a file without a document has a fault"  # noqa: S101 - our belief
    return SemanticMapError(fault.message, hint=fault.hint)
