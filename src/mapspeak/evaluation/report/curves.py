"""How the map grew with the metres driven, as far as the answers of the server told it."""

import re
from dataclasses import dataclass

import numpy as np

from mapspeak.evaluation.report.gathering import Course
from mapspeak.evaluation.trials import TrialResult, Turn

__all__ = ["Curve", "CurvePoint", "trace_coverage"]

EXPLORED = re.compile(r"^Explored: (\d{1,7}(?:\.\d+)?) m2 of free floor", re.MULTILINE)
LOOK = "look_at_map"
RATIO = "coverage_paper_ratio"


@dataclass(frozen=True, slots=True)
class CurvePoint:
    """Coverage at one moment.

    Attributes:
        driven_m: Metres driven by then.
        coverage_paper_ratio: Free area of the map over the free area of the building.
    """

    driven_m: float
    coverage_paper_ratio: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """The coverage of one trial over the metres it drove.

    Attributes:
        trial_id: Which trial.
        world: Where.
        agent: Who explored, with how much it may think where that was said.
        representation: How the map was shown.
        points: From the first look at the map to the end; the end alone where no answer told.
    """

    trial_id: str
    world: str
    agent: str
    representation: str
    points: tuple[CurvePoint, ...]


def trace_coverage(result: TrialResult, course: Course) -> Curve | None:
    """Gives a trial's coverage over its metres; None where it was not scored.

    The free area that each answer told is divided by that of the building, which follows from the
    score of the last map and that map's own free area.
    """
    ratio = result.score.figures.get(RATIO)
    if ratio is None:
        return None
    trial = result.trial
    return Curve(
        trial_id=trial.id,
        world=trial.world,
        agent=trial.answerer,
        representation=trial.representation,
        points=(
            *_looks(course, ratio, last_m=result.driven_m),
            CurvePoint(round(result.driven_m, 2), ratio),
        ),
    )


def _looks(course: Course, ratio: float, *, last_m: float) -> list[CurvePoint]:
    grid = course.grid
    if grid is None or not course.states or ratio <= 0:
        return []
    whole_m2 = float(grid.free.sum()) * grid.resolution_m**2 / ratio
    told = [(turn.robot_s, _explored_m2(turn)) for turn in course.turns]
    looks = [(time_s, area) for time_s, area in told if time_s is not None and area is not None]
    if not looks or whole_m2 <= 0:
        return []
    driven_m = np.interp(
        [time_s for time_s, _ in looks],
        [state.time_s for state in course.states],
        [state.driven_m for state in course.states],
    )
    return [
        CurvePoint(round(min(float(metres), last_m), 2), round(area / whole_m2, 4))
        for metres, (_, area) in zip(driven_m, looks, strict=True)
    ]


def _explored_m2(turn: Turn) -> float | None:
    """Reads the free area that an answer of the map told."""
    if turn.role != "tool" or turn.call is None or turn.call.tool != LOOK:
        return None
    found = EXPLORED.search(turn.text)
    return None if found is None else float(found[1])
