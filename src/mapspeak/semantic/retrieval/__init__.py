"""Finds what is remembered by the words that people use for it."""

from mapspeak.semantic.retrieval.answer import (
    Answer,
    Basis,
    Entry,
    EntryCandidate,
    EntryKind,
    MatchEvidence,
    MatchField,
    MatchKind,
    Thresholds,
    Verdict,
    list_entries,
)
from mapspeak.semantic.retrieval.index import WORDS_ONLY, EntryIndex
from mapspeak.semantic.retrieval.kinds import calls_by_name
from mapspeak.semantic.retrieval.meaningindex import Embedder, TextVectors
from mapspeak.semantic.retrieval.minilm import find_model

__all__ = [
    "WORDS_ONLY",
    "Answer",
    "Basis",
    "Embedder",
    "Entry",
    "EntryCandidate",
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
