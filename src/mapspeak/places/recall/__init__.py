"""Recalling: what is remembered of a request, where it is, how sure, and where to stand for it."""

from mapspeak.places.recall.answer import Recall, RecallCandidate, RecallQuery
from mapspeak.places.recall.asking import find_speaking_places, recall
from mapspeak.places.recall.candidates import describe_candidate
from mapspeak.places.recall.nearby import Nearby, find_nearby
from mapspeak.places.recall.wording import SURE_RATIO

__all__ = [
    "SURE_RATIO",
    "Nearby",
    "Recall",
    "RecallCandidate",
    "RecallQuery",
    "describe_candidate",
    "find_nearby",
    "find_speaking_places",
    "recall",
]
