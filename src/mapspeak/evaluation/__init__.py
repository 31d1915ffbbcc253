"""Trials: tasks, agents, scores, reports."""
