"""A memory of places in PostgreSQL, for fleets: many servers write, and all read the same.

Every record is a row `(kind, key, said)`, where `said` is its content in the YAML file. A row
carries the number of the transaction that changed it; a reader asks for the rows of transactions
that had not ended when it last asked. A forgotten record stays as an empty row until
something is written under its key again.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, cast

import psycopg
from psycopg.types.json import Jsonb

from mapspeak.errors import SemanticMapError
from mapspeak.memory.events import Event
from mapspeak.memory.frames import NO_FRAMES, Frames, MapFrame
from mapspeak.memory.postgres.database import Database
from mapspeak.memory.postgres.walls import DatabaseWalls
from mapspeak.memory.quoting import name_key
from mapspeak.memory.store.memorystore import MemoryStore, OneRecord, Records, Result
from mapspeak.memory.store.records import data_of, key_of, list_key_of, read_record
from mapspeak.memory.store.yamltext import Data
from mapspeak.memory.waypoint import SemanticMap, Waypoint

_PLACE, _EVENT, _FRAME, _ENTRY = "place", "event", "frame", "entry"
_LISTS = {_PLACE: "waypoints", _EVENT: "events", _FRAME: "frames"}
_KINDS = {list_key: kind for kind, list_key in _LISTS.items()}
_MEMORY_LOCK, _NAME_LOCK = 0x6D61706D, 0x6D61706E
_READ_NEWS = """
    SELECT pg_snapshot_xmin(pg_current_snapshot())::text, kind, key, position, changed::text, said
    FROM (VALUES (1)) AS always LEFT JOIN mapspeak.records ON changed >= %s::text::xid8
    ORDER BY kind = 'entry' DESC, position
"""
_SELECT = """
    SELECT kind, key, said FROM mapspeak.records
    WHERE kind = ANY(%s) AND said IS NOT NULL ORDER BY position
"""
_SELECT_PLACE = "SELECT said FROM mapspeak.records WHERE kind = 'place' AND key = %s"
_UPSERT = """
    INSERT INTO mapspeak.records AS known (kind, key, said) VALUES (%s, %s, %s)
    ON CONFLICT (kind, key) DO UPDATE SET
        said = excluded.said,
        changed = excluded.changed,
        position = CASE WHEN known.said IS NULL THEN excluded.position ELSE known.position END
"""
_EMPTY_PLACE = """
    UPDATE mapspeak.records SET said = NULL, changed = pg_current_xact_id()
    WHERE kind = 'place' AND key = %s
"""
_PUT_PLACE_AS = """
    INSERT INTO mapspeak.records (kind, key, said, position)
    SELECT 'place', %s, %s, position FROM mapspeak.records WHERE kind = 'place' AND key = %s
    ON CONFLICT (kind, key) DO UPDATE SET
        said = excluded.said, changed = excluded.changed, position = excluded.position
