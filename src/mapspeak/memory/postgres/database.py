"""A reconnecting connection to a PostgreSQL database with the schema of mapspeak."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock
from typing import Any, cast

import psycopg
from psycopg.conninfo import conninfo_to_dict

from mapspeak.errors import SemanticMapError

CONNECT_TIMEOUT_S = 5
STATEMENT_TIMEOUT_MS = 10_000
"""Longest time that a write waits for those before it."""
MIGRATIONS = (
    """
    CREATE SCHEMA IF NOT EXISTS mapspeak;
    CREATE TABLE mapspeak.schema (version integer NOT NULL);
    INSERT INTO mapspeak.schema VALUES (0);
    CREATE SEQUENCE mapspeak.position;
    CREATE TABLE mapspeak.records (
        kind text NOT NULL,
        key text NOT NULL,
        position bigint NOT NULL DEFAULT nextval('mapspeak.position'),
        changed xid8 NOT NULL DEFAULT pg_current_xact_id(),
        said jsonb,
        PRIMARY KEY (kind, key)
    );
    CREATE INDEX records_changed ON mapspeak.records (changed);
    CREATE TABLE mapspeak.walls (
        name text PRIMARY KEY,
        rows integer NOT NULL,
        columns integer NOT NULL,
        resolution_m double precision NOT NULL,
        x double precision NOT NULL,
        y double precision NOT NULL,
        yaw_rad double precision NOT NULL,
        stamp_s double precision NOT NULL,
        cells bytea NOT NULL
    );
    """,
)
"""Additions of each schema version; all missing ones run in one transaction."""

_MIGRATION_LOCK = 0x6D617073


class Database:
    """A database, for one thread at a time.

    Args:
        address: As libpq takes it: "postgresql://user@host/database". Never shown.
    """

    def __init__(self, address: str) -> None:
        self.n_connected = 0
        self._address = address
        self._lock = RLock()
        self._connection: psycopg.Connection[Any] | None = None

    @contextmanager
    def connected(self) -> Iterator[psycopg.Connection[Any]]:
        """Return the connection; create it, and the schema, if there is none or it has ended.

        Raises:
            SemanticMapError: The database cannot be reached, or refuses; omits the password.
        """
        with self._lock:
            try:
                connection = self._alive() or self._connect()
                yield connection
            except psycopg.Error as error:
                if isinstance(error, psycopg.OperationalError):
                    self.close()
                told = " ".join(str(error).split()) or type(error).__name__
                raise SemanticMapError(
                    f"The memory at {shown_address(self._address)} cannot be used: {told}",
                    hint="Start that database, or give another one with --memory.",
                ) from None

    def close(self) -> None:
        """End the connection; the next use makes another."""
        with self._lock:
            if self._connection is not None:
                self._connection.close()
            self._connection = None

    def _alive(self) -> psycopg.Connection[Any] | None:
        connection = self._connection
        if connection is None or connection.closed:
            return None
        try:
            connection.execute("SELECT 1")
        except psycopg.OperationalError:
            self.close()
            return None
        return connection

    def _connect(self) -> psycopg.Connection[Any]:
        self._connection = psycopg.connect(
            self._address,
            autocommit=True,
            connect_timeout=CONNECT_TIMEOUT_S,
            application_name="mapspeak",
            options=f"-c statement_timeout={STATEMENT_TIMEOUT_MS}",
        )
        # Whoever has waited for a lock reads what was written meanwhile, whatever is usual there.
        self._connection.isolation_level = psycopg.IsolationLevel.READ_COMMITTED
        try:
            _migrate(self._connection)
        except BaseException:
            self.close()
            raise
        self.n_connected += 1
        return self._connection


def shown_address(address: str) -> str:
    """Return the host and the database of an address, without user and password."""
    try:
        said = conninfo_to_dict(address)
    except psycopg.ProgrammingError:
        return "postgresql://..."
    return f"postgresql://{said.get('host') or 'localhost'}/{said.get('dbname') or ''}"


def _migrate(connection: psycopg.Connection[Any]) -> None:
    """Migrate the schema to this version; safe if other servers do so at the same moment."""
    with connection.transaction():
        connection.execute("SELECT pg_advisory_xact_lock(%s)", (_MIGRATION_LOCK,))
        rows = connection.execute("SELECT to_regclass('mapspeak.schema') IS NOT NULL")
        (is_there,) = cast("tuple[bool]", rows.fetchone())
        version: int | None = 0
        if is_there:
            rows = connection.execute("SELECT version FROM mapspeak.schema")
            (version,) = cast("tuple[int] | None", rows.fetchone()) or (None,)
        if version is None:
            raise SemanticMapError(
                "The schema of this database is half made: mapspeak.schema has no version.",
                hint="Restore it from a copy, or drop the schema mapspeak to begin anew.",
            )
        if version > len(MIGRATIONS):
            raise SemanticMapError(
                f"A newer mapspeak made this database: its schema is {version}, and the last "
                f"known here is {len(MIGRATIONS)}.",
                hint="Update mapspeak.",
            )
        if version == len(MIGRATIONS):
            return
        for migration in MIGRATIONS[version:]:
            connection.execute(migration.encode())
        connection.execute("UPDATE mapspeak.schema SET version = %s", (len(MIGRATIONS),))
