"""Finds what is remembered by the words that people use for it."""

from mapspeak.memory.search.answer import (
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
from mapspeak.memory.search.index import WORDS_ONLY, EntryIndex
from mapspeak.memory.search.kinds import calls_by_name
from mapspeak.memory.search.meaningindex import Embedder, TextVectors, find_model

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
