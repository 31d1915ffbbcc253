"""Ordered routes: several things, one after the other."""

from dataclasses import dataclass

from mapspeak.evaluation.scores import BESIDE_M, Evidence, GroundTruth, judge_route
from mapspeak.evaluation.tasks.objects import findable_kinds
from mapspeak.evaluation.tasks.task import dice, draw_start
from mapspeak.evaluation.trials import Limits, Score, Setting

__all__ = ["RouteTask"]

MOST_STOPS = 4
LEAST_STOPS = 2
LIMITS = Limits(n_calls=80, robot_time_s=1800.0, wall_s=900.0)


@dataclass(frozen=True, slots=True)
class RouteTask:
    """The robot goes to several things in the order that is given; any thing of a kind will do."""

    name: str = "route"
    needs_map: bool = True

    def is_offered(self, site: GroundTruth) -> bool:
        """True where the world has things of two kinds to go to."""
        return len(findable_kinds(site)) >= LEAST_STOPS

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Draws the kinds and their order."""
        random = dice(self.name, site, seed)
        kinds = findable_kinds(site)
        most = min(MOST_STOPS, len(kinds))
        n_stops = int(random.integers(LEAST_STOPS, most + 1))
        chosen = [str(kind) for kind in random.choice(kinds, size=n_stops, replace=False)]
        start = draw_start(site, random, without=site.beside(chosen[0]))
        first, *others = (f"any {site.label_of(kind)}" for kind in chosen)
        steps = ", then ".join((f"first to {first}", *(f"to {other}" for other in others)))
        return Setting(
            prompt=f"Go {steps}. Keep to this order and stop at each, at most {BESIDE_M:g} m from "
            "it with a free view of it. Stay at the last one.",
            start=site.in_world(start),
            is_known=True,
            memory=memory,
            tools=("follow_route",),
            limits=LIMITS,
            truth={"kinds": chosen},
        )

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Scores the way that was driven."""
        return judge_route(site, evidence, [site.things(kind) for kind in setting.truth["kinds"]])
