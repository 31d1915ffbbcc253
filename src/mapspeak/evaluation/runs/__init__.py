"""Runs: many trials, each in a process of its own, and one run that can be taken up again."""
