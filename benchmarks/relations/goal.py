"""A goal of the benchmark: words, and which poses they may mean."""

import math
from dataclasses import dataclass
from enum import StrEnum

from benchmarks.relations.truth import Fit
from mapspeak.geometry import Point

__all__ = ["COMPASS", "Expected", "Goal"]

COMPASS = {"north": math.pi / 2, "east": 0.0, "south": -math.pi / 2, "west": math.pi}


class Expected(StrEnum):
    """What an answer should be."""

    PLACE = "a place, or a refusal where nothing fits"
    ASKED = "a question back"
    REFUSED = "a refusal"
    THING = "a thing by its id"


@dataclass(frozen=True, kw_only=True)
class Goal:
    """Words and what they may mean.

    Attributes:
        words: What somebody says.
        fits: Which places would do.
        looks_at: What the robot should face there; None where that does not matter.
        expected: What the answer should be.
        says: Words that an answer or a hint must have.
    """

    words: str
    fits: Fit | None = None
    looks_at: Point | None = None
    expected: Expected = Expected.PLACE
    says: tuple[str, ...] = ()
