"""The paper's Task 1; its Tasks 2 and 3 are one room and one object among others.

The prompts are those of its Table "User prompts for each evaluation task", word for word, and the
guidance is the prompt of its appendix with the semantic filtering policy.
"""

from dataclasses import dataclass

from mapspeak.evaluation.scores import Evidence, GroundTruth, judge_coverage
from mapspeak.evaluation.trials import Limits, Score, Setting
from mapspeak.server.prompts import read_text

EXPLORE = "explore"
LIMITS = Limits(n_calls=1000, robot_time_s=3600.0, wall_s=900.0)


@dataclass(frozen=True, slots=True)
class Explore:
    """Task 1: the robot maps a building it has never seen and remembers what stands there."""

    name: str = EXPLORE
    needs_map: bool = False

    def is_offered(self, site: GroundTruth) -> bool:
        """Every world can be explored."""
        del site
        return True

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Start where the world says, so that others can go on with this map."""
        del seed, memory
        return Setting(
            prompt="Update the map while moving.",
            guidance=f"{read_text('exploration')}\n\n{read_text('semantic_policy')}",
            start=site.world.start,
            is_known=False,
            tools=("explore",),
            limits=LIMITS,
        )

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Score map and memory."""
        del setting
        return judge_coverage(site, evidence)
