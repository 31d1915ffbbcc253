"""The episodes of one memory: every observation, kept beside the semantic map file.

Reading and writing are synchronous, and safe between processes and threads.
"""

import contextlib
import json
import shutil
import sqlite3
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import MappingProxyType

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory.episodes.database import EpisodeDatabase
from mapspeak.memory.episodes.observation import (
    EpisodePage,
    EpisodeQuery,
    Observation,
    ObservationKind,
    Rank,
    microseconds_of,
)
from mapspeak.memory.episodes.pictures import (
    PictureFolder,
    StoredPicture,
    ThinningRule,
    choose_dropped,
    picture_name,
)
from mapspeak.memory.episodes.searching import (
    COLUMNS,
    EpisodeSearch,
    observation_from,
)
from mapspeak.memory.episodes.textindex import add_text
from mapspeak.memory.quoting import name_key

LOCK_TIMEOUT_S = 5.0

_AFTER_FULL_RATIO = 0.9
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_FIRST_FACTS = MappingProxyType({"thinned_hour": "", "left_bytes": "0"})


_ALL_LABELS = """
WITH RECURSIVE known (label) AS (
    SELECT MIN(label) FROM labels
    UNION ALL
    SELECT (SELECT MIN(label) FROM labels WHERE label > known.label) FROM known
    WHERE known.label IS NOT NULL
)
SELECT label FROM known WHERE label IS NOT NULL
"""
"""A step for each label instead of each observation: the index leads to the next one."""


def memory_folder(semantic_map: Path) -> Path:
    """Return the folder beside a semantic map file in which its episodes and pictures are."""
    return semantic_map.with_name(f"{semantic_map.stem}.memory")


