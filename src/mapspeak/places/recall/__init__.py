"""Recalling: what is remembered of a request, where it is, how sure, and where to stand for it."""

from mapspeak.places.recall.answer import (
    SURE_RATIO,
    Recall,
    RecallCandidate,
    RecallDoubt,
    RecallQuery,
)
from mapspeak.places.recall.asking import describe_candidate, find_speaking_places, recall
from mapspeak.places.recall.nearby import Nearby, find_nearby

__all__ = [
    "SURE_RATIO",
    "Nearby",
    "Recall",
    "RecallCandidate",
    "RecallDoubt",
    "RecallQuery",
    "describe_candidate",
    "find_nearby",
    "find_speaking_places",
    "recall",
]
