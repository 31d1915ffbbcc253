"""A task: draws a question for a world, and scores the answer."""

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.scores.judging import Evidence
from mapspeak.evaluation.trials import Failure, Limits, Score, Setting, TrialState
from mapspeak.geometry import Point, Pose
from mapspeak.simulator import WorldObject
from mapspeak.spatial.grid import Mask

Truth = Mapping[str, Any]
NO_DRIVING = "Answer without driving."

_Item = TypeVar("_Item")


@dataclass(frozen=True, slots=True)
class Draw:
    """Inputs for drawing a trial's setting.

    Attributes:
        random: For all draws; different for each task, world and seed.
        memory: The semantic map from an exploration of the world, as YAML.
    """

    site: GroundTruth
    random: np.random.Generator
    seed: int
    memory: str | None

    def one_of(self, items: Sequence[_Item]) -> _Item:
        """Draw one of some items."""
        return items[int(self.random.integers(len(items)))]

    def shuffled(self, items: Sequence[_Item]) -> list[_Item]:
        """Return all of some items in a drawn order."""
        return [items[at] for at in self.random.permutation(len(items)).tolist()]

    def start(self, *, without: Mask | None = None) -> Pose:
        """Draw where the robot starts, in the map frame: where there is room, not in some cells."""
        elsewhere = None if without is None else ~without
        is_left = elsewhere is not None and bool((self.site.roomy & elsewhere).any())
        return self.site.draw_pose(self.random, elsewhere if is_left else None)

    def shortest_m(self, start: Pose, right: Mask) -> float:
        """Return the way to the nearest of some cells, in the format of the truth."""
        return round(self.site.shortest_to_any_m(start.point, right), 3)

    def setting(
        self,
        prompt: str,
        start: Pose,
        truth: Truth,
        *,
        is_known: bool = True,
        tools: tuple[str, ...] = (),
        limits: Limits | None = None,
        added: tuple[WorldObject, ...] = (),
    ) -> Setting:
        """Return a setting whose start is given in the map frame; memory comes with the map."""
        return Setting(
            prompt=prompt,
            start=self.site.in_world(start),
            is_known=is_known,
            memory=self.memory if is_known else None,
            added=added,
            tools=tools,
            limits=limits or Limits(),
            truth=dict(truth),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """A kind of question; the same world, seed and memory give the same setting.

    Attributes:
        judge: Scores a trial by the truth of its setting and of the world with what was added.
        is_offered: True for worlds that have what it asks about.
        needs_map: It starts from the map and memory of an exploration.
    """

    name: str
    draw: Callable[[Draw], Setting]
    judge: Callable[[GroundTruth, Truth, Evidence], Score]
    is_offered: Callable[[GroundTruth], bool] = lambda _site: True
    needs_map: bool = True

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Draw one trial's setting from a seed."""
        names = (zlib.crc32(text.encode()) for text in (self.name, site.world.name))
        return self.draw(Draw(site, np.random.default_rng([seed, *names]), seed, memory))

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Score a trial by the truth of the world as it was set: with what was added to it.

        A trial that is out of budget is no success, wherever its robot stands.
        """
        score = self.judge(site, setting.truth, evidence)
        if score.is_success and evidence.state is TrialState.OUT_OF_BUDGET:
            reason = f"It was out of budget. {score.reason}"
            return replace(score, is_success=False, failure=Failure.INCOMPLETE, reason=reason)
        return score


def point_text(point: Point) -> str:
    """Return a point as prompts and answers write it."""
    return f"({point.x:.2f}, {point.y:.2f})"


def pair(point: Point) -> list[float]:
    """Return a point in the format of the truth."""
    return [round(point.x, 2), round(point.y, 2)]