class EpisodeStore:
    """All observations of one memory, in `episodes.sqlite` and `pictures/`.

    Args:
        folder: Holds them; it need not exist yet (see `memory_folder`).
        named_pictures: Returns the pictures that records of the semantic map name; these are
            never dropped, and nothing is dropped while it raises.
    """

    def __init__(
        self,
        folder: Path,
        *,
        rule: ThinningRule | None = None,
        named_pictures: Callable[[], Iterable[str]] = tuple,
        lock_timeout_s: float = LOCK_TIMEOUT_S,
    ) -> None:
        self.folder = folder
        self._rule = rule or ThinningRule()
        self._named_pictures = named_pictures
        self.database = EpisodeDatabase(folder / "episodes.sqlite", lock_timeout_s=lock_timeout_s)
        self._pictures = PictureFolder(folder / "pictures")
        self._search = EpisodeSearch()

    # --- writing -----------------------------------------------------------------------------

    def write(self, observation: Observation, *, picture: bytes | None = None) -> Observation:
        """Keep an observation, on the disk when this returns; a repeated one changes nothing.

        Args:
            picture: JPEG or PNG; kept under a name that the observation gets.

        Raises:
            SemanticMapError: It cannot be written, or the picture is of another kind.
        """
        if picture is not None:
            name = picture_name(picture, observation.recorded_at)
            observation = replace(observation, picture=name, id="")
        with self.database.writing() as connection:
            if picture is not None and observation.picture is not None:
                # Under the lock: thinning takes a file without an observation for a leftover.
                self._pictures.put(observation.picture, picture)
            _insert(connection, observation, None if picture is None else len(picture))
            is_due = picture is not None and self._is_thinning_due(connection, observation)
        if is_due:
            with contextlib.suppress(SemanticMapError):
                # The observation is kept; dropping pictures can wait for an hour.
                self.thin(now=observation.recorded_at)
        return observation

    def write_all(self, observations: Iterable[Observation]) -> int:
        """Keep many observations at once, all or none, and return how many were new."""
        with self.database.writing() as connection:
            return sum(_insert(connection, each, None) for each in observations)

    def take_over(
        self, other: "EpisodeStore", *, rename_map: Callable[[str | None], str | None]
    ) -> tuple[int, int]:
        """Keep all of another store, or nothing; return how many observations and pictures are new.

        Args:
            rename_map: Returns the name here of an observation's map.
        """
        if not other.database.exists():
            return 0, 0
        selection = f"SELECT {COLUMNS} FROM observations AS o ORDER BY o.n"  # noqa: S608 - our own columns
        n_new = 0
        names = set[str]()
        with other.database.reading() as source, self.database.writing() as connection:
            for seen in map(observation_from, source.execute(selection)):
                path = other.picture_path(seen) if seen.kind is ObservationKind.PICTURE else None
                content = None if path is None else path.read_bytes()
                named = replace(seen, map_id=rename_map(seen.map_id))
                if not _insert(connection, named, None if content is None else len(content)):
                    continue
                n_new += 1
                if path is not None and content is not None:
                    self._pictures.put(path.name, content)
                    # Identical pictures share a file.
                    names.add(path.name)
        return n_new, len(names)

    # --- asking ------------------------------------------------------------------------------

    def find(self, query: EpisodeQuery, *, rank: Rank | None = None) -> EpisodePage:
        """Return one page of the observations that pass every filter of a query.

        Args:
            rank: Says how well texts fit words; None compares words.

        Raises:
            SemanticMapError: The database cannot be read.
        """
        if not self.database.exists():
            return EpisodePage(matches=(), n_matches=0)
        with self.database.reading() as connection:
            return self._search.find(connection, query, rank)

    def get(self, observation_id: str) -> Observation | None:
        """Return the observation with an id, or of a picture with a name, or None."""
        if not self.database.exists():
            return None
        wanted = "o.id = ? OR (o.picture = ? AND o.kind = 'picture') LIMIT 1"
        selection = f"SELECT {COLUMNS} FROM observations AS o WHERE {wanted}"  # noqa: S608 - our own columns
        with self.database.reading() as connection:
            row = connection.execute(selection, [observation_id] * 2).fetchone()
        return None if row is None else observation_from(row)

    def list_labels(self) -> tuple[str, ...]:
        """Return the labels of all observations as `name_key`s, each once, sorted."""
        if not self.database.exists():
            return ()
        with self.database.reading() as connection:
            return tuple(row[0] for row in connection.execute(_ALL_LABELS))

    def picture_path(self, observation: Observation) -> Path | None:
        """Return the file of an observation's picture; None without one."""
        return self._pictures.find(observation.picture)

    # --- keeping order -----------------------------------------------------------------------

    def thin(self, *, now: datetime) -> int:
        """Drop the pictures that the rule does not keep, and return how many files went.

        Their observations stay. Files left by a crash in between are removed next time.
        """
        named = {Path(name).name for name in self._named_pictures()}
        with self.database.writing() as connection:
            stored = _stored_pictures(connection)
            rule = self._rule_when_full(stored)
            dropped = choose_dropped(stored, now=now, named=named, rule=rule)
            connection.executemany(
                "UPDATE observations SET picture = NULL, picture_bytes = NULL WHERE picture = ?",
                [[name] for name in dropped],
            )
            _note_fact(connection, "thinned_hour", _hour(now))
            _note_fact(connection, "left_bytes", str(_n_bytes(connection)))
        with self.database.writing() as connection:
            kept = connection.execute("SELECT picture FROM observations WHERE picture IS NOT NULL")
            return self._pictures.remove_all_but(named | {row[0] for row in kept})

    def _is_thinning_due(self, connection: sqlite3.Connection, latest: Observation) -> bool:
        """Return True once an hour, or if the pictures have outgrown their limit."""
        if _fact(connection, "thinned_hour") != _hour(latest.recorded_at):
            return True
        limit_bytes = self._rule.limit_mb * 1e6
        # The pictures that records name may exceed the limit permanently.
        largest = max(limit_bytes, int(_fact(connection, "left_bytes")) + limit_bytes / 10)
        return _n_bytes(connection) > largest

    def _rule_when_full(self, stored: list[StoredPicture]) -> ThinningRule:
        """Thin to below the limit once it is reached, so that not every write thins."""
        n_bytes = sum({picture.name: picture.n_bytes for picture in stored}.values())
        if n_bytes <= self._rule.limit_mb * 1e6:
            return self._rule
        return replace(self._rule, limit_mb=self._rule.limit_mb * _AFTER_FULL_RATIO)


