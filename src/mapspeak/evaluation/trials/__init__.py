"""Trials: what is attempted, what came of it, and how both lie on the disk."""

from mapspeak.evaluation.trials.records import (
    Agent,
    AgentEnd,
    Assignment,
    ServerAccess,
    find_result,
    read_result,
    read_results,
    read_turns,
    say_fault,
    trial_folder,
    write_result,
)
from mapspeak.evaluation.trials.trial import (
    Failure,
    Limits,
    Score,
    Setting,
    ToolCall,
    Trial,
    TrialResult,
    TrialState,
    Turn,
)

__all__ = [
    "Agent",
    "AgentEnd",
    "Assignment",
    "Failure",
    "Limits",
    "Score",
    "ServerAccess",
    "Setting",
    "ToolCall",
    "Trial",
    "TrialResult",
    "TrialState",
    "Turn",
    "find_result",
    "read_result",
    "read_results",
    "read_turns",
    "say_fault",
    "trial_folder",
    "write_result",
]
