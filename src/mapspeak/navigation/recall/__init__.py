"""Recalling: what is remembered of a request, where it is, how sure, and where to stand for it."""

from mapspeak.navigation.recall.answer import Recall, RecallCandidate, RecallQuery
from mapspeak.navigation.recall.asking import find_speaking_places, recall
from mapspeak.navigation.recall.candidates import describe_candidate
from mapspeak.navigation.recall.nearby import Nearby, find_nearby
from mapspeak.navigation.recall.wording import SURE_RATIO

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