"""
_FROM_THE_BEGINNING = "0"


@dataclass(frozen=True, kw_only=True)
class _Known:
    """Content of the database when it was last read.

    Attributes:
        rows: Position and transaction of each row, by kind and key.
        records: By kind and key, in the order of positions.
        faults: Of rows that cannot be read; their previous content is in `records`.
    """

    rows: Mapping[tuple[str, str], tuple[int, str]] = field(default_factory=dict)
    records: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    faults: Mapping[tuple[str, str], SemanticMapError] = field(default_factory=dict)

    def of(self, kind: str) -> Mapping[str, Any]:
        return self.records.get(kind, {})

    @cached_property
    def places(self) -> SemanticMap:
        frames = tuple(self.of(_FRAME).values())
        return SemanticMap(
            map_id=self.of(_ENTRY).get("map"),
            waypoints=cast("tuple[Waypoint, ...]", tuple(self.of(_PLACE).values())),
            frames=Frames(frames) if frames else NO_FRAMES,
            warnings=tuple(f"{each}" for each in self.faults.values()),
        )


class PostgresStore(MemoryStore):
    """The memory of places in one PostgreSQL database.

    Args:
        address: As libpq takes it: "postgresql://user@host/database". Never shown.
    """

    def __init__(self, address: str, *, path: Path, map_id: str | None = None) -> None:
        self._database = Database(address)
        super().__init__(path=path, walls=DatabaseWalls(self._database), map_id=map_id)
        self._known: _Known | None = None
        self._since = _FROM_THE_BEGINNING
        self._n_connected = 0
        self._is_bound = False

    def read(self) -> SemanticMap:
        """Return all remembered places; ask only for what changed.

        While the database cannot be reached, the places read before are given, with a warning.
        """
        known, fault = self._look()
        if fault is None:
            return known.places
        warning = f"{fault} Until then, the waypoints read before are given."
        return replace(known.places, warnings=(*known.places.warnings, warning))

    def read_events(self) -> tuple[Event, ...]:
        """Return all events, also those that are over; meanwhile those read before."""
        return tuple(self._look()[0].of(_EVENT).values())

    def close(self) -> None:
        """End the connection; the next call makes another."""
        self._database.close()

    def change(
        self,
        change: Callable[[Records], Result],
        *,
        alone: bool = False,
        binding: str | None = None,
    ) -> Result:
        """Change rows in one transaction."""
        is_alone = alone or (binding is not None and not self._is_bound)
        lock = "pg_advisory_xact_lock" if is_alone else "pg_advisory_xact_lock_shared"
        # In a pipeline, statements without results do not wait.
        with (
            self._database.connected() as connection,
            connection.pipeline(),
            connection.transaction(),
        ):
            connection.execute(f"SELECT {lock}(%s, 0)".encode(), (_MEMORY_LOCK,))
            rows = _Rows(connection, read_all=self._read_news)
            result = change(rows)
        self._is_bound = rows.map_id is not None
        return result

    def _look(self) -> tuple[_Known, SemanticMapError | None]:
        """Return the present content of the database; while it is away that of before, and why."""
        try:
            with self._database.connected() as connection:
                return self._read_news(connection), None
        except SemanticMapError as fault:
            if self._known is None:
                raise
            return self._known, fault

    def _read_news(self, connection: psycopg.Connection[Any]) -> _Known:
        """Return the known content updated by every changed row."""
        before = self._known or _Known()
        if self._n_connected != self._database.n_connected:
            # It may be another server now, restored from a copy, with other transaction numbers.
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
    """The rows, in a transaction that writes; `Records`.

    Attributes:
        map_id: The map of the memory.
        frames: All of them.
    """

    def __init__(
        self,
        connection: psycopg.Connection[Any],
        read_all: Callable[[psycopg.Connection[Any]], "_Known"],
    ) -> None:
        self._connection = connection
        self._read_all = read_all
        found = connection.execute(_SELECT, ([_ENTRY, _FRAME],)).fetchall()
        entries = {key: said for kind, key, said in found if kind == _ENTRY}
        self.map_id = cast("str | None", entries.get("map"))
        frames = [_read_row(_FRAME, key, said, None) for kind, key, said in found if kind == _FRAME]
        self.frames = Frames(tuple(cast("list[MapFrame]", frames))) if frames else NO_FRAMES
        self._places: dict[str, Waypoint | None] = {}

    def read(self) -> SemanticMap:
        """Return all places."""
        return self._read_all(self._connection).places

    def read_events(self) -> Mapping[str, Event]:
        """Return all events by their ids."""
        rows = self._connection.execute(_SELECT, ([_EVENT],)).fetchall()
        return {key: cast("Event", _read_row(_EVENT, key, said, None)) for _, key, said in rows}

    def find_place(self, key: str) -> Waypoint | None:
        """Return what is remembered under a `name_key`; no one else writes it from now on."""
        if key not in self._places:
            self._connection.execute(
                "SELECT pg_advisory_xact_lock(%s, hashtext(%s))", (_NAME_LOCK, key)
            )
            (said,) = self._connection.execute(_SELECT_PLACE, (key,)).fetchone() or (None,)
            found = said and _read_row(_PLACE, key, said, self.map_id)
            self._places[key] = cast("Waypoint | None", found)
        return self._places[key]

    def bind(self, map_id: str | None) -> None:
        """Bind the memory to the map that its waypoints belong to, where it does not say one."""
        if map_id is not None and self.map_id is None:
            self._connection.execute(_UPSERT, (_ENTRY, "map", Jsonb(map_id)))
            self.map_id = map_id

    def put(self, record: OneRecord) -> OneRecord:
        """Write a record; return it as it reads."""
        kind, key, data = _KINDS[list_key_of(record)], key_of(record), data_of(record)
        self._connection.execute(_UPSERT, (kind, key, Jsonb(data)))
        written = _read_row(kind, key, data, self.map_id)
        if isinstance(written, MapFrame):
            known = {**self.frames.by_id, written.id: written}
            self.frames = Frames(tuple(known.values()))
        return cast("OneRecord", written)

    def rename_place(self, former_key: str, waypoint: Waypoint) -> None:
        """Write a place where the one of another `name_key` was, which is removed."""
        key = name_key(waypoint.name)
        if key == former_key:
            self.put(waypoint)
            return
        said = Jsonb(data_of(waypoint))
        self._connection.execute(_PUT_PLACE_AS, (key, said, former_key))
        self._connection.execute(_EMPTY_PLACE, (former_key,))


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
            records[kind][key] = _read_row(kind, key, said, records[_ENTRY].get("map"))
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


def _read_row(kind: str, key: str, said: Data, map_id: str | None) -> object:
    if kind == _ENTRY:
        return str(said)
    try:
        return read_record(_LISTS[kind], said, map_id)
    except SemanticMapError as error:
        raise SemanticMapError(
            f"The row {kind} {key!r} of the memory is none: {error.message}",
            hint="Mend it in the table mapspeak.records, or remove it.",
        ) from None
