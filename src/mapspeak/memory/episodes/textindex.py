"""The text index of observations: by words, and by meaning."""

import difflib
import hashlib
import math
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from mapspeak.memory.episodes.database import EpisodeDatabase
from mapspeak.memory.policy import words_of
from mapspeak.memory.search.answer import KIND_WEIGHTS, MatchKind
from mapspeak.memory.search.meaningindex import Embedder
from mapspeak.memory.search.wordindex import (
    MIN_LETTERS,
    MIN_LIKENESS_RATIO,
    content_words,
    split_words,
    stem,
)

MIN_SCORE_RATIO = 0.25
"""Below, too little of the query was found to speak of a match."""


Scores = NDArray[np.float64]


def text_hash(text: str) -> bytes:
    """Return what tells one text from another."""
    return hashlib.blake2b(text.encode(), digest_size=12).digest()


def words_in(text: str) -> dict[str, str]:
    """Return the words of a text as they are compared, each with how it stands there."""
    return {stem(word): shown for shown, word in split_words(text)}


def add_text(connection: sqlite3.Connection, text: str) -> int:
    """Return the id of a text; one that is new is indexed. Ids are 1, 2, 3 and so on."""
    known = connection.execute("SELECT text_id FROM texts WHERE hash = ?", [text_hash(text)])
    row = known.fetchone()
    if row is not None:
        return int(row[0])
    insertion = "INSERT INTO texts (hash, text) VALUES (?, ?)"
    text_id = connection.execute(insertion, (text_hash(text), text)).lastrowid
    assert text_id is not None  # noqa: S101 - a row was inserted
    words = [(word, text_id) for word in sorted(words_in(text))]
    connection.executemany("INSERT INTO words VALUES (?, ?)", words)
    connection.executemany(
        "INSERT INTO vocabulary VALUES (?, 1) ON CONFLICT DO UPDATE SET n_texts = n_texts + 1",
        [(word,) for word, _ in words],
    )
    return text_id


def score_words(connection: sqlite3.Connection, query: str) -> Scores:
    """Return the share of a query that each text says, by its id; 0 where it is too little."""
    n_texts = int(connection.execute("SELECT MAX(text_id) FROM texts").fetchone()[0] or 0)
    scores = np.zeros(n_texts + 1)
    total = 0.0
    for spellings, weight in _asked_words(connection, query, n_texts):
        total += weight
        found = np.zeros(n_texts + 1)
        for spelling, ratio in spellings.items():
            text_ids = read_ids(connection, "SELECT text_id FROM words WHERE word = ?", [spelling])
            found[text_ids] = np.maximum(found[text_ids], weight * ratio)
        scores += found
    return np.where(scores >= total * MIN_SCORE_RATIO, scores / max(total, 1e-9), 0.0)


def read_ids(
    connection: sqlite3.Connection, selection: str, values: Iterable[object]
) -> NDArray[np.int64]:
    """Return the integers that a selection of one column finds."""
    cursor = connection.cursor()
    cursor.row_factory = None
    rows = cursor.execute(selection, list(values)).fetchall()
    return np.fromiter(chain.from_iterable(rows), np.int64, len(rows))


def shared_words(query: str, text: str) -> list[str]:
    """Return the words of a text that the query has too, as they stand in the text."""
    asked, said = _words_asked(query), words_in(text)
    near = (difflib.get_close_matches(w, said, n=1, cutoff=MIN_LIKENESS_RATIO) for w in asked)
    return [said[word] for word in dict.fromkeys(chain(*near))]


def _asked_words(
    connection: sqlite3.Connection, query: str, n_texts: int
) -> Iterator[tuple[dict[str, float], float]]:
    """Return each word of a query: its spellings in texts, each with its likeness; its weight."""
    for word in _words_asked(query):
        spellings = dict(_spellings(connection, word))
        n_with = sum(n for n, _ in spellings.values())
        ratios = {spelling: ratio for spelling, (_, ratio) in spellings.items()}
        yield ratios, math.log1p(n_texts / max(n_with, 1))


def _words_asked(query: str) -> list[str]:
    said = [stem(word) for _, word in content_words(query) if word not in words_of("asking")]
    return list(dict.fromkeys(said)) or list(words_in(query))


def _spellings(
    connection: sqlite3.Connection, word: str
) -> Iterator[tuple[str, tuple[int, float]]]:
    """Return the known words that count as this one; likeness only where it is not known."""
    count = "SELECT n_texts FROM vocabulary WHERE word = ?"
    row = connection.execute(count, [word]).fetchone()
    if row is not None:
        yield word, (row[0], 1.0)
    elif len(word) >= MIN_LETTERS and not word.isnumeric():
        # Who misspells a word seldom misspells its first letter.
        alike = connection.execute(
            "SELECT word, n_texts FROM vocabulary"
            " WHERE word >= ? AND word < ? AND length(word) BETWEEN ? AND ?",
            (word[0], chr(ord(word[0]) + 1), len(word) - 2, len(word) + 2),
        )
        counts = {known: n for known, n in alike}  # noqa: C416 - rows are no pairs for dict()
        for near in difflib.get_close_matches(word, counts, n=3, cutoff=MIN_LIKENESS_RATIO):
            yield near, (counts[near], KIND_WEIGHTS[MatchKind.MISSPELT])


