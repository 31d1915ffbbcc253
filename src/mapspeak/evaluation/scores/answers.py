"""What is left of a trial to be judged by, and answers in a strict form: a line with "ANSWER:"."""

import re
from collections.abc import Collection
from dataclasses import dataclass

from mapspeak.evaluation.trials import Failure, Score, ToolCall, TrialState
from mapspeak.geometry import Point
from mapspeak.simulator import StateRecord
from mapspeak.spatial import OccupancyGrid

NOWHERE = StateRecord(
    time_s=0.0, x=0.0, y=0.0, yaw_rad=0.0, slam_error_m=0.0, driven_m=0.0, n_collisions=0
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Evidence:
    """How a trial truly went.

    Attributes:
        states: The simulator's truth from begin to end; poses in a map without errors.
        grid: The robot's map in the end; None where there is none.
        memory: The semantic map in the end, as YAML; None where there is none.
    """

    states: tuple[StateRecord, ...]
    grid: OccupancyGrid | None = None
    memory: str | None = None
    answer: str = ""
    state: TrialState = TrialState.FINISHED
    calls: tuple[ToolCall, ...] = ()
    n_errors: int = 0

    @property
    def last(self) -> StateRecord:
        """How the simulation stood in the end."""
        return self.states[-1] if self.states else NOWHERE

    @property
    def end(self) -> Point:
        """Where the robot truly stood in the end, in the map frame."""
        return self.last.pose.point


LINE = re.compile(r"^\W*ANSWER\s*:\s*(?P<said>.*?)\W*$", re.IGNORECASE | re.MULTILINE)
NUMBER = r"[-+]?\d+(?:\.\d+)?"
UNITS = {"m2": r"(?:m2|m²|m\^2|sq\.? ?m|square met(?:re|er)s)", "m": r"(?:m|met(?:re|er)s)", "": ""}


def read_number(text: str, unit: str = "") -> float | None:
    """Read a number with its unit, "m", "m2" or none; None where the form is not kept."""
    said = read_said(text)
    match = re.fullmatch(rf"(?P<number>{NUMBER})\s*{UNITS[unit]}", said or "", re.IGNORECASE)
    return float(match["number"]) if match else None


def read_letters(text: str) -> frozenset[str] | None:
    """Read letters such as "A, C", or "none"; None where the form is not kept."""
    said = read_said(text)
    if said is None:
        return None
    if said.lower() == "none":
        return frozenset()
    parts = [part for part in re.split(r"[\s,;]+|\band\b", said) if part]
    is_right = all(re.fullmatch(r"[A-Z]", part) for part in parts)
    return frozenset(parts) if parts and is_right else None


def read_point(text: str) -> Point | None:
    """Read two coordinates, "1.5, -2"; None where the form is not kept."""
    said = read_said(text) or ""
    match = re.fullmatch(rf"\(?({NUMBER})\s*(?:m)?\s*,\s*({NUMBER})\s*(?:m)?", said.rstrip(")"))
    return Point(float(match[1]), float(match[2])) if match else None


def read_word(text: str, words: Collection[str]) -> str | None:
    """Read one of some words, whatever its case; None where the form is not kept."""
    said = (read_said(text) or "").casefold()
    return next((word for word in words if word.casefold() == said), None)


def judge_number(evidence: Evidence, truth: float, *, unit: str, tolerance: float) -> Score:
    """Judge a number by how far it is off, in its own unit."""
    said = read_number(evidence.answer, unit)
    if said is None:
        return no_answer(evidence)
    figures = {"off": round(abs(said - truth), 3), "truth": round(truth, 3)}
    reason = f"It said {said:g} {unit}, true are {truth:.2f} {unit}.".replace(" .", ".")
    is_right = abs(said - truth) <= tolerance
    return verdict(reason, figures, failure=None if is_right else Failure.WRONG_ANSWER)


def judge_choice(evidence: Evidence, truth: Collection[str]) -> Score:
    """Judge a choice of letters: all right ones and no other."""
    said = read_letters(evidence.answer)
    if said is None:
        return no_answer(evidence)
    wrong = len(said ^ set(truth))
    reason = f"It said {_listed(said)}, true is {_listed(truth)}."
    failure = Failure.WRONG_ANSWER if wrong else None
    return verdict(reason, {"n_wrong": float(wrong)}, failure=failure)


def _listed(letters: Collection[str]) -> str:
    return ", ".join(sorted(letters)) or "none"


def no_answer(evidence: Evidence) -> Score:
    """Return the score of a trial that ended without an answer in the form asked for."""
    gave_up = evidence.state is TrialState.GAVE_UP
    reason = "There is no answer in the form that was asked for."
    return verdict(reason, {}, failure=Failure.GAVE_UP if gave_up else Failure.NO_ANSWER)


def verdict(reason: str, figures: dict[str, float], *, failure: Failure | None = None) -> Score:
    """Return a score: a success unless a failure is named."""
    return Score(is_success=failure is None, failure=failure, figures=figures, reason=reason)


def read_said(text: str) -> str | None:
    """Read what the last line of the form says; None where there is none."""
    lines = [match["said"].strip() for match in LINE.finditer(text)]
    return lines[-1] if lines else None
