"""What the model thinks of where the thing may be: of places by their ids, and of views."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from mapspeak.geometry import Point

__all__ = ["NEUTRAL", "Opinions", "weight_of"]

NEUTRAL = 0.5
"""The score of a place of which nobody thinks anything."""
STRENGTH = 4.0
"""A place that is sure to have the thing weighs so many times more than a neutral one."""
REACH_M = 5.0
"""A view says something about what lies this near to the middle of it."""
VIEW_STRENGTH = 2.0
"""What the model says of a view counts so many times as much as that nobody knows."""
COMPANY_STRENGTH = 1.0
"""What stands at a place counts less: nobody has looked at it with the thing in mind."""
COMPANY_APART_M = 1.5
"""The same score this near to an earlier one is of the same company."""


@dataclass(frozen=True, slots=True)
class _ViewOpinion:
    point: Point
    score: float
    strength: float


class Opinions:
    """Scores between 0 (surely not there) and 1 (surely there)."""

    def __init__(self) -> None:
        self._by_id: dict[str, float] = {}
        self._views: list[_ViewOpinion] = []
        self._company: list[_ViewOpinion] = []

    @property
    def speaks_of_rooms(self) -> bool:
        """True when a room or corridor has a score."""
        return any(key.startswith(("R", "C")) for key in self._by_id)

    def add_scores(self, scores: Mapping[str, float]) -> None:
        """Takes in scores of places by their ids; newer ones replace older ones."""
        self._by_id |= {key.strip().upper(): score for key, score in scores.items()}

    def add_view(self, point: Point, score: float) -> None:
        """Takes in how likely the thing is near what a picture showed."""
        self._views.append(_ViewOpinion(point, score, VIEW_STRENGTH))

    def add_company(self, point: Point, score: float) -> bool:
        """Takes in how likely the thing is near another one; gives False where that is no news."""
        for known in self._company:
            if known.score == score and known.point.distance_to(point) <= COMPANY_APART_M:
                return False
        self._company.append(_ViewOpinion(point, score, COMPANY_STRENGTH))
        return True

    def score_at(self, point: Point, *, ids: tuple[str, ...]) -> float:
        """Gives the score of a place: by its own id, its room's id, else by views near it."""
        for place_id in ids:
            if place_id in self._by_id:
                return self._by_id[place_id]
        total, n = NEUTRAL, 1.0
        for view in (*self._views, *self._company):
            nearness = max(1.0 - view.point.distance_to(point) / REACH_M, 0.0)
            weight = view.strength * nearness
            total, n = total + weight * view.score, n + weight
        return total / n


def weight_of(score: float) -> float:
    """Gives by how much a score makes a place more worth a look, 1 for a neutral one."""
    return math.pow(STRENGTH, 2 * score - 1)
