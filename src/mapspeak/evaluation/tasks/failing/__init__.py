"""Failures on purpose: what map or memory say is not so, or means no good."""

from mapspeak.evaluation.tasks.failing.spoiled import SpoiledMemory, Spoiling
from mapspeak.evaluation.tasks.failing.ways import BlockedWay, StaleMap

__all__ = ["FAILURE_TASKS"]

FAILURE_TASKS = (
    BlockedWay(),
    StaleMap(),
    SpoiledMemory(Spoiling.MISSING),
    SpoiledMemory(Spoiling.WRONG),
    SpoiledMemory(Spoiling.HOSTILE),
)
