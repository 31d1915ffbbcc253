"""Ranks texts by meaning, with the vectors of texts kept in the database."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mapspeak.semantic.episodes.database import EpisodeDatabase
from mapspeak.semantic.episodes.words import text_hash
from mapspeak.semantic.retrieval import Embedder

__all__ = ["VectorRank"]

Vectors = NDArray[np.float32]

_BATCH = 512


class VectorRank:
    """A `Rank` that embeds each text once, whatever process asks.

    Args:
        database: Where vectors are kept, by embedder and text.
        embedder: What makes them.
        min_score_ratio: The cosine from which on a text fits; None leaves it to the embedder.
    """

    def __init__(
        self, database: EpisodeDatabase, embedder: Embedder, *, min_score_ratio: float | None = None
    ) -> None:
        self._database = database
        self._embedder = embedder
        least_ratio = embedder.thresholds.least_ratio
        self._min_score_ratio = least_ratio if min_score_ratio is None else min_score_ratio
        self._row_of: dict[str, int] = {}
        self._vectors: Vectors = np.zeros((0, 0), np.float32)
        self._kept: dict[bytes, bytes] | None = None

    def __call__(self, query: str, texts: Sequence[str]) -> list[float]:
        """Gives the score of each text: the cosine where it is enough, else 0."""
        self._learn([text for text in dict.fromkeys(texts) if text not in self._row_of])
        if not texts:
            return []
        asked = self._embedder.embed([query])[0]
        cosines = self._vectors @ asked
        scores = np.where(cosines >= self._min_score_ratio, cosines, 0.0)
        rows = np.fromiter((self._row_of[text] for text in texts), np.intp, len(texts))
        found: list[float] = scores[rows].tolist()
        return found

    def _learn(self, texts: Sequence[str]) -> None:
        """Takes the vectors of texts from the database, or makes and keeps them."""
        if not texts:
            return
        kept = self._read()
        hashes = [text_hash(text) for text in texts]
        missing = [(key, text) for key, text in zip(hashes, texts, strict=True) if key not in kept]
        for start in range(0, len(missing), _BATCH):
            batch = missing[start : start + _BATCH]
            vectors = self._embedder.embed([text for _, text in batch])
            made = {
                key: np.asarray(vector, np.float16).tobytes()
                for (key, _), vector in zip(batch, vectors, strict=True)
            }
            # At once: whoever is stopped amid many texts need not begin anew.
            self._write(made)
            kept |= made
        rows = np.frombuffer(b"".join(map(kept.pop, hashes)), np.float16)
        new = rows.reshape(len(texts), -1).astype(np.float32)
        self._vectors = np.vstack([self._vectors, new]) if self._row_of else new
        self._row_of |= {text: len(self._row_of) + i for i, text in enumerate(texts)}

    def _read(self) -> dict[bytes, bytes]:
        """Gives the kept vectors that were not taken yet; all are read once."""
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
