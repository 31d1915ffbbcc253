"""Whether what is remembered can be true: findings that people can read, and what trust is left."""

from mapspeak.semantic.consistency.checking import check_memory
from mapspeak.semantic.consistency.findings import Finding, FindingKind, Trust, judge_trust

__all__ = ["Finding", "FindingKind", "Trust", "check_memory", "judge_trust"]
