"""A memory of places in PostgreSQL, for fleets: many servers write, and all read the same.

Every record is a row `(kind, key, said)`, where `said` is what the YAML file would say of it. A row
carries the number of the transaction that changed it; a reader asks for the rows of transactions
that had not ended when it last asked. What is forgotten stays as a row that says nothing, until
something is written under its key again.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

import psycopg
from psycopg.types.json import Jsonb
from pydantic import ValidationError

from mapspeak.errors import SemanticMapError
from mapspeak.memory.events import Event
from mapspeak.memory.frames import NO_FRAMES, Frames
from mapspeak.memory.merging import Merge, merge_waypoint
from mapspeak.memory.postgres.database import Database
from mapspeak.memory.postgres.walls import DatabaseWalls
from mapspeak.memory.quoting import clean_line, name_key
from mapspeak.memory.store.eventschema import event_data, event_from
from mapspeak.memory.store.frameschema import frame_data, frame_from
from mapspeak.memory.store.memorystore import (
    WriteReceipt,
    event_in_its_frame,
    free_event_id,
    in_its_frame,
    require_same_map,
)
from mapspeak.memory.store.schema import record_data, waypoint_from
from mapspeak.memory.store.tree import Data
from mapspeak.memory.waypoint import SemanticMap, Waypoint

_PLACE, _EVENT, _FRAME, _ENTRY = "place", "event", "frame", "entry"
_MEMORY_LOCK, _NAME_LOCK = 0x6D61706D, 0x6D61706E
_READ_NEWS = """
    SELECT pg_snapshot_xmin(pg_current_snapshot())::text, kind, key, position, changed::text, said
    FROM (VALUES (1)) AS always LEFT JOIN mapspeak.records ON changed >= %s::text::xid8
    ORDER BY kind = 'entry' DESC, position
"""
_UPSERT = """
    INSERT INTO mapspeak.records AS known (kind, key, said) VALUES (%s, %s, %s)
    ON CONFLICT (kind, key) DO UPDATE SET
        said = excluded.said,
        changed = excluded.changed,
        position = CASE WHEN known.said IS NULL THEN excluded.position ELSE known.position END
