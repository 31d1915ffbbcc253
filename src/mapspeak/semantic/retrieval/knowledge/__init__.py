"""What anybody knows of things in buildings: what they are also called, and what for."""

from mapspeak.semantic.retrieval.knowledge.kinds import (
    Kind,
    find_kinds,
    find_named_kinds,
    read_kinds,
)

__all__ = ["Kind", "find_kinds", "find_named_kinds", "read_kinds"]
