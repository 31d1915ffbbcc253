"""Find observations in the database: every filter at once, in SQL."""

import json
import math
import sqlite3
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta, timezone

import numpy as np

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory.episodes.observation import (
    EpisodeFilter,
    EpisodeMatch,
    EpisodeOrder,
    EpisodePage,
    EpisodeQuery,
    Observation,
    ObservationKind,
    Rank,
    microseconds_of,
)
from mapspeak.memory.episodes.textindex import Scores, read_ids, score_words, shared_words
from mapspeak.memory.quoting import name_key

MOST_TEXTS = 2000
"""Number of distinct texts, best first, that one query considers."""


_PLAIN = "(SELECT *, 0 AS is_elsewhere, x AS here_x, y AS here_y FROM observations) AS o"
COLUMNS = (
    "o.id, o.recorded_us, o.offset_s, o.stamp_s, o.map_id, o.x, o.y, o.yaw_rad, o.room_id, "
    "o.kind, o.text, o.labels, o.picture"
)
_ORDERS = {
    EpisodeOrder.NEWEST: "o.recorded_us DESC, o.n DESC",
    EpisodeOrder.OLDEST: "o.recorded_us, o.n",
    EpisodeOrder.BEST: "score DESC, o.recorded_us DESC, o.n DESC",
    EpisodeOrder.NEAREST: "squared_m2 NULLS LAST, o.recorded_us DESC, o.n DESC",
}


@dataclass(slots=True)
class _Where:
    """Conditions joined by AND, with their values."""

    conditions: list[str] = field(default_factory=lambda: ["1"])
    values: list[object] = field(default_factory=list)

    def add(self, condition: str, *values: object) -> None:
        self.conditions.append(condition)
        self.values += values

    @property
    def text(self) -> str:
        return " AND ".join(self.conditions)


def _source(query: EpisodeQuery) -> str:
    """Return the table to query, with poses and rooms in the map of the query.

    `here_x`, `here_y` and `room_id` are null for observations on maps of unknown placing, so that
    no comparison matches them.
    """
    if query.placings is None:
        return _PLAIN
    moved: dict[str, list[str]] = {"x": [], "y": [], "yaw_rad": [], "room_id": []}
    for placing in query.placings:
        m, is_of_map = placing.motion, f"map_id IS {_quoted(placing.map_id)}"
        cos, sin = math.cos(m.yaw_rad), math.sin(m.yaw_rad)
        values = {
            "x": f"{m.x!r} + {cos!r} * x - {sin!r} * y",
            "y": f"{m.y!r} + {sin!r} * x + {cos!r} * y",
            "yaw_rad": f"yaw_rad + {m.yaw_rad!r}",
            "room_id": "NULL",
        }
        for column, value in values.items():
            here = column if m == Pose(0.0, 0.0) else value
            moved[column].append(f"WHEN {is_of_map} THEN {here}")
    x, y, yaw_rad = (_chosen(moved[column], column) for column in ("x", "y", "yaw_rad"))
    here_x, here_y, room_id = (_chosen(moved[column], "NULL") for column in ("x", "y", "room_id"))
    rest = "n, id, recorded_us, offset_s, stamp_s, map_id, kind, text, labels, picture, text_id"
    return (
        f"(SELECT {rest}, {x} AS x, {y} AS y, {yaw_rad} AS yaw_rad, {room_id} AS room_id, "  # noqa: S608 - our own numbers, quoted names
        f"{here_x} AS here_x, {here_y} AS here_y, {here_x} IS NULL AS is_elsewhere "
        "FROM observations) AS o"
    )


def _chosen(cases: Sequence[str], otherwise: str) -> str:
    return f"CASE {' '.join(cases)} ELSE {otherwise} END" if cases else otherwise


def _quoted(text: str | None) -> str:
    return "NULL" if text is None else "'" + text.replace("'", "''") + "'"


