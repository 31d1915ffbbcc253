"""What a question about a robot's ROS is made of: the robot it is asked of, and the answer."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from mapspeak.evaluation.inspected import InspectedSystem, Names, draw_names, draw_system
from mapspeak.evaluation.scores import Evidence, GroundTruth
from mapspeak.evaluation.tasks.inspection.parts import InspectionPart, judge_parts
from mapspeak.evaluation.tasks.task import dice
from mapspeak.evaluation.trials import Limits, Score, Setting
from mapspeak.ros.messages import Dialect
from mapspeak.spatial import OccupancyGrid

__all__ = ["Ask", "AskedInspection", "Case", "InspectionTask", "one_of", "shuffled"]

LIMITS = Limits(n_calls=60, robot_time_s=600.0, wall_s=600.0)
OPENING = (
    "Inspect the robot's ROS. "
    "The node /rosbridge_websocket, through which you look, does not count."
)
NO_DRIVING = "Answer without driving."
COARSENINGS = (1, 2, 3, 4)

Item = TypeVar("Item")


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A robot as it was drawn, in good order.

    Attributes:
        random: Of all further draws.
        names: What its parts are called.
        system: Its ROS.
        grid: The map that it carries.
    """

    random: np.random.Generator
    names: Names
    system: InspectedSystem
    grid: OccupancyGrid


@dataclass(frozen=True, slots=True, kw_only=True)
class AskedInspection:
    """A question as it was drawn.

    Attributes:
        text: The question.
        form: How the answer is to be written, with an example; after "ANSWER: ".
        parts: The right answer.
        system: The ROS that it is asked of, with what is out of order.
        is_ordered: The order of the parts counts.
    """

    text: str
    form: str
    parts: tuple[InspectionPart, ...]
    system: InspectedSystem
    is_ordered: bool = True


Ask = Callable[[Case], AskedInspection]


@dataclass(frozen=True, slots=True)
class InspectionTask:
    """The agent reads what the robot's ROS says and answers; nothing is simulated but the ROS.

    The world gives the map that the robot carries, so that it needs no exploration. Trials with an
    odd seed are of ROS 1, those with an even one of ROS 2.

    Attributes:
        name: Of the task.
        ask: Draws the question.
        needs_map: Never.
    """

    name: str
    ask: Ask
    needs_map: bool = False

    def is_offered(self, site: GroundTruth) -> bool:
        """Every world has a map."""
        del site
        return True

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Draws the robot's ROS, what is out of order in it, and the question."""
        del memory
        asked = self.ask(_draw_case(self.name, site, seed))
        said = ", ".join(part.said for part in asked.parts)
        form = f"End with a line of the form ANSWER: {asked.form}."
        return Setting(
            prompt=f"{OPENING} {asked.text} {NO_DRIVING} {form}",
            start=site.world.start,
            is_known=False,
            toolsets=("ros",),
            limits=LIMITS,
            inspected=asked.system,
            truth={
                "said": said,
                "parts": [part.as_json() for part in asked.parts],
                "is_ordered": asked.is_ordered,
            },
        )

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Scores the answer by the description of the system."""
        del site
        parts = [InspectionPart.of(each) for each in setting.truth["parts"]]
        return judge_parts(evidence, parts, is_ordered=setting.truth["is_ordered"])


def one_of(random: np.random.Generator, items: Sequence[Item]) -> Item:
    """Draws one of some items."""
    return items[int(random.integers(len(items)))]


def shuffled(random: np.random.Generator, items: Sequence[Item]) -> list[Item]:
    """Gives all of some items in a drawn order."""
    return [items[at] for at in random.permutation(len(items)).tolist()]


def _draw_case(task: str, site: GroundTruth, seed: int) -> Case:
    random = dice(task, site, seed)
    grid = _coarsen(site.floor.visible, one_of(random, COARSENINGS))
    names = draw_names(random)
    dialect = Dialect.ROS1 if seed % 2 else Dialect.ROS2
    system = draw_system(random, names, grid, dialect=dialect)
    return Case(random=random, names=names, system=system, grid=grid)


def _coarsen(grid: OccupancyGrid, factor: int) -> OccupancyGrid:
    """Gives a map in cells so many times as wide; a cell holds the worst that was in it."""
    n_rows, n_cols = grid.n_rows // factor, grid.n_cols // factor
    blocks = grid.cells[: n_rows * factor, : n_cols * factor]
    return OccupancyGrid(
        cells=blocks.reshape(n_rows, factor, n_cols, factor).max(axis=(1, 3)),
        resolution_m=round(grid.resolution_m * factor, 4),
        origin=grid.origin,
    )
