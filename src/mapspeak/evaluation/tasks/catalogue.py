"""All tasks by name, and the groups in which they are asked for."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from mapspeak.errors import ConfigError
from mapspeak.evaluation.tasks.blocked import BLOCKED_TASKS
from mapspeak.evaluation.tasks.inspections import INSPECTION_TASKS
from mapspeak.evaluation.tasks.objects import OBJECT_TASKS
from mapspeak.evaluation.tasks.paper import EXPLORE, EXPLORE_TASK
from mapspeak.evaluation.tasks.questions import QUESTION_TASKS
from mapspeak.evaluation.tasks.relations import RELATION_TASKS, ROUTE_TASK
from mapspeak.evaluation.tasks.rooms import ROOM_TASKS
from mapspeak.evaluation.tasks.spoiled import MEMORY_TASKS
from mapspeak.evaluation.tasks.task import Task

FAILURE_TASKS = (*BLOCKED_TASKS, *MEMORY_TASKS)
_ALL = (
    EXPLORE_TASK,
    *ROOM_TASKS,
    *OBJECT_TASKS,
    *RELATION_TASKS,
    ROUTE_TASK,
    *QUESTION_TASKS,
    *FAILURE_TASKS,
    *INSPECTION_TASKS,
)
_TASKS: Mapping[str, Task] = MappingProxyType({task.name: task for task in _ALL})

FAMILIES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "paper": (EXPLORE, "smallest-room", "fire-tool"),
        "rooms": tuple(task.name for task in ROOM_TASKS),
        "objects": ("fire-tool", "object"),
        "relations": tuple(task.name for task in RELATION_TASKS),
        "routes": ("route",),
        "search": ("search",),
        "questions": tuple(task.name for task in QUESTION_TASKS),
        "failures": tuple(task.name for task in FAILURE_TASKS),
        "inspection": tuple(task.name for task in INSPECTION_TASKS),
        "all": tuple(_TASKS),
    }
)
"""Groups of tasks; the paper's three in the paper's order."""


def task_names() -> tuple[str, ...]:
    """Return the names of all tasks."""
    return tuple(_TASKS)


def find_task(name: str) -> Task:
    """Return a task by its name.

    Raises:
        ConfigError: There is none of that name.
    """
    if name not in _TASKS:
        known = ", ".join((*FAMILIES, *_TASKS))
        raise ConfigError(f"There is no task {name[:80]!r}.", hint=f"There are: {known}.")
    return _TASKS[name]


def choose_tasks(names: Iterable[str]) -> tuple[Task, ...]:
    """Return tasks by their own names and those of their groups, each once.

    Raises:
        ConfigError: There is none of a name.
    """
    chosen: dict[str, Task] = {}
    for name in names:
        for each in FAMILIES.get(name, (name,)):
            chosen[each] = find_task(each)
    return tuple(chosen.values())
