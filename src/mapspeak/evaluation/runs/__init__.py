"""Runs of many trials, each in its own process; a run can be resumed."""
