"""How well the texts of observations fit words, by whoever ranks them."""

import sqlite3
from dataclasses import dataclass

import numpy as np

from mapspeak.semantic.episodes.asking import Rank
from mapspeak.semantic.episodes.words import Ids, Scores, read_ids, score_words

__all__ = ["TextScorer"]

MOST_TEXTS = 2000
"""How many different texts, the best ones, one query looks at."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Texts:
    """All texts, as they were read last: the text with the id `i` is `texts[i - 1]`.

    Attributes:
        generation: Of the index; another one has other ids.
        texts: In the order of their ids.
    """

    generation: str = ""
    texts: tuple[str, ...] = ()


class TextScorer:
    """Scores texts, and keeps those that it has read: they never change."""

    def __init__(self) -> None:
        self._known = _Texts()

    def score(
        self,
        connection: sqlite3.Connection,
        words: str,
        rank: Rank | None,
        *,
        among: str,
        values: list[object],
    ) -> dict[int, float]:
        """Gives the best texts by their ids, each with its score above 0.

        Args:
            connection: Of the database.
            words: What is asked for.
            rank: Who says how well a text fits; None compares words.
            among: A selection of text ids; empty for all texts.
            values: For the selection.
        """
        text_ids = read_ids(connection, among, values) if among else None
        if rank is None:
            scores = score_words(connection, words)
            if text_ids is not None:
                passing = np.zeros(len(scores))
                passing[text_ids] = 1.0
                scores *= passing
        else:
            scores = self._ranked(connection, words, rank, text_ids)
        return _best(scores)

    def _ranked(
        self,
        connection: sqlite3.Connection,
        words: str,
        rank: Rank,
        text_ids: Ids | None,
    ) -> Scores:
        texts = self._read(connection)
        scores = np.zeros(len(texts) + 1)
        if text_ids is None:
            scores[1:] = rank(words, texts)
            return scores
        ids = np.unique(text_ids)
        scores[ids] = rank(words, [texts[i - 1] for i in ids.tolist()])
        return scores

    def _read(self, connection: sqlite3.Connection) -> tuple[str, ...]:
        """Gives all texts, reading only those that are new."""
        selection = "SELECT value FROM facts WHERE name = 'generation'"
        row = connection.execute(selection).fetchone()
        generation = "" if row is None else str(row[0])
        known = self._known
        if known.generation != generation:
            known = _Texts(generation=generation)
        rows = connection.execute(
            "SELECT text FROM texts WHERE text_id > ? ORDER BY text_id", [len(known.texts)]
        ).fetchall()
        if rows or known is not self._known:
            texts = (*known.texts, *(row[0] for row in rows))
            self._known = known = _Texts(generation=generation, texts=texts)
        return known.texts


def _best(scores: Scores) -> dict[int, float]:
    """Gives the highest scores above 0 by their place; of equal ones the later, newer text."""
    found = np.flatnonzero(scores > 0)
    if len(found) > MOST_TEXTS:
        # What is not among them for sure need not be sorted.
        least = np.partition(scores[found], -MOST_TEXTS)[-MOST_TEXTS]
        found = found[scores[found] >= least]
    order = np.lexsort((-found, -scores[found]))[:MOST_TEXTS]
    chosen = found[order]
    return dict(zip(chosen.tolist(), scores[chosen].tolist(), strict=True))
