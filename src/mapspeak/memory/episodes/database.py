"""The database of episodes: opened for each operation, safe between threads and processes.

SQLite in write-ahead mode: readers never wait, one writer at a time holds SQLite's own lock on the
file for the moment of its write, and a write that returned is on the disk. That lock does not hold
on network drives.
"""

import contextlib
import sqlite3
import weakref
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from mapspeak.atomic import sync_folder
from mapspeak.errors import SemanticMapError

SCHEMA_VERSION = 1

_MOST_PAGES_IN_LOG = 4_000
"""Pages of 4 kB in the write-ahead log at which the write that fills it makes a checkpoint.

An observation changes about fifteen. With SQLite's default of 1,000, one write in seventy takes
1.5 MB instead of 0.13.
"""

_SCHEMA = """
CREATE TABLE observations (
    n INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    recorded_us INTEGER NOT NULL,
    offset_s INTEGER NOT NULL,
    stamp_s REAL,
    map_id TEXT,
    x REAL NOT NULL,
    y REAL NOT NULL,
    yaw_rad REAL NOT NULL,
    room_id TEXT,
    kind TEXT NOT NULL,
    text TEXT NOT NULL,
    labels TEXT NOT NULL,
    picture TEXT,
    picture_bytes INTEGER,
    text_id INTEGER
);
CREATE INDEX by_time ON observations (recorded_us);
CREATE INDEX by_place ON observations (x, y);
CREATE INDEX by_room ON observations (room_id, recorded_us);
CREATE INDEX by_text ON observations (text_id, recorded_us);
CREATE INDEX by_picture ON observations (picture, picture_bytes) WHERE picture IS NOT NULL;
CREATE TABLE texts (text_id INTEGER PRIMARY KEY, hash BLOB NOT NULL UNIQUE, text TEXT NOT NULL);
CREATE TABLE vocabulary (word TEXT PRIMARY KEY, n_texts INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE words (
    word TEXT NOT NULL, text_id INTEGER NOT NULL, PRIMARY KEY (word, text_id)
) WITHOUT ROWID;
CREATE TABLE labels (
    label TEXT NOT NULL, n INTEGER NOT NULL, PRIMARY KEY (label, n)
) WITHOUT ROWID;
CREATE TABLE vectors (
    embedder TEXT NOT NULL, hash BLOB NOT NULL, vector BLOB NOT NULL, PRIMARY KEY (embedder, hash)
) WITHOUT ROWID;
CREATE TABLE facts (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
"""


class EpisodeDatabase:
    """The file `episodes.sqlite`; all its errors are `SemanticMapError`s.

    Args:
        path: The file; the first write creates it and its folder.
    """

    def __init__(self, path: Path, *, lock_timeout_s: float) -> None:
        self.path = path
        self._lock_timeout_s = lock_timeout_s
        self._is_held_open = False

    def exists(self) -> bool:
        """Return True if anything was ever written."""
        return self.path.exists()

    @contextlib.contextmanager
    def reading(self) -> Iterator[sqlite3.Connection]:
        """Return a connection whose statements all see one state of the database."""
        with self._explained("read"), contextlib.closing(self._open()) as connection:
            connection.execute("BEGIN")
            yield connection

    @contextlib.contextmanager
    def writing(self) -> Iterator[sqlite3.Connection]:
        """Return a connection with the writers' lock; it commits at the end, or rolls back."""
        with self._explained("write to"):
            self._make()
            with contextlib.closing(self._open()) as connection:
                connection.execute("BEGIN IMMEDIATE")
                try:
                    yield connection
                except BaseException:
                    connection.execute("ROLLBACK")
                    raise
                connection.execute("COMMIT")

    def _open(self) -> sqlite3.Connection:
        address = f"{self.path.resolve().as_uri()}?mode=rw"
        connection = sqlite3.connect(
            address,
            uri=True,
            timeout=self._lock_timeout_s,
            isolation_level=None,
            check_same_thread=False,
        )
        connection.row_factory = sqlite3.Row
        try:
            connection.execute("PRAGMA synchronous = FULL")
            connection.execute("PRAGMA temp_store = MEMORY")
            connection.execute(f"PRAGMA wal_autocheckpoint = {_MOST_PAGES_IN_LOG}")
            self._require_readable(connection.execute("PRAGMA user_version").fetchone()[0])
        except BaseException:
            connection.close()
            raise
        return connection

    def _require_readable(self, version: int) -> None:
        if version != SCHEMA_VERSION:
            raise SemanticMapError(
                f"{self.path} has version {version}, not {SCHEMA_VERSION}.",
                hint="Use the newer mapspeak that made it; if it is empty, move it away.",
            )

    def _make(self) -> None:
        """Create the file if there is none, and keep it open."""
        if self._is_held_open and self.path.exists():
            return
        self.path.parent.mkdir(parents=True, exist_ok=True)
        # Created under another name, so that readers find all of it or nothing.
        with FileLock(self.path.with_suffix(".lock"), timeout=self._lock_timeout_s):
            if not self.path.exists():
                _make_empty(self.path.with_suffix(".new")).replace(self.path)
                sync_folder(self.path.parent)
        # While one idle connection is open, closing another does not fold the log into the file:
        # a write costs a quarter.
        idle = self._open()
        idle.execute("SELECT n FROM observations LIMIT 1").fetchall()
        weakref.finalize(self, idle.close)
        self._is_held_open = True

    @contextlib.contextmanager
    def _explained(self, verb: str) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, OSError, Timeout) as error:
            message = f"Cannot {verb} {self.path}: {error}."
            hint = (
                "Check that its folder may be written to and has room, and that no other program "
                "holds it; if it is damaged, move it away: places are in the YAML file."
            )
            raise SemanticMapError(message, hint=hint) from error


def _make_empty(path: Path) -> Path:
    """Make a database without an observation; one that a crash left half made goes."""
    for ending in ("", "-wal", "-shm"):
        path.with_name(path.name + ending).unlink(missing_ok=True)
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("PRAGMA journal_mode = WAL")
        # Version 0.1 reads no database without it.
        fact = "INSERT INTO facts VALUES ('index_version', '1');"
        version = f"PRAGMA user_version = {SCHEMA_VERSION};"
        connection.executescript(f"BEGIN; {_SCHEMA} {fact} {version} COMMIT;")
    return path