def _insert(
    connection: sqlite3.Connection, observation: Observation, picture_bytes: int | None
) -> bool:
    """Add a row with its index; False where it is there already."""
    known = connection.execute("SELECT 1 FROM observations WHERE id = ?", [observation.id])
    if known.fetchone() is not None:
        return False
    offset = observation.recorded_at.utcoffset() or timedelta(0)
    n = connection.execute(
        "INSERT INTO observations (id, recorded_us, offset_s, stamp_s, map_id, x, y, yaw_rad,"
        " room_id, kind, text, labels, picture, picture_bytes, text_id)"
        " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        (
            observation.id,
            microseconds_of(observation.recorded_at),
            int(offset.total_seconds()),
            observation.stamp_s,
            observation.map_id,
            observation.pose.x,
            observation.pose.y,
            observation.pose.yaw_rad,
            observation.room_id,
            str(observation.kind),
            observation.text,
            json.dumps(observation.labels, ensure_ascii=False),
            observation.picture,
            picture_bytes,
            add_text(connection, observation.searched_text),
        ),
    ).lastrowid
    labels = {(name_key(label), n) for label in observation.labels}
    connection.executemany("INSERT INTO labels VALUES (?, ?)", sorted(labels))
    return True


def _stored_pictures(connection: sqlite3.Connection) -> list[StoredPicture]:
    rows = connection.execute(
        "SELECT picture, recorded_us, x, y, yaw_rad, picture_bytes, map_id FROM observations"
        " WHERE picture_bytes IS NOT NULL AND picture IS NOT NULL"
    )
    return [
        StoredPicture(
            row["picture"],
            _EPOCH + timedelta(microseconds=row["recorded_us"]),
            Pose(row["x"], row["y"], row["yaw_rad"]),
            row["picture_bytes"],
            row["map_id"],
        )
        for row in rows
    ]


def _n_bytes(connection: sqlite3.Connection) -> int:
    total = connection.execute(
        "SELECT SUM(n_bytes) FROM (SELECT MAX(picture_bytes) AS n_bytes FROM observations"
        " WHERE picture IS NOT NULL GROUP BY picture)"
    )
    return int(total.fetchone()[0] or 0)


def _fact(connection: sqlite3.Connection, name: str) -> str:
    row = connection.execute("SELECT value FROM facts WHERE name = ?", [name]).fetchone()
    return _FIRST_FACTS.get(name, "") if row is None else str(row[0])


def _note_fact(connection: sqlite3.Connection, name: str, value: str) -> None:
    connection.execute("INSERT OR REPLACE INTO facts VALUES (?, ?)", (name, value))


def _hour(time: datetime) -> str:
    return time.astimezone(UTC).strftime("%Y-%m-%dT%H")


@dataclass(frozen=True, slots=True, kw_only=True)
class BroughtOver:
    """Numbers of copied records.

    Attributes:
        n_observations: Each counted once, even if both memories had it.
    """

    n_observations: int = 0
    n_pictures: int = 0


def bring_over(
    first: Path, second: Path, *, to: Path, rename_map: Callable[[str | None], str | None]
) -> BroughtOver:
    """Copy the observations of two semantic map files, with their pictures, to a third.

    All are copied, or nothing; the sources do not change.

    Args:
        rename_map: Returns the new name of a map of the second file's observations.

    Raises:
        SemanticMapError: It has some, or they cannot be read or written.
    """
    mine, theirs = (EpisodeStore(memory_folder(path)) for path in (first, second))
    folder = memory_folder(to)
    if folder.exists():
        message = f"{folder} is there already."
        raise SemanticMapError(message, hint="Give the new file another name, or remove it.")
    target = EpisodeStore(folder)
    try:
        came = [
            target.take_over(mine, rename_map=lambda map_id: map_id),
            target.take_over(theirs, rename_map=rename_map),
        ]
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return BroughtOver(n_observations=sum(n for n, _ in came), n_pictures=sum(n for _, n in came))
