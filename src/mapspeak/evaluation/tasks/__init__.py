"""Tasks: what is asked, made for a world from its truth and a seed, and how it is scored."""

from mapspeak.evaluation.tasks.catalogue import FAMILIES, choose_tasks, find_task, task_names
from mapspeak.evaluation.tasks.paper import EXPLORE
from mapspeak.evaluation.tasks.task import Task

__all__ = ["EXPLORE", "FAMILIES", "Task", "choose_tasks", "find_task", "task_names"]
