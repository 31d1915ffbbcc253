"""Questions about a ROS: how they are asked, answered in parts, and judged."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Self, TypeVar

import numpy as np

from mapspeak.evaluation.inspected import InspectedSystem, Names, draw_names, draw_system
from mapspeak.evaluation.scores import Evidence, GroundTruth, no_answer, read_said
from mapspeak.evaluation.tasks.task import dice
from mapspeak.evaluation.trials import Failure, Limits, Score, Setting
from mapspeak.ros.messages.fields import Dialect, bare_type
from mapspeak.spatial import OccupancyGrid

QUOTES = " \t'\"`*"
NUMBER = re.compile(r"([-+]?\d+(?:\.\d+)?)\s*(?:%|percent|Hz|m|s|seconds?|met(?:re|er)s?)?")
SIZE = re.compile(r"(\d+)\s*(?:x|\u00d7|by)\s*(\d+)(?:\s*cells)?")
LINK = re.compile(r"(\S+)\s*(?:->|\u2192|to)\s*(\S+)")


class PartKind(StrEnum):
    """How a part is compared."""

    NAME = "name"
    """Of a node, topic, service, parameter or field; a leading slash may be missing."""
    TYPE = "type"
    """In the words of either ROS."""
    WORD = "word"
    NUMBER = "number"
    """With a unit or none, to a tolerance."""
    SIZE = "size"
    """Two whole numbers, "384 x 320"."""
    LINK = "link"
    """Two frames, "map -> odom"."""


@dataclass(frozen=True, slots=True)
class InspectionPart:
    """One part of a right answer.

    Attributes:
        kind: How it is compared.
        said: As it is written.
        tolerance: How far a number may be off, in its own unit.
    """

    kind: PartKind
    said: str
    tolerance: float = 0.0

    @classmethod
    def of(cls, written: Mapping[str, Any]) -> Self:
        """Return the part that `as_json` has written."""
        return cls(PartKind(written["kind"]), written["said"], written["tolerance"])

    def as_json(self) -> dict[str, Any]:
        """Return it as plain values."""
        return {"kind": str(self.kind), "said": self.said, "tolerance": self.tolerance}

    def fits(self, said: str) -> bool:
        """Return True when something said is right."""
        match self.kind:
            case PartKind.NUMBER:
                return self._fits_number(said)
            case PartKind.SIZE | PartKind.LINK:
                pattern = SIZE if self.kind is PartKind.SIZE else LINK
                ours, theirs = pattern.fullmatch(self.said), pattern.fullmatch(said)
                return bool(ours and theirs and _bare(ours) == _bare(theirs))
            case PartKind.TYPE:
                return "/" in said and bare_type(said) == bare_type(self.said)
            case PartKind.WORD:
                return said.casefold() == self.said.casefold()
            case PartKind.NAME:
                return said.strip("/") == self.said.strip("/")

    def _fits_number(self, said: str) -> bool:
        ours, theirs = NUMBER.fullmatch(self.said), NUMBER.fullmatch(said)
        if ours is None or theirs is None:
            return said == self.said
        return abs(float(ours[1]) - float(theirs[1])) <= self.tolerance


def judge_parts(
    evidence: Evidence, truth: Sequence[InspectionPart], *, is_ordered: bool = True
) -> Score:
    """Judge an answer in parts: all have to be right, and no other may be there.

    Args:
        evidence: The answer is in it.
        truth: What is right.
        is_ordered: The order counts; else any will do.
    """
    said = read_said(evidence.answer)
    parts = [] if said is None else [each.strip(QUOTES) for each in said.split(",")]
    if not any(parts):
        return no_answer(evidence)
    n_right = _count_right(parts, truth, is_ordered=is_ordered)
    figures = {"n_right": float(n_right), "n_asked": float(len(truth))}
    reason = f"It said {said}; true is {', '.join(part.said for part in truth)}."
    if n_right == len(truth) == len(parts):
        return Score(is_success=True, figures=figures, reason=reason)
    return Score(is_success=False, failure=Failure.WRONG_ANSWER, figures=figures, reason=reason)


def _count_right(parts: Sequence[str], truth: Sequence[InspectionPart], *, is_ordered: bool) -> int:
    if is_ordered:
        return sum(part.fits(said) for part, said in zip(truth, parts, strict=False))
    return sum(any(part.fits(said) for said in parts) for part in truth)


def _bare(match: re.Match[str]) -> tuple[str, ...]:
    return tuple(each.strip("/") for each in match.groups())


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
        """Draw the robot's ROS, what is out of order in it, and the question."""
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
        """Score the answer by the description of the system."""
        del site
        parts = [InspectionPart.of(each) for each in setting.truth["parts"]]
        return judge_parts(evidence, parts, is_ordered=setting.truth["is_ordered"])


def one_of(random: np.random.Generator, items: Sequence[Item]) -> Item:
    """Draw one of some items."""
    return items[int(random.integers(len(items)))]


def shuffled(random: np.random.Generator, items: Sequence[Item]) -> list[Item]:
    """Return all of some items in a drawn order."""
    return [items[at] for at in random.permutation(len(items)).tolist()]


def _draw_case(task: str, site: GroundTruth, seed: int) -> Case:
    random = dice(task, site, seed)
    grid = _coarsen(site.floor.visible, one_of(random, COARSENINGS))
    names = draw_names(random)
    dialect = Dialect.ROS1 if seed % 2 else Dialect.ROS2
    system = draw_system(random, names, grid, dialect=dialect)
    return Case(random=random, names=names, system=system, grid=grid)


def _coarsen(grid: OccupancyGrid, factor: int) -> OccupancyGrid:
    """Return a map in cells so many times as wide; a cell holds the worst that was in it."""
    n_rows, n_cols = grid.n_rows // factor, grid.n_cols // factor
    blocks = grid.cells[: n_rows * factor, : n_cols * factor]
    return OccupancyGrid(
        cells=blocks.reshape(n_rows, factor, n_cols, factor).max(axis=(1, 3)),
        resolution_m=round(grid.resolution_m * factor, 4),
        origin=grid.origin,
    )
