"""A model that knows a handful of concepts: small enough to see in a test what it will find."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mapspeak.memory.search.answer import Chance, Thresholds
from mapspeak.memory.search.meaningindex import Embedder, find_model
from mapspeak.memory.search.wordindex import split_words, stem

__all__ = ["ConceptEmbedder", "shipped_model"]

CONCEPTS = (
    ("fire", "flame", "burn", "extinguisher", "blanket"),
    ("water", "wash", "sink", "thirsty", "drink", "cooler"),
    ("reach", "high", "ladder", "shelf", "climb"),
    ("hurt", "cut", "bandage", "aid", "finger"),
)


class ConceptEmbedder:
    """Counts the words of each concept; what it knows nothing of is a vector of 0.

    Attributes:
        asked: Every text it had to embed, in order.
    """

    name = "concepts"
    thresholds = Thresholds(
        least_ratio=0.3,
        same_ratio=0.02,
        right=Chance(constant=-16.0, likeness=20.0, lead=20.0, missing=0.0),
        there=Chance(constant=-5.4, likeness=20.0, missing=-10.0),
    )

    def __init__(self) -> None:
        self.asked: list[str] = []

    def embed(self, texts: Sequence[str]) -> NDArray[np.float32]:
        self.asked += texts
        rows = [_concepts(text) for text in texts]
        return np.array(rows, dtype=np.float32).reshape(-1, len(CONCEPTS))


def _concepts(text: str) -> list[float]:
    stems = [stem(word) for _, word in split_words(text)]
    counts = [sum(stem(word) in stems for word in concept) for concept in CONCEPTS]
    length = float(np.linalg.norm(counts)) or 1.0
    return [count / length for count in counts]


def shipped_model() -> Embedder:
    """Gives the model of the extra `semantic`, which the packages for development hold."""
    model = find_model()
    assert model is not None, "the extra semantic is not installed"
    return model
