"""What anybody knows of things in buildings: what they are also called, and what for."""

from mapspeak.semantic.retrieval.knowledge.kinds import (
    Kind,
    ends_with,
    find_kinds,
    find_kinds_called,
    find_named_kinds,
    find_names,
    head_stems,
    is_gone,
    read_kinds,
)

__all__ = [
    "Kind",
    "ends_with",
    "find_kinds",
    "find_kinds_called",
    "find_named_kinds",
    "find_names",
    "head_stems",
    "is_gone",
    "read_kinds",
]
