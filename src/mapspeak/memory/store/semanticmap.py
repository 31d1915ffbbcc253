"""The semantic map's file: read by everybody, written by mapspeak, edited by people.

Reading and writing are synchronous and safe between processes and threads: a store holds nothing
but what it read last.
"""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import cast

from mapspeak.errors import SemanticMapError
from mapspeak.memory.durable import DurableFile, Fingerprint
from mapspeak.memory.events import Event
from mapspeak.memory.frames import Frames
from mapspeak.memory.store.document import MapDocument, parse_document
from mapspeak.memory.store.memorystore import MemoryStore, OneRecord, Records, Result
from mapspeak.memory.store.reading import Contents
from mapspeak.memory.store.records import key_of, list_key_of
from mapspeak.memory.walls import WallFolder
from mapspeak.memory.waypoint import SemanticMap, Waypoint

LOCK_TIMEOUT_S = 5.0
KEPT_FROM = 500
"""Records are kept once so many were parsed anew: fewer are parsed in a moment."""
LEAST_BYTES = 40
"""No record is shorter."""

_N_TRIES = 5
"""Retries of a write while an editor saves the file at the same moment."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Seen:
    """The file as it was read last."""

    fingerprint: Fingerprint | None
    document: MapDocument | None
    fault: SemanticMapError | None


class SemanticMapStore(MemoryStore):
    """The semantic map in one YAML file.

    Args:
        path: The file; it and its folder need not exist yet.
        map_id: The map that the robot is on. None takes the file for what it says it is.
        looking: Held while the file is looked at or replaced, so that of several threads one reads
            it, and none what was written here.
    """

    def __init__(
        self,
        path: Path,
        *,
        map_id: str | None = None,
        lock_timeout_s: float = LOCK_TIMEOUT_S,
        looking: AbstractContextManager[object] | None = None,
    ) -> None:
        super().__init__(path=path, walls=WallFolder(path), map_id=map_id)
        self._file = DurableFile(path, lock_timeout_s=lock_timeout_s)
        self._seen: _Seen | None = None
        self._looking = looking or nullcontext()

    def read(self) -> SemanticMap:
        """Return all remembered places; look into the file only where it changed.

        A file that was broken by hand since gives the places read before, with a warning.
        """
        seen = self._look()
        places = self._document(seen).places
        if seen.fault is None:
            return places
        warning = f"{seen.fault} Until then, the waypoints read before are given."
        return replace(places, warnings=(*places.warnings, warning))

    def read_events(self) -> tuple[Event, ...]:
        """Return all events of the file, also those that are over."""
        return cast("tuple[Event, ...]", self._document(self._look()).records_of("events"))

    def change(
        self,
        change: Callable[[Records], Result],
        *,
        alone: bool = False,  # noqa: ARG002 - every writer of a file is alone
        binding: str | None = None,  # noqa: ARG002 - likewise
    ) -> Result:
        """Replace the file by a changed one, despite concurrent writers."""
        self._look()  # Others do not wait while this reads what it never read before.
        with self._file.locked():
            for _ in range(_N_TRIES):
                seen = self._look()
                if seen.fault is not None:
                    raise _raised_again(seen.fault)
                before = self._document(seen)
                records = _FileRecords(before)
                result = change(records)
                if records.document is before:
                    return result
                if self._replace(seen, records.document):
                    return result
        message = f"Another program changes {self.path} all the time; nothing was written."
        raise SemanticMapError(message, hint="End that program, then write again.")

    def _replace(self, seen: _Seen, document: MapDocument) -> bool:
        """Put a changed file in place of the one that was seen; False if it is another by now.

        Others look when it is known that they need not read it.
        """
        content = document.content
        with self._looking:
            fingerprint = self._file.replace(content, expected=seen.fingerprint)
            if fingerprint is not None:
                self._seen = _Seen(fingerprint=fingerprint, document=document, fault=None)
        return fingerprint is not None

    @staticmethod
    def _document(seen: _Seen) -> MapDocument:
        if seen.document is None:
            raise _raised_again(seen.fault)
        return seen.document

    def _look(self) -> _Seen:
        """Return what the file says now, reading only what changed."""
        with self._looking:
            return self._read_changed()

    def _read_changed(self) -> _Seen:
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
            document = self._parse(content, last)
            seen = _Seen(fingerprint=fingerprint, document=document, fault=None)
        except SemanticMapError as fault:
            seen = _Seen(fingerprint=fingerprint, document=last, fault=fault)
        self._seen = seen
        return seen

    def _parse(self, content: bytes, last: MapDocument | None) -> MapDocument:
        parse = partial(parse_document, content, source=str(self.path))
        if last is not None or self.kept is None or len(content) < KEPT_FROM * LEAST_BYTES:
            return parse(previous=last)
        kept = self.kept.load_records() or Contents()
        document = parse(previous=kept)
        of_kept, of_file = (
            set(map(id, each.lists["waypoints"].values())) for each in (kept, document)
        )
        if len(of_file - of_kept) >= KEPT_FROM:
            self.kept.keep_records(Contents(lists=document.lists, map_id=document.map_id))
        return document


class _FileRecords:
    """The records of a file while they are changed; `Records`."""

    def __init__(self, document: MapDocument) -> None:
        self.document = document

    @property
    def frames(self) -> Frames:
        """All of them."""
        return self.document.frames

    def read(self) -> SemanticMap:
        """Return all places."""
        return self.document.places

    def read_events(self) -> Mapping[str, Event]:
        """Return all events by their ids."""
        events = cast("tuple[Event, ...]", self.document.records_of("events"))
        return {event.id: event for event in events}

    def find_place(self, key: str) -> Waypoint | None:
        """Return what is remembered under a `name_key`."""
        return cast("Waypoint | None", self.document.find("waypoints", key))

    def bind(self, map_id: str | None) -> None:
        """Bind the file to the map that its waypoints belong to, where it does not say one."""
        self.document = self.document.bound_to(map_id)

    def put(self, record: OneRecord) -> OneRecord:
        """Write a record; return it as it reads."""
        self.document = self.document.with_record(record)
        return cast("OneRecord", self.document.find(list_key_of(record), key_of(record)))

    def rename_place(self, former_key: str, waypoint: Waypoint) -> None:
        """Write a place where the one of another `name_key` was, which is removed."""
        self.document = self.document.with_record(waypoint, former_key=former_key)


def _raised_again(fault: SemanticMapError | None) -> SemanticMapError:
    """Return a fresh copy of a kept fault, which would gather traces otherwise."""
    assert fault is not None, "a file without a document has a fault"  # noqa: S101 - our belief
    return SemanticMapError(fault.message, hint=fault.hint)
