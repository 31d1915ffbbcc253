"""All tasks by name, and the groups in which they are asked for; and the paper's Task 1.

Its Tasks 2 and 3 are one room and one object among others. The prompts are those of its Table "User
prompts for each evaluation task", word for word, and the guidance is the prompt of its appendix
with the semantic filtering policy.
"""

import math
from collections.abc import Iterable, Mapping
from types import MappingProxyType

from mapspeak.errors import ConfigError, say_nearest
from mapspeak.evaluation.scores.judging import judge_coverage
from mapspeak.evaluation.tasks.errands import ERRAND_TASKS
from mapspeak.evaluation.tasks.failures import FAILURE_TASKS
from mapspeak.evaluation.tasks.inspections import INSPECTION_TASKS
from mapspeak.evaluation.tasks.questions import QUESTION_TASKS
from mapspeak.evaluation.tasks.rooms import ROOM_TASKS
from mapspeak.evaluation.tasks.task import Draw, Task
from mapspeak.evaluation.tasks.things import OBJECT_TASKS, RELATION_TASKS, ROUTE_TASK
from mapspeak.evaluation.trials import Limits, Setting
from mapspeak.server.toolsets import read_text

EXPLORE = "explore"
EXPLORE_LIMITS = Limits(n_calls=1000, robot_time_s=3600.0, wall_s=math.inf)
"""No wall time: a loaded machine would cut explorations short and fail what is asked after them."""


def _draw_exploration(draw: Draw) -> Setting:
    """Start where the world says, so that others can go on with this map."""
    return Setting(
        prompt="Update the map while moving.",
        guidance=f"{read_text('exploration')}\n\n{read_text('semantic_policy')}",
        start=draw.site.world.start,
        is_known=False,
        tools=("explore",),
        limits=EXPLORE_LIMITS,
    )


EXPLORE_TASK = Task(
    name=EXPLORE,
    draw=_draw_exploration,
    judge=lambda site, _truth, evidence: judge_coverage(site, evidence),
    needs_map=False,
)

_ALL = (
    EXPLORE_TASK,
    *ROOM_TASKS,
    *OBJECT_TASKS,
    *RELATION_TASKS,
    ROUTE_TASK,
    *QUESTION_TASKS,
    *FAILURE_TASKS,
    *ERRAND_TASKS,
    *INSPECTION_TASKS,
)
_TASKS: Mapping[str, Task] = MappingProxyType({task.name: task for task in _ALL})

FAMILIES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "paper": (EXPLORE, "smallest-room", "fire-tool"),
        "rooms": tuple(task.name for task in ROOM_TASKS),
        "objects": ("fire-tool", "object", "view", "superlative"),
        "relations": tuple(task.name for task in RELATION_TASKS),
        "routes": ("route",),
        "search": ("search",),
        "questions": tuple(task.name for task in QUESTION_TASKS),
        "failures": tuple(task.name for task in FAILURE_TASKS),
        "errands": tuple(task.name for task in ERRAND_TASKS),
        "inspection": tuple(task.name for task in INSPECTION_TASKS),
        "all": tuple(_TASKS),
    }
)
"""Groups of tasks; the paper's three in the paper's order."""


def find_task(name: str) -> Task:
    """Return a task by its name.

    Raises:
        ConfigError: No task has that name.
    """
    if name not in _TASKS:
        known = (*FAMILIES, *_TASKS)
        hint = f"{say_nearest(name, known)}There are: {', '.join(known)}."
        raise ConfigError(f"There is no task {name[:80]!r}.", hint=hint)
    return _TASKS[name]


def choose_tasks(names: Iterable[str]) -> tuple[Task, ...]:
    """Return tasks by the names of tasks or groups, each once.

    Raises:
        ConfigError: A name is unknown.
    """
    chosen: dict[str, Task] = {}
    for name in names:
        for each in FAMILIES.get(name, (name,)):
            chosen[each] = find_task(each)
    return tuple(chosen.values())
