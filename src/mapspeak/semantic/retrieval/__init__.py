"""Finds what is remembered by the words that people use for it."""

from mapspeak.semantic.retrieval.answer import Answer, Basis, Candidate, Thresholds, Verdict
from mapspeak.semantic.retrieval.embedder import Embedder, TextVectors
from mapspeak.semantic.retrieval.entry import Entry, EntryKind, list_entries
from mapspeak.semantic.retrieval.evidence import MatchEvidence, MatchField, MatchKind
from mapspeak.semantic.retrieval.index import WORDS_ONLY, EntryIndex
from mapspeak.semantic.retrieval.meaning import find_model
from mapspeak.semantic.retrieval.naming import calls_by_name

__all__ = [
    "WORDS_ONLY",
    "Answer",
    "Basis",
    "Candidate",
    "Embedder",
    "Entry",
    "EntryIndex",
    "EntryKind",
    "MatchEvidence",
    "MatchField",
    "MatchKind",
    "TextVectors",
    "Thresholds",
    "Verdict",
    "calls_by_name",
    "find_model",
    "list_entries",
]
