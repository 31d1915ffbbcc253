"""The shortest way past several stops in order, where a stop may mean several places.

Dynamic programming over (stop, candidate): the best way to each candidate of a stop is the least,
over the candidates of the stop before, of the best way there and the path from there.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mapspeak.driving.routes.candidates import Candidate, find_candidates
from mapspeak.errors import GoalError
from mapspeak.geometry import Point
from mapspeak.spatial.paths import DistanceField
from mapspeak.worldmodel.model import Atlas

__all__ = ["MOST_STOPS", "RoutePlan", "plan_among", "plan_route"]

MOST_STOPS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class RoutePlan:
    """A route as a whole.

    Attributes:
        stops: The words for each stop, in their order.
        chosen: What each of them is taken for.
        n_candidates: Among how many.
        legs_m: The path to each from the one before, the first from the robot.
        greedy_m: The whole length if the nearest candidate were taken each time.
    """

    stops: tuple[str, ...]
    chosen: tuple[Candidate, ...]
    n_candidates: tuple[int, ...]
    legs_m: tuple[float, ...]
    greedy_m: float

    @property
    def total_m(self) -> float:
        """The whole length by path."""
        return math.fsum(self.legs_m)


def plan_route(atlas: Atlas, stops: Sequence[str]) -> RoutePlan:
    """Plans a route past stops in their order, each an id, a name, "x, y" or other words.

    Raises:
        GoalError: There are no stops or too many, one means nothing that can be reached, or no way
            leads from one to the next.
    """
    if not 1 <= len(stops) <= MOST_STOPS:
        raise GoalError(
            f"A route has 1 to {MOST_STOPS} stops; this one has {len(stops)}.",
            hint="Give the stops in order, as ids, names or phrases.",
        )
    return plan_among(
        atlas, stops, [_find(atlas, number, stop) for number, stop in enumerate(stops)]
    )


def _find(atlas: Atlas, number: int, stop: str) -> tuple[Candidate, ...]:
    try:
        return find_candidates(atlas, stop)
    except GoalError as error:
        raise GoalError(f"Stop {number + 1}: {error.message}", hint=error.hint) from error


def plan_among(
    atlas: Atlas, stops: Sequence[str], choices: Sequence[tuple[Candidate, ...]]
) -> RoutePlan:
    """Plans a route past stops whose candidates are known.

    Raises:
        GoalError: No way leads from one stop to the next.
    """
    legs_m = _Legs(atlas)
    best: list[tuple[float, tuple[Candidate, ...]]] = [(0.0, ())]
    for number, candidates in enumerate(choices):
        best = [
            min(
                ((spent_m + legs_m.between(way, each), (*way, each)) for spent_m, way in best),
                key=lambda found: found[0],
            )
            for each in candidates
        ]
        if all(math.isinf(spent_m) for spent_m, _ in best):
            raise GoalError(
                f"No way leads from stop {number} to stop {number + 1}, {stops[number]}.",
                hint="Call measure between the two, and leave one of them out.",
            )
    _, chosen = min(best, key=lambda found: found[0])
    return RoutePlan(
        stops=tuple(stops),
        chosen=chosen,
        n_candidates=tuple(len(candidates) for candidates in choices),
        legs_m=legs_m.along(chosen),
        greedy_m=math.fsum(legs_m.along(_choose_greedily(legs_m, choices))),
    )


def _choose_greedily(
    legs_m: "_Legs", choices: Sequence[tuple[Candidate, ...]]
) -> tuple[Candidate, ...]:
    way: tuple[Candidate, ...] = ()
    for candidates in choices:
        here = way
        way = (*way, min(candidates, key=lambda each: legs_m.between(here, each)))
    return way


class _Legs:
    """Path lengths on one map; each field of distances is computed once."""

    def __init__(self, atlas: Atlas) -> None:
        self._atlas = atlas
        self._fields: dict[Point, DistanceField] = {}

    def between(self, way: tuple[Candidate, ...], goal: Candidate) -> float:
        """Gives the metres from the end of a way, the robot where it is empty, to a candidate."""
        found_m = self._field(way).distance_to(goal.pose.point)
        return math.inf if found_m is None else found_m

    def along(self, way: tuple[Candidate, ...]) -> tuple[float, ...]:
        """Gives the metres of each leg."""
        return tuple(self.between(way[:n], each) for n, each in enumerate(way))

    def _field(self, way: tuple[Candidate, ...]) -> DistanceField:
        if not way:
            return self._atlas.distances
        start = way[-1].pose.point
        if start not in self._fields:
            self._fields[start] = self._atlas.distances.from_elsewhere(start)
        return self._fields[start]
