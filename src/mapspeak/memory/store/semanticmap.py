"""The semantic map's file: read by everybody, written by mapspeak, edited by people.

Reading and writing are synchronous and safe between processes and threads: a store holds nothing
but what it read last.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from mapspeak.errors import SemanticMapError
from mapspeak.memory.events import Event
from mapspeak.memory.merging import Merge, merge_waypoint
from mapspeak.memory.quoting import clean_line, name_key, quote_name
from mapspeak.memory.store.document import MapDocument, parse_document
from mapspeak.memory.store.durable import DurableFile, Fingerprint
from mapspeak.memory.store.rewriting import bound_to, with_event, with_waypoint
from mapspeak.memory.waypoint import SemanticMap, Waypoint

LOCK_TIMEOUT_S = 5.0

_N_TRIES = 5
"""How often a write starts anew because an editor saved the file in the same moment."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WriteReceipt:
    """What a write did; it is on the disk.

    Attributes:
        waypoint: As it is remembered from now on: millimetres, hundredths of a degree.
    """

    waypoint: Waypoint
    previous: Waypoint | None
    n_waypoints: int


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
        self.map_id = clean_line(map_id or "") or None
        self._file = DurableFile(path, lock_timeout_s=lock_timeout_s)
        self._seen: _Seen | None = None

    def read(self) -> SemanticMap:
        """Return all remembered places; look into the file only where it changed.

        A file that was broken by hand since gives the places read before, with a warning.

        Raises:
            SemanticMapError: The file cannot be read, or has a fault and was never without one.
        """
        seen = self._look()
        if seen.document is None:
            raise _raised_again(seen.fault)
        places = seen.document.to_map()
        return replace(places, warnings=(*places.warnings, *self._warnings(seen)))

    def read_events(self) -> tuple[Event, ...]:
        """Return all events of the file, also those that are over; as `read` otherwise.

        Of a file that belongs to another map there are none: they are at other places here.
        """
        document = self._document()
        if not self._is_same_map(document.map_id):
            return ()
        return tuple(record.event for record in document.events.values())

    def read_entry(self, key: str) -> str | None:
        """Return what the file says under a key of its own, such as `snapshot`; as `read`."""
        return self._document().find_entry(key)

    def write_event(self, event: Event) -> Event:
        """Write an event, in its own record where its id is there already; return it with its id.

        Raises:
            SemanticMapError: As for `write`.
        """
        _, after = self._change(
            lambda document: with_event(bound_to(document, self.map_id), event)[0]
        )
        ids = [event.id] if event.id else list(after.events)[-1:]
        return after.events[ids[0]].event

    def write(self, waypoint: Waypoint) -> WriteReceipt:
        """Create a waypoint, or put it in place of the one of that name; done when it returns.

        Raises:
            SemanticMapError: The file belongs to another map, has a fault, cannot be written, or is
                held by another program. Nothing was changed.
        """
        return self._write(waypoint, lambda _: waypoint)

    def remember(
        self, waypoint: Waypoint, *, gone: Iterable[str] = ()
    ) -> tuple[WriteReceipt, Merge]:
        """Join a waypoint with what is remembered under its name; done when it returns.

        What another program remembers of it in the same moment is joined, too.

        Args:
            gone: Labels of landmarks that are not there any more.

        Raises:
            SemanticMapError: As for `write`.
        """
        labels = tuple(gone)
        merges: list[Merge] = []

        def join(before: Waypoint | None) -> Waypoint:
            merges.append(merge_waypoint(before, waypoint, gone=labels))
            return merges[-1].waypoint

        receipt = self._write(waypoint, join)
        return receipt, merges[-1]

    def _write(
        self, waypoint: Waypoint, change: Callable[[Waypoint | None], Waypoint]
    ) -> WriteReceipt:
        map_id = self.map_id or waypoint.map_id
        self._require_same_map(waypoint.map_id, f"The waypoint {quote_name(waypoint.name)}")
        key = name_key(waypoint.name)
        before, after = self._change(
            lambda document: with_waypoint(
                bound_to(document, map_id), change(_known(document, key))
            )
        )
        return WriteReceipt(
            waypoint=after.records[key].waypoint,
            previous=_known(before, key),
            n_waypoints=len(after.records),
        )

    def _document(self) -> MapDocument:
        seen = self._look()
        if seen.document is None:
            raise _raised_again(seen.fault)
        return seen.document

    def _change(
        self, change: Callable[[MapDocument], MapDocument]
    ) -> tuple[MapDocument, MapDocument]:

        def change_of_this_map(document: MapDocument) -> MapDocument:
            self._require_same_map(document.map_id, f"The file {self.path}")
            return change(document)

        return self.rewrite(change_of_this_map)

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
        map_id = seen.document.map_id if seen.document else None
        if not self._is_same_map(map_id):
            yield (
                f"{self.path} belongs to the map {_say_map(map_id)}, but the robot is on "
                f"{_say_map(self.map_id)}: its poses may be wrong here, and nothing is written "
                "to it."
            )

    def _is_same_map(self, map_id: str | None) -> bool:
        return None in (map_id, self.map_id) or map_id == self.map_id

    def _require_same_map(self, map_id: str | None, what: str) -> None:
        if not self._is_same_map(map_id):
            raise SemanticMapError(
                f"{what} belongs to the map {_say_map(map_id)}, but the robot is on "
                f"{_say_map(self.map_id)}.",
                hint="Use another file for this map; if it is the same place under another name, "
                f"let the file say `map: {self.map_id}`.",
            )


def _say_map(map_id: str | None) -> str:
    return quote_name(map_id or "")


def _known(document: MapDocument, key: str) -> Waypoint | None:
    record = document.records.get(key)
    return None if record is None else record.waypoint


def _raised_again(fault: SemanticMapError | None) -> SemanticMapError:
    """Return a fresh copy of a kept fault, which would gather traces otherwise."""
    assert fault is not None, "a file without a document has a fault"  # noqa: S101 - our belief
    return SemanticMapError(fault.message, hint=fault.hint)
