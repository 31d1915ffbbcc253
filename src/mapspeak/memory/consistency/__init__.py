"""Whether what is remembered can be true: findings that people can read, and what trust is left."""

from mapspeak.memory.consistency.checking import check_memory
from mapspeak.memory.consistency.findings import FindingKind, MemoryFinding, Trust, judge_trust

__all__ = ["FindingKind", "MemoryFinding", "Trust", "check_memory", "judge_trust"]