Vectors = NDArray[np.float32]

_BATCH = 512
_AHEAD = 64
"""So few take some hundredths of a second: a question that comes meanwhile hardly waits."""


class VectorRank:
    """A `Rank` that embeds each text once, whatever process asks.

    Args:
        lock: Held meanwhile where several threads ask: it learns the texts that it has not met.
    """

    def __init__(
        self,
        database: EpisodeDatabase,
        embedder: Embedder,
        *,
        lock: AbstractContextManager[object] | None = None,
    ) -> None:
        self._database = database
        self._embedder = embedder
        self._row_of: dict[str, int] = {}
        self._vectors: Vectors = np.zeros((0, 0), np.float32)
        self._kept: dict[bytes, bytes] | None = None
        self._n_ahead = 0
        self._lock = lock or nullcontext()

    def learn_ahead(self) -> bool:
        """Make and keep the vectors of some texts that have none; return False at the end of all.

        They are left on the disk: no memory is spent before a question needs them.
        """
        selection = (
            "SELECT text_id, text, hash FROM texts WHERE text_id > ? AND NOT EXISTS (SELECT 1 FROM"
            " vectors WHERE embedder = ? AND vectors.hash = texts.hash) ORDER BY text_id LIMIT ?"
        )
        if not self._database.exists():
            return False
        with self._lock:
            with self._database.reading() as connection:
                values = [self._n_ahead, self._embedder.name, _AHEAD]
                rows = connection.execute(selection, values).fetchall()
            if rows:
                self._embed({row["hash"]: row["text"] for row in rows})
                self._n_ahead = rows[-1]["text_id"]
        return bool(rows)

    def __call__(self, query: str, texts: Sequence[str]) -> list[float]:
        """Return the score of each text: the cosine where it is enough, else 0."""
        with self._lock:
            return self._score(query, texts)

    def _score(self, query: str, texts: Sequence[str]) -> list[float]:
        self._learn([text for text in dict.fromkeys(texts) if text not in self._row_of])
        if not texts:
            return []
        asked = self._embedder.embed([query])[0]
        cosines = self._vectors @ asked
        scores = np.where(cosines >= self._embedder.thresholds.least_ratio, cosines, 0.0)
        rows = np.fromiter((self._row_of[text] for text in texts), np.intp, len(texts))
        found: list[float] = scores[rows].tolist()
        return found

    def _learn(self, texts: Sequence[str]) -> None:
        """Take the vectors of texts from the database, or make and keep them."""
        if not texts:
            return
        kept = self._read()
        hashes = [text_hash(text) for text in texts]
        missing = [(key, text) for key, text in zip(hashes, texts, strict=True) if key not in kept]
        for start in range(0, len(missing), _BATCH):
            kept |= self._embed(dict(missing[start : start + _BATCH]))
        rows = np.frombuffer(b"".join(map(kept.pop, hashes)), np.float16)
        new = rows.reshape(len(texts), -1).astype(np.float32)
        self._vectors = np.vstack([self._vectors, new]) if self._row_of else new
        self._row_of |= {text: len(self._row_of) + i for i, text in enumerate(texts)}

    def _embed(self, texts: Mapping[bytes, str]) -> dict[bytes, bytes]:
        """Make the vectors of some texts, under their hashes, and keep them."""
        vectors = np.asarray(self._embedder.embed(list(texts.values())), np.float16)
        made = {key: vector.tobytes() for key, vector in zip(texts, vectors, strict=True)}
        # At once: whoever is stopped amid many texts need not begin anew.
        self._write(made)
        return made

    def _read(self) -> dict[bytes, bytes]:
        """Return the kept vectors that were not taken yet; all are read once."""
        if self._kept is None:
            self._kept = {}
            if self._database.exists():
                selection = "SELECT hash, vector FROM vectors WHERE embedder = ?"
                with self._database.reading() as connection:
                    connection.row_factory = None
                    self._kept = dict(connection.execute(selection, [self._embedder.name]))
        return self._kept

    def _write(self, made: dict[bytes, bytes]) -> None:
        if made and self._database.exists():
            rows = [(self._embedder.name, key, vector) for key, vector in made.items()]
            with self._database.writing() as connection:
                connection.executemany("INSERT OR IGNORE INTO vectors VALUES (?, ?, ?)", rows)
