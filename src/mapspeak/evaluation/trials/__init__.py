"""Trials: what is attempted, what came of it, and how both lie on the disk."""

from mapspeak.evaluation.trials.records import (
    RunPlan,
    Sitting,
    is_done,
    read_plan,
    read_result,
    read_results,
    read_turns,
    trial_folder,
    write_plan,
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
    "Failure",
    "Limits",
    "RunPlan",
    "Score",
    "Setting",
    "Sitting",
    "ToolCall",
    "Trial",
    "TrialResult",
    "TrialState",
    "Turn",
    "is_done",
    "read_plan",
    "read_result",
    "read_results",
    "read_turns",
    "trial_folder",
    "write_plan",
    "write_result",
]
