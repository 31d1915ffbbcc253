"""Questions about a robot's ROS: what is there, how it is doing, and what is out of order."""

from mapspeak.evaluation.tasks.inspection.graph import GRAPH_TASKS
from mapspeak.evaluation.tasks.inspection.messages import MESSAGE_TASKS

__all__ = ["INSPECTION_TASKS"]

INSPECTION_TASKS = (*GRAPH_TASKS, *MESSAGE_TASKS)
