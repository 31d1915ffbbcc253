"""What compares meanings, and the vectors that it gave already."""

import contextlib
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Protocol
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from mapspeak.semantic.retrieval.answer import Thresholds

__all__ = ["Embedder", "TextVectors"]


class Embedder(Protocol):
    """Turns texts into vectors: the more alike two texts' meanings, the more alike the vectors.

    The vector of a text is always the same, whatever it is asked together with.
    """

    @property
    def name(self) -> str:
        """Says which model it is; vectors of two models cannot be compared."""

    @property
    def thresholds(self) -> Thresholds:
        """From which likeness on something counts as meant, for this model."""

    def embed(self, texts: Sequence[str]) -> NDArray[np.float32]:
        """Gives one row for each text, a vector of length 1; of 0 where it says nothing."""


class TextVectors:
    """The vectors of texts, each asked of an embedder once.

    Args:
        embedder: Gives the vectors.
        kept: A file with those of an earlier session, which `keep` writes; None where none is kept.
    """

    def __init__(self, embedder: Embedder, *, kept: Path | None = None) -> None:
        self.embedder = embedder
        self._vectors: dict[str, NDArray[np.float32]] = {}
        self._kept = kept
        if kept is not None:
            self.read(kept)
        self._n_kept = len(self._vectors)

    @classmethod
    def in_folder(cls, folder: Path, embedder: Embedder) -> "TextVectors":
        """Takes up the vectors that are kept in a memory's folder; `keep` writes the new ones."""
        return cls(embedder, kept=folder / "vectors.npz")

    def keep(self) -> None:
        """Writes the file if there are new vectors; one that cannot be written costs only time."""
        if self._kept is None or len(self) == self._n_kept:
            return
        with contextlib.suppress(OSError):
            self._kept.parent.mkdir(parents=True, exist_ok=True)
            self.write(self._kept)
            self._n_kept = len(self)

    def __len__(self) -> int:
        return len(self._vectors)

    def find(self, texts: Iterable[str]) -> NDArray[np.float32]:
        """Gives one row for each text; only those that were never asked for are embedded."""
        wanted = list(texts)
        new = sorted(set(wanted) - self._vectors.keys())
        if new:
            self._vectors |= dict(zip(new, self.embedder.embed(new), strict=True))
        if not wanted:
            return self.embedder.embed([])
        return np.array([self._vectors[text] for text in wanted], dtype=np.float32)

    def write(self, path: Path) -> None:
        """Keeps the vectors in an .npz file; a later session need not compute them again.

        The file is replaced as a whole.
        """
        texts = sorted(self._vectors)
        unfinished = path.with_name(f"{path.name}.{os.getpid()}.tmp")
        with unfinished.open("wb") as file:
            np.savez(file, model=self.embedder.name, texts=texts, vectors=self.find(texts))
        unfinished.replace(path)

    def read(self, path: Path) -> None:
        """Takes the vectors of an earlier session, if the same model gave them.

        A file that is missing or broken is passed over: all it holds can be computed again.
        """
        try:
            with path.open("rb") as file, np.load(file) as kept:
                model, texts, rows = str(kept["model"]), kept["texts"].tolist(), kept["vectors"]
        except (BadZipFile, EOFError, KeyError, OSError, ValueError):
            return
        if model == self.embedder.name:
            self._vectors |= dict(zip(texts, rows, strict=True))
