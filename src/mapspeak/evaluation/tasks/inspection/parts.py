"""Answers in parts, such as "/scan, 7.5 Hz": each part is of a kind, and right or wrong."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Self

from mapspeak.evaluation.scores import Evidence, no_answer, read_said
from mapspeak.evaluation.trials import Failure, Score
from mapspeak.ros.messages import bare_type

__all__ = ["InspectionPart", "PartKind", "judge_parts"]

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
        """Gives the part that `as_json` has written."""
        return cls(PartKind(written["kind"]), written["said"], written["tolerance"])

    def as_json(self) -> dict[str, Any]:
        """Gives it as plain values."""
        return {"kind": str(self.kind), "said": self.said, "tolerance": self.tolerance}

    def fits(self, said: str) -> bool:
        """True when something said is right."""
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
    """Judges an answer in parts: all have to be right, and no other may be there.

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