"""
_FROM_THE_BEGINNING = "0"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Known:
    """What the database said when it was last read.

    Attributes:
        rows: Position and transaction of each row, by kind and key.
        records: By kind and key, in the order of positions.
        faults: Of rows that cannot be read; what they said before is in `records`.
    """

    rows: Mapping[tuple[str, str], tuple[int, str]] = field(default_factory=dict)
    records: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    faults: Mapping[tuple[str, str], SemanticMapError] = field(default_factory=dict)

    def of(self, kind: str) -> Mapping[str, Any]:
        return self.records.get(kind, {})

    def to_map(self) -> SemanticMap:
        frames = tuple(self.of(_FRAME).values())
        return SemanticMap(
            map_id=self.of(_ENTRY).get("map"),
            waypoints=cast("tuple[Waypoint, ...]", tuple(self.of(_PLACE).values())),
            frames=Frames(frames) if frames else NO_FRAMES,
            warnings=tuple(f"{each}" for each in self.faults.values()),
        )


class PostgresStore:
    """The memory of places in one PostgreSQL database; a `MemoryStore`.

    Args:
        address: As libpq takes it: "postgresql://user@host/database". Never shown.
        path: What stands for the memory on this machine, beside which pictures and observations
            lie.
        map_id: The map that the robot is on. None takes the memory for what it says it is.
    """

    def __init__(self, address: str, *, path: Path, map_id: str | None = None) -> None:
        self.path = path
        self.map_id = clean_line(map_id or "") or None
        self._database = Database(address)
        self.walls = DatabaseWalls(self._database)
        self._known: _Known | None = None
        self._since = _FROM_THE_BEGINNING
        self._n_connected = 0
        self._is_bound = False

    def read(self) -> SemanticMap:
        """Return all remembered places; ask only for what changed.

        While the database cannot be reached, the places read before are given, with a warning.
        """
        try:
            return self._look().to_map()
        except SemanticMapError as fault:
            if self._known is None:
                raise
            places = self._known.to_map()
            warning = f"{fault} Until then, the waypoints read before are given."
            return replace(places, warnings=(*places.warnings, warning))

    def read_events(self) -> tuple[Event, ...]:
        """Return all events, also those that are over."""
        return tuple(self._look().of(_EVENT).values())

    def read_entry(self, key: str) -> str | None:
        """Return what the memory says under a key of its own."""
        return cast("str | None", self._look().of(_ENTRY).get(key))

    def write(self, waypoint: Waypoint) -> WriteReceipt:
        """Create a waypoint, or change the record of that name."""
        return self._write(waypoint, lambda _, placed: placed)

    def write_all(self, change: Callable[[SemanticMap], Iterable[Waypoint]]) -> None:
        """Write many waypoints in one transaction."""
        with self._writing(alone=True) as rows:
            waypoints = tuple(change(self._read_news(rows.connection).to_map()))
            for map_id in dict.fromkeys(each.map_id for each in waypoints):
                rows.bind(map_id)
            rows.put_places(waypoints)

    def write_event(self, event: Event) -> Event:
        """Write an event, in its own record where its id is there already."""
        with self._writing(alone=True) as rows:
            events = rows.read_events()
            placed = event_in_its_frame(event, events.get(event.id), rows.frames)
            named = placed if placed.id else replace(placed, id=free_event_id(events))
            if not event.frame:
                rows.bind(self.map_id)
            said = event_data(named)
            rows.put(_EVENT, named.id, said)
        return event_from(said)

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
        """Forget a waypoint; its row stays, and says nothing."""
        with self._writing() as rows:
            known = rows.find_place(name_key(name))
            if known is not None:
                rows.put(_PLACE, name_key(name), None)
        return known

    def write_frames(self, change: Callable[[Frames], Frames]) -> Frames:
        """Write what is known of frames; no record changes."""
        with self._writing(alone=True) as rows:
            changed = change(rows.frames)
            for frame in changed.items:
                if rows.frames.by_id.get(frame.id) != frame:
                    rows.put(_FRAME, frame.id, cast("Data", frame_data(frame)))
        return changed

    def close(self) -> None:
        """End the connection; the next call makes another."""
        self._database.close()

    def _write(
        self, waypoint: Waypoint, change: Callable[[Waypoint | None, Waypoint], Waypoint]
    ) -> WriteReceipt:
        require_same_map(waypoint, self.map_id)
        map_id = None if waypoint.frame else self.map_id or waypoint.map_id
        with self._writing(alone=map_id is not None and not self._is_bound) as rows:
            rows.bind(map_id)
            placed = in_its_frame(waypoint, find_known=rows.find_place, frames=rows.frames)
            previous = rows.find_place(name_key(placed.name))
            (said,) = rows.put_places([change(previous, placed)])
        self._is_bound = rows.map_id is not None
        return WriteReceipt(
            waypoint=waypoint_from(said, map_id=rows.map_id),
            previous=previous,
        )

    @contextmanager
    def _writing(self, *, alone: bool = False) -> Iterator["_Rows"]:
        """Give the rows in a transaction.

        Args:
            alone: No other writes meanwhile. Else none writes the places that are looked for.
        """
        taken = "pg_advisory_xact_lock" if alone else "pg_advisory_xact_lock_shared"
        # In a pipeline, what needs no answer does not wait for one.
        with (
            self._database.connected() as connection,
            connection.pipeline(),
            connection.transaction(),
        ):
            connection.execute(f"SELECT {taken}(%s, 0)".encode(), (_MEMORY_LOCK,))
            yield _Rows(connection)

    def _look(self) -> _Known:
        """Return what the database says now."""
        with self._database.connected() as connection:
            return self._read_news(connection)

    def _read_news(self, connection: psycopg.Connection[Any]) -> _Known:
        """Return what is known with every row that changed."""
        before = self._known or _Known()
        if self._n_connected != self._database.n_connected:
            # It may be another server now, restored from a copy, with transactions of its own.
            self._n_connected, self._since = self._database.n_connected, _FROM_THE_BEGINNING
            before = _Known()
        rows = connection.execute(_READ_NEWS, (self._since,)).fetchall()
        news = [
            (kind, key, position, changed, said)
            for _, kind, key, position, changed, said in rows
            if kind is not None and before.rows.get((kind, key)) != (position, changed)
        ]
        self._known = _with_news(before, news) if news else before
        # Inside a transaction of our own, what it changes is asked for again.
        self._since = rows[0][0]
        self._is_bound = "map" in self._known.of(_ENTRY)
        return self._known


class _Rows:
    """The rows, in a transaction that writes.

    Attributes:
        map_id: The map of the memory.
        frames: All of them.
    """

    def __init__(self, connection: psycopg.Connection[Any]) -> None:
        self.connection = connection
        found = connection.execute(
            "SELECT kind, key, said FROM mapspeak.records"
            " WHERE kind IN ('entry', 'frame') AND said IS NOT NULL ORDER BY position"
        ).fetchall()
        entries = {key: said for kind, key, said in found if kind == _ENTRY}
        self.map_id = cast("str | None", entries.get("map"))
        frames = [
            _read_record(_FRAME, key, said, None) for kind, key, said in found if kind == _FRAME
        ]
        self.frames = Frames(tuple(cast("list[Any]", frames))) if frames else NO_FRAMES
        self._places: dict[str, Waypoint | None] = {}

    def bind(self, map_id: str | None) -> None:
        """Bind the memory to the map that its waypoints belong to, where it does not say one."""
        if map_id is not None and self.map_id is None:
            self.put(_ENTRY, "map", map_id)
            self.map_id = map_id

    def find_place(self, key: str) -> Waypoint | None:
        """Return what is remembered under a `name_key`; nobody else writes it from now on."""
        if key not in self._places:
            self.connection.execute(
                "SELECT pg_advisory_xact_lock(%s, hashtext(%s))", (_NAME_LOCK, key)
            )
            rows = self.connection.execute(
                "SELECT said FROM mapspeak.records WHERE kind = 'place' AND key = %s", (key,)
            )
            (said,) = rows.fetchone() or (None,)
            found = said and _read_record(_PLACE, key, said, self.map_id)
            self._places[key] = cast("Waypoint | None", found)
        return self._places[key]

    def read_events(self) -> dict[str, Event]:
        rows = self.connection.execute(
            "SELECT key, said FROM mapspeak.records WHERE kind = 'event' AND said IS NOT NULL"
            " ORDER BY position"
        )
        events = {key: _read_record(_EVENT, key, said, None) for key, said in rows.fetchall()}
        return cast("dict[str, Event]", events)

    def put(self, kind: str, key: str, said: Data) -> None:
        """Write one record; None forgets it."""
        self.connection.execute(_UPSERT, (kind, key, None if said is None else Jsonb(said)))

    def put_places(self, waypoints: Iterable[Waypoint]) -> list[Data]:
        """Write places, and return what their rows say."""
        said = {name_key(each.name): cast("Data", record_data(each)) for each in waypoints}
        with self.connection.cursor() as cursor:
            cursor.executemany(
                _UPSERT, [(_PLACE, key, Jsonb(record)) for key, record in said.items()]
            )
        return list(said.values())


def _with_news(known: _Known, news: Sequence[tuple[str, str, int, str, Data]]) -> _Known:
    rows, faults = dict(known.rows), dict(known.faults)
    records = {kind: dict(known.of(kind)) for kind in (_ENTRY, _PLACE, _EVENT, _FRAME)}
    for kind, key, position, changed, said in news:
        rows[kind, key] = (position, changed)
        faults.pop((kind, key), None)
        if said is None:
            records[kind].pop(key, None)
            continue
        try:
            records[kind][key] = _read_record(kind, key, said, records[_ENTRY].get("map"))
        except SemanticMapError as fault:
            faults[kind, key] = fault
    map_id = records[_ENTRY].get("map")
    if map_id != known.of(_ENTRY).get("map"):
        # Records name no map of their own: they are of the memory's.
        records[_PLACE] = {
            key: replace(each, map_id=map_id) for key, each in records[_PLACE].items()
        }
    for kind in {kind for kind, *_ in news}:
        places = [rows[kind, key][0] for key in records[kind]]
        if places != sorted(places):
            # A row whose transaction took longer, or that was forgotten and is written again.
            records[kind] = dict(
                sorted(records[kind].items(), key=lambda item: rows[kind, item[0]])
            )
    return _Known(rows=rows, records=records, faults=faults)


def _read_record(kind: str, key: str, said: Data, map_id: str | None) -> object:
    readers: dict[str, Callable[[Data], object]] = {
        _PLACE: lambda data: waypoint_from(data, map_id=map_id),
        _EVENT: event_from,
        _FRAME: frame_from,
        _ENTRY: str,
    }
    try:
        return readers[kind](said)
    except ValidationError as error:
        raise SemanticMapError(
            f"The row {kind} {key!r} of the memory is none: {error.errors()[0]['msg']}.",
            hint="Mend it in the table mapspeak.records, or remove it.",
        ) from None