class EpisodeSearch:
    """Queries to the database; texts are cached, as they never change."""

    def __init__(self) -> None:
        self._texts: tuple[str, ...] = ()
        """The text with the id i is [i - 1]."""

    def find(
        self, connection: sqlite3.Connection, query: EpisodeQuery, rank: Rank | None
    ) -> EpisodePage:
        """Return one page of the observations that pass every filter.

        Args:
            connection: Reads one state of the database.
            rank: Scores how well texts fit; None compares words.
        """
        if query.as_of is None:
            newest = connection.execute("SELECT MAX(n) FROM observations").fetchone()[0]
            query = replace(query, as_of=newest or 0)
        near, anchor = query.near, None
        if isinstance(near, EpisodeQuery):
            wanted = replace(near, limit=1, placings=query.placings, as_of=query.as_of)
            anchor = next(iter(self.find(connection, wanted, rank).matches), None)
            if anchor is None:
                return EpisodePage(matches=(), n_matches=0)
            where = _filters(query, anchor.observation.pose.point)
            if anchor.is_elsewhere:
                query = replace(query, placings=None)
            if query.map_id is None and query.placings is None:
                # Coordinates of other maps are not comparable.
                where.add("o.map_id IS ?", anchor.observation.map_id)
            _leave_out(connection, where, near, anchor)
            near = anchor.observation.pose.point
        else:
            where = _filters(query, near)
        scores = None
        if query.words is not None:
            scores = self._score(connection, query, where, rank)
        n_matches, rows = _select(connection, query, near, where, scores)
        behind = query.offset + query.limit
        return EpisodePage(
            matches=tuple(_match(row, query, near, anchor, rank) for row in rows),
            n_matches=n_matches,
            anchor=anchor,
            next_page=replace(query, offset=behind) if behind < n_matches else None,
        )

    def _score(
        self, connection: sqlite3.Connection, query: EpisodeQuery, where: _Where, rank: Rank | None
    ) -> dict[int, float]:
        """Return the best texts that pass the other filters: ids with scores above 0."""
        words = query.words or ""
        is_filtered = len(where.conditions) > 2  # beside the state asked for
        passing = f"SELECT o.text_id FROM {_source(query)} WHERE {where.text}"  # noqa: S608 - our own conditions
        among = np.unique(read_ids(connection, passing, where.values)) if is_filtered else None
        if rank is None:
            scores = score_words(connection, words)
            if among is not None:
                scores[np.isin(np.arange(len(scores)), among, invert=True)] = 0.0
            return _best(scores)
        selection = "SELECT text FROM texts WHERE text_id > ? ORDER BY text_id"
        texts = self._texts
        texts += tuple(row[0] for row in connection.execute(selection, [len(texts)]))
        self._texts = texts
        ids = np.arange(1, len(texts) + 1) if among is None else among
        scores = np.zeros(len(texts) + 1)
        scores[ids] = rank(words, [texts[i - 1] for i in ids.tolist()])
        return _best(scores)


def _leave_out(
    connection: sqlite3.Connection, where: _Where, nested: EpisodeQuery, anchor: EpisodeMatch
) -> None:
    """Leave out what a nested query was about."""
    where.add("o.id != ?", anchor.observation.id)
    if nested.labels:
        where.add(f"o.n NOT IN ({_LABELLED})", _keys_of(nested.labels))
    if nested.words is not None:
        # By words, whatever the ranking: only the thing itself is left out, not similar ones.
        same = list(_best(score_words(connection, nested.words)))
        where.add("o.text_id NOT IN (SELECT value FROM json_each(?))", json.dumps(same))


def _best(scores: Scores) -> dict[int, float]:
    """Return the highest scores above 0 by their place; of equal ones the later, newer text."""
    found = np.flatnonzero(scores > 0)
    if len(found) > MOST_TEXTS:
        # Skip sorting those that cannot be among the best.
        least = np.partition(scores[found], -MOST_TEXTS)[-MOST_TEXTS]
        found = found[scores[found] >= least]
    order = np.lexsort((-found, -scores[found]))[:MOST_TEXTS]
    chosen = found[order]
    return dict(zip(chosen.tolist(), scores[chosen].tolist(), strict=True))


