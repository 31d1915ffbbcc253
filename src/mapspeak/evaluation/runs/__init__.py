"""Runs: many trials, each in a process of its own, and one run that can be taken up again."""

from mapspeak.evaluation.runs.attempt import attempt
from mapspeak.evaluation.runs.inspectlog import write_log
from mapspeak.evaluation.runs.plan import RunOptions, RunPlan, plan_run
from mapspeak.evaluation.runs.runner import (
    TrialJob,
    make_jobs,
    run_evaluation,
    run_jobs,
    writing_to,
)
from mapspeak.evaluation.runs.showing import (
    RunBar,
    TrialBar,
    announce,
    build_table,
    say_result,
    show_run,
    show_trials,
)

__all__ = [
    "RunBar",
    "RunOptions",
    "RunPlan",
    "TrialBar",
    "TrialJob",
    "announce",
    "attempt",
    "build_table",
    "make_jobs",
    "plan_run",
    "run_evaluation",
    "run_jobs",
    "say_result",
    "show_run",
    "show_trials",
    "write_log",
    "writing_to",
]
