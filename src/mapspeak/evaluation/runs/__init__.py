"""Runs: many trials, each in a process of its own, and one run that can be taken up again."""

from mapspeak.evaluation.runs.folder import writing_to
from mapspeak.evaluation.runs.run import RunOptions, plan_run, run_evaluation
from mapspeak.evaluation.runs.schedule import Job, run_jobs
from mapspeak.evaluation.runs.showing import RunBar, build_table, show_run

__all__ = [
    "Job",
    "RunBar",
    "RunOptions",
    "build_table",
    "plan_run",
    "run_evaluation",
    "run_jobs",
    "show_run",
    "writing_to",
]