def _select(
    connection: sqlite3.Connection,
    query: EpisodeQuery,
    near: Point | None,
    where: _Where,
    scores: Mapping[int, float] | None,
) -> tuple[int, sqlite3.Cursor]:
    source, score, scored, values = _source(query), "NULL", "", where.values
    if scores is not None:
        source, score = f"scored JOIN {source} USING (text_id)", "scored.score"
        scored = (
            "WITH scored AS MATERIALIZED (SELECT json_extract(value, '$[0]') AS text_id, "
            "json_extract(value, '$[1]') AS score FROM json_each(?))"
        )
        values = [json.dumps(list(scores.items())), *where.values]
    squared = "NULL" if near is None else _squared_m2(near)
    counted = f"{scored} SELECT COUNT(*) FROM {source} WHERE {where.text}"  # noqa: S608 - our own conditions
    n_matches = connection.execute(counted, values).fetchone()[0]
    rows = connection.execute(
        f"{scored} SELECT {COLUMNS}, o.is_elsewhere, {score} AS score, {squared} AS squared_m2 "  # noqa: S608 - our own conditions
        f"FROM {source} WHERE {where.text} ORDER BY {_ORDERS[query.effective_order]} "
        "LIMIT ? OFFSET ?",
        [*values, query.limit, query.offset],
    )
    return n_matches, rows


def _match(
    row: sqlite3.Row,
    query: EpisodeQuery,
    near: Point | None,
    anchor: EpisodeMatch | None,
    rank: Rank | None,
) -> EpisodeMatch:
    observation = observation_from(row)
    given = {
        EpisodeFilter.WORDS if rank is None else EpisodeFilter.MEANING: query.words,
        EpisodeFilter.PLACE: row["squared_m2"],
        EpisodeFilter.ROOM: query.room_id,
        EpisodeFilter.LABEL: query.labels or None,
        EpisodeFilter.TIME: query.since or query.until,
        EpisodeFilter.KIND: query.kind,
        EpisodeFilter.MAP: query.map_id,
    }
    fitting = [] if query.words is None else [query.words]
    if query.words is not None and rank is None:
        fitting = shared_words(query.words, observation.searched_text)
    keys = set(map(name_key, query.labels))
    return EpisodeMatch(
        observation=observation,
        score_ratio=row["score"],
        distance_m=None if row["squared_m2"] is None else math.sqrt(row["squared_m2"]),
        is_elsewhere=bool(row["is_elsewhere"]),
        filters=tuple(each for each, value in given.items() if value is not None),
        fitting=tuple(fitting),
        label=next((each for each in observation.labels if name_key(each) in keys), None),
        near=near,
        near_id=None if anchor is None else anchor.observation.id,
    )


def _filters(query: EpisodeQuery, near: Point | None) -> _Where:
    where = _Where()
    where.add("o.n <= ?", query.as_of)
    if near is not None and query.radius_m is not None:
        r = query.radius_m
        where.add("o.here_x BETWEEN ? AND ?", near.x - r, near.x + r)
        where.add("o.here_y BETWEEN ? AND ?", near.y - r, near.y + r)
        where.add(f"{_squared_m2(near)} <= ?", r * r)
    if query.since is not None:
        where.add("o.recorded_us >= ?", microseconds_of(query.since))
    if query.until is not None:
        where.add("o.recorded_us < ?", microseconds_of(query.until))
    if query.labels:
        where.add(f"o.n IN ({_LABELLED})", _keys_of(query.labels))
    for column, value in (("room_id", query.room_id), ("map_id", query.map_id)):
        if value is not None:
            where.add(f"o.{column} = ?", value)
    if query.kind is not None:
        where.add("o.kind = ?", str(query.kind))
    return where


_LABELLED = "SELECT n FROM labels WHERE label IN (SELECT value FROM json_each(?))"


def _keys_of(labels: Sequence[str]) -> str:
    return json.dumps(list(map(name_key, labels)))


def _squared_m2(near: Point) -> str:
    x, y = float(near.x), float(near.y)
    return f"((o.here_x - {x!r}) * (o.here_x - {x!r}) + (o.here_y - {y!r}) * (o.here_y - {y!r}))"


def observation_from(row: sqlite3.Row) -> Observation:
    """Return the observation that a row of `COLUMNS` holds."""
    zone = timezone(timedelta(seconds=row["offset_s"]))
    time = datetime.fromtimestamp(0, zone) + timedelta(microseconds=row["recorded_us"])
    return Observation(
        id=row["id"],
        recorded_at=time,
        pose=Pose(row["x"], row["y"], wrap_angle(row["yaw_rad"])),
        kind=ObservationKind(row["kind"]),
        text=row["text"],
        labels=tuple(json.loads(row["labels"])),
        picture=row["picture"],
        stamp_s=row["stamp_s"],
        map_id=row["map_id"],
        room_id=row["room_id"],
    )
