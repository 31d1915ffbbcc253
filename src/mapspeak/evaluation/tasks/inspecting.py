"""Questions about a ROS: how they are asked, answered in parts, and judged."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from string import Template
from typing import Any

from ruamel.yaml import YAML

from mapspeak.evaluation.inspected.drawing import Names, draw_names, draw_system
from mapspeak.evaluation.inspected.playing import InspectedSystem
from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.scores.judging import Evidence, no_answer, read_said, verdict
from mapspeak.evaluation.tasks.task import NO_DRIVING, Draw, Task, Truth
from mapspeak.evaluation.trials import Failure, Limits, Score, Setting
from mapspeak.ros.messages.fields import Dialect
from mapspeak.spatial import OccupancyGrid

QUOTES = " \t'\"`*"
NUMBER = re.compile(r"([-+]?\d+(?:\.\d+)?)\s*(?:%|percent|Hz|m|s|seconds?|met(?:re|er)s?)?")
SIZE = re.compile(r"(\d+)\s*(?:x|\u00d7|by)\s*(\d+)(?:\s*cells)?")
LINK = re.compile(r"(\S+)\s*(?:->|\u2192|\bto\b)\s*(\S+)")
KIND = re.compile(r"/(?:msg|srv|action)/")


@dataclass(frozen=True, slots=True)
class AnswerPart:
    """One part of a right answer: a name, a type, a word, a size, a link or a number.

    Attributes:
        tolerance: Tolerance of a number, in its own unit; None if it is not a number.
    """

    said: str
    tolerance: float | None = None

    def fits(self, said: str) -> bool:
        """Return True when something said is right."""
        if self.tolerance is None:
            return _plain(said) == _plain(self.said)
        ours, theirs = NUMBER.fullmatch(self.said), NUMBER.fullmatch(said)
        if ours is None or theirs is None:
            return False
        return abs(float(ours[1]) - float(theirs[1])) <= self.tolerance


def _plain(said: str) -> list[str]:
    """Return words without what may be written in several ways.

    Leading slashes of names may be missing, types are written as either ROS does, and a size and a
    link are two words with a sign between them.
    """
    text = KIND.sub("/", SIZE.sub(r"\1 \2", LINK.sub(r"\1 \2", said.casefold())))
    return [word.strip("/") for word in text.split()]


def judge_parts(
    evidence: Evidence, truth: Sequence[AnswerPart], *, is_ordered: bool = True
) -> Score:
    """Judge an answer in parts: all have to be right, and no other may be there."""
    said = read_said(evidence.answer)
    parts = [] if said is None else [each.strip(QUOTES) for each in said.split(",")]
    if not any(parts):
        return no_answer(evidence)
    pairs = zip(truth, parts, strict=False)
    n_right = (
        sum(part.fits(each) for part, each in pairs)
        if is_ordered
        else sum(any(part.fits(each) for each in parts) for part in truth)
    )
    figures = {"n_right": float(n_right), "n_asked": float(len(truth))}
    reason = f"It said {said}; true is {', '.join(part.said for part in truth)}."
    is_right = n_right == len(truth) == len(parts)
    return verdict(reason, figures, failure=None if is_right else Failure.WRONG_ANSWER)


LIMITS = Limits(n_calls=60, robot_time_s=600.0, wall_s=600.0)
OPENING = (
    "Inspect the robot's ROS. "
    "The node /rosbridge_websocket, through which you look, does not count."
)
COARSENINGS = (1, 2, 3, 4)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A robot as drawn, without faults, and the name of the question's subject."""

    name: str
    draw: Draw
    names: Names
    system: InspectedSystem
    grid: OccupancyGrid

    def ask(
        self,
        *parts: AnswerPart,
        system: InspectedSystem | None = None,
        is_ordered: bool = True,
        **told: object,
    ) -> Setting:
        """Return the setting of the question.

        Args:
            parts: Of the right answer.
            system: With a fault; None for the one in good order.
            told: What the question has drawn, by the names in its text.
        """
        question = _read_questions()[self.name]
        text = Template(question["ask"]).substitute(vars(self.names), **told)
        form = question["form"]
        return Setting(
            prompt=f"{OPENING} {text} {NO_DRIVING} End with a line of the form ANSWER: {form}.",
            start=self.draw.site.world.start,
            is_known=False,
            toolsets=("ros",),
            limits=LIMITS,
            inspected=system or self.system,
            truth={
                "said": ", ".join(part.said for part in parts),
                "parts": parts,
                "is_ordered": is_ordered,
            },
        )


@cache
def _read_questions() -> dict[str, Any]:
    text = resources.files(__package__).joinpath("inspections.yaml").read_text(encoding="utf-8")
    return dict(YAML(typ="safe", pure=True).load(text))


def inspection_task(name: str, ask: Callable[[Case], Setting]) -> Task:
    """Return the task of answering a question by what the robot's ROS says.

    Nothing is simulated but the ROS. The world gives the map that the robot carries, so that it
    needs no exploration. Trials with an odd seed are of ROS 1, those with an even one of ROS 2.
    """

    def draw(draw: Draw) -> Setting:
        grid = _coarsen(draw.site.floor.visible, draw.one_of(COARSENINGS))
        names = draw_names(draw.random)
        dialect = Dialect.ROS1 if draw.seed % 2 else Dialect.ROS2
        system = draw_system(draw.random, names, grid, dialect=dialect)
        return ask(Case(name=name, draw=draw, names=names, system=system, grid=grid))

    return Task(name=f"inspect-{name}", draw=draw, judge=_judge, needs_map=False)


def _judge(_site: GroundTruth, truth: Truth, evidence: Evidence) -> Score:
    return judge_parts(evidence, truth["parts"], is_ordered=truth["is_ordered"])


def _coarsen(grid: OccupancyGrid, factor: int) -> OccupancyGrid:
    """Return a map with cells a factor wider; each holds the highest value within it."""
    n_rows, n_cols = grid.n_rows // factor, grid.n_cols // factor
    blocks = grid.cells[: n_rows * factor, : n_cols * factor]
    return OccupancyGrid(
        cells=blocks.reshape(n_rows, factor, n_cols, factor).max(axis=(1, 3)),
        resolution_m=round(grid.resolution_m * factor, 4),
        origin=grid.origin,
    )
