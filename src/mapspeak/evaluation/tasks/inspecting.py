"""Questions about a ROS: how they are asked, answered in parts, and judged."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.evaluation.inspected.drawing import Names, draw_names, draw_system
from mapspeak.evaluation.inspected.playing import InspectedSystem
from mapspeak.evaluation.scores.judging import Evidence, no_answer, read_said, verdict
from mapspeak.evaluation.scores.site import GroundTruth
from mapspeak.evaluation.tasks.task import NO_DRIVING, Draw, Task, Truth
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
        tolerance: How far a number may be off, in its own unit.
    """

    kind: PartKind
    said: str
    tolerance: float = 0.0

    def fits(self, said: str) -> bool:
        """Return True when something said is right."""
        match self.kind:
            case PartKind.NUMBER:
                numbers = NUMBER.fullmatch(self.said), NUMBER.fullmatch(said)
                if numbers[0] is None or numbers[1] is None:
                    return said == self.said
                return abs(float(numbers[0][1]) - float(numbers[1][1])) <= self.tolerance
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


def judge_parts(
    evidence: Evidence, truth: Sequence[InspectionPart], *, is_ordered: bool = True
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


def _bare(match: re.Match[str]) -> tuple[str, ...]:
    return tuple(each.strip("/") for each in match.groups())


LIMITS = Limits(n_calls=60, robot_time_s=600.0, wall_s=600.0)
OPENING = (
    "Inspect the robot's ROS. "
    "The node /rosbridge_websocket, through which you look, does not count."
)
COARSENINGS = (1, 2, 3, 4)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A robot as it was drawn, in good order."""

    draw: Draw
    names: Names
    system: InspectedSystem
    grid: OccupancyGrid

    def ask(
        self,
        text: str,
        form: str,
        parts: tuple[InspectionPart, ...],
        system: InspectedSystem | None = None,
        *,
        is_ordered: bool = True,
    ) -> Setting:
        """Return the setting of a question.

        Args:
            form: How the answer is to be written, with an example; after "ANSWER: ".
        """
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


def inspection_task(name: str, ask: Callable[[Case], Setting]) -> Task:
    """Return the task of answering a question by what the robot's ROS says.

    Nothing is simulated but the ROS. The world gives the map that the robot carries, so that it
    needs no exploration. Trials with an odd seed are of ROS 1, those with an even one of ROS 2.
    """
    return Task(name=name, draw=lambda draw: ask(_draw_case(draw)), judge=_judge, needs_map=False)


def _judge(_site: GroundTruth, truth: Truth, evidence: Evidence) -> Score:
    return judge_parts(evidence, truth["parts"], is_ordered=truth["is_ordered"])


def _draw_case(draw: Draw) -> Case:
    grid = _coarsen(draw.site.floor.visible, draw.one_of(COARSENINGS))
    names = draw_names(draw.random)
    dialect = Dialect.ROS1 if draw.seed % 2 else Dialect.ROS2
    system = draw_system(draw.random, names, grid, dialect=dialect)
    return Case(draw=draw, names=names, system=system, grid=grid)


def _coarsen(grid: OccupancyGrid, factor: int) -> OccupancyGrid:
    """Return a map in cells so many times as wide; a cell holds the worst that was in it."""
    n_rows, n_cols = grid.n_rows // factor, grid.n_cols // factor
    blocks = grid.cells[: n_rows * factor, : n_cols * factor]
    return OccupancyGrid(
        cells=blocks.reshape(n_rows, factor, n_cols, factor).max(axis=(1, 3)),
        resolution_m=round(grid.resolution_m * factor, 4),
        origin=grid.origin,
    )
