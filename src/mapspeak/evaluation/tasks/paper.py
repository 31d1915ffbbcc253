"""The paper's Task 1; its Tasks 2 and 3 are one room and one object among others.

The prompts are those of its Table "User prompts for each evaluation task", word for word, and the
guidance is the prompt of its appendix with the semantic filtering policy.
"""

from mapspeak.evaluation.scores.judging import judge_coverage
from mapspeak.evaluation.tasks.task import Draw, Task
from mapspeak.evaluation.trials import Limits, Setting
from mapspeak.server.prompts import read_text

EXPLORE = "explore"
LIMITS = Limits(n_calls=1000, robot_time_s=3600.0, wall_s=900.0)


def _draw(draw: Draw) -> Setting:
    """Start where the world says, so that others can go on with this map."""
    return Setting(
        prompt="Update the map while moving.",
        guidance=f"{read_text('exploration')}\n\n{read_text('semantic_policy')}",
        start=draw.site.world.start,
        is_known=False,
        tools=("explore",),
        limits=LIMITS,
    )


EXPLORE_TASK = Task(
    name=EXPLORE,
    draw=_draw,
    judge=lambda site, _truth, evidence: judge_coverage(site, evidence),
    needs_map=False,
)
