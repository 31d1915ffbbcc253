"""The shortest way past several stops in order, where a stop may mean several places."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.errors import GoalError, NextStep
from mapspeak.geometry import Point
from mapspeak.places.goalcheck import GoalCheck, say_refusal
from mapspeak.places.naming import AmbiguousPlaceError, Place
from mapspeak.places.relations.choosing import CheckedGoal, check_place, find_place
from mapspeak.places.relations.grammar import Nearest, parse_relation
from mapspeak.places.relations.proximity import find_all_near
from mapspeak.robot import GoalStatus
from mapspeak.spatial.paths import DistanceField
from mapspeak.worldmodel.model import WorldModel

MOST_CANDIDATES = 12
LEAST_SAID_RATIO = 0.75
"""Of words that are no name, so much must be said of what they are taken for."""
SAME_SAID_RATIO = 0.9
"""What says so nearly as much of them as the best may be meant too."""


def find_candidates(world: WorldModel, words: str) -> tuple[CheckedGoal, ...]:
    """Find all that words may mean and the robot can get to.

    Raises:
        GoalError: They mean nothing, or nothing that can be reached.
    """
    goals = [check_place(world, place) for place in _find_places(world, words)]
    good = [goal for goal in goals if goal.check.is_ok]
    if not good:
        raise GoalError(
            say_refusal(goals[0].name, goals[0].check),
            hint="Leave this stop out.",
            step=NextStep.CHECK_NEAR,
        )
    unique = {goal.pose.point: goal for goal in reversed(good)}
    return tuple(reversed(unique.values()))[:MOST_CANDIDATES]


def _find_places(world: WorldModel, words: str) -> list[Place]:
    """Find what words mean; "the nearest door" is nearest on the route, so any door may be it."""
    relation = parse_relation(words)
    if isinstance(relation, Nearest) and relation.to is None:
        near = find_all_near(world, relation.kind)
        if near:
            return list(near)
    try:
        return [find_place(world, words)]
    except AmbiguousPlaceError as error:
        found = list(_find_meanings(world, words, error))
        if found:
            return found
        raise
    except GoalError:
        remembered = list(_find_remembered(world, words))
        if remembered:
            return remembered
        raise


def _find_meanings(world: WorldModel, words: str, error: AmbiguousPlaceError) -> Iterator[Place]:
    """Return the places for each meaning of the part of the words that has several."""
    at = words.casefold().find(error.words.casefold())
    for meaning in error.meanings:
        said = words[:at] + meaning + words[at + len(error.words) :] if at >= 0 else meaning
        try:
            yield find_place(world, said)
        except GoalError:
            continue


def _find_remembered(world: WorldModel, words: str) -> Iterator[Place]:
    """Return what is surely meant or says the words; nobody is driven to what is only like them."""
    answer = world.recollection.find(words, limit=MOST_CANDIDATES)
    speaking = answer.find_speaking(least_said_ratio=LEAST_SAID_RATIO)
    most_said = max((each.said_ratio for each in speaking), default=0.0)
    by_id = {each.id: each for each in world.recollection.everything}
    for each in speaking:
        if each.said_ratio >= SAME_SAID_RATIO * most_said:
            yield Place(each.entry.id, by_id[each.entry.id])


MOST_STOPS = 20


class StopState(StrEnum):
    """How it stands with one stop."""

    AHEAD = "ahead"
    DONE = "done"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True, kw_only=True)
class RouteStop:
    """One stop of a route.

    Attributes:
        leg_m: The path to it from the stop before, the first from the robot, as planned.
        obstacle: Why it was left out, or could not be reached yet: the check of its pose, or how
            the drive there ended.
    """

    asked: str
    goal: CheckedGoal
    n_candidates: int
    leg_m: float
    state: StopState = StopState.AHEAD
    obstacle: GoalCheck | GoalStatus | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RoutePlan:
    """A route as a whole.

    Attributes:
        greedy_m: The whole length if the nearest candidate were taken each time.
    """

    stops: tuple[RouteStop, ...]
    greedy_m: float

    @property
    def total_m(self) -> float:
        """The whole length by path."""
        return math.fsum(stop.leg_m for stop in self.stops)


def plan_route(world: WorldModel, stops: Sequence[str]) -> RoutePlan:
    """Plan a route past stops in their order, each an id, a name, "x, y" or other words.

    Raises:
        GoalError: There are no stops or too many, one means nothing that can be reached, or no way
            leads from one to the next.
    """
    if not 1 <= len(stops) <= MOST_STOPS:
        raise GoalError(
            f"A route has 1 to {MOST_STOPS} stops; this one has {len(stops)}.",
            hint="Give the stops in order, as ids, names or phrases.",
        )
    choices = [_find(world, number, words) for number, words in enumerate(stops)]
    legs_m = _Legs(world)
    best: list[tuple[float, tuple[CheckedGoal, ...]]] = [(0.0, ())]
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
                hint="Leave one of them out.",
                step=NextStep.MEASURE_BETWEEN,
            )
    _, chosen = min(best, key=lambda found: found[0])
    legs = zip(stops, chosen, choices, legs_m.along(chosen), strict=True)
    return RoutePlan(
        stops=tuple(
            RouteStop(asked=words, goal=goal, n_candidates=len(candidates), leg_m=leg_m)
            for words, goal, candidates, leg_m in legs
        ),
        greedy_m=math.fsum(legs_m.along(_choose_greedily(legs_m, choices))),
    )


def _find(world: WorldModel, number: int, words: str) -> tuple[CheckedGoal, ...]:
    try:
        return find_candidates(world, words)
    except GoalError as error:
        raise GoalError(
            f"Stop {number + 1}: {error.message}",
            hint=error.hint,
            step=error.step,
            about=error.about,
        ) from error


def _choose_greedily(
    legs_m: "_Legs", choices: Sequence[tuple[CheckedGoal, ...]]
) -> tuple[CheckedGoal, ...]:
    way: tuple[CheckedGoal, ...] = ()
    for candidates in choices:
        here = way
        way = (*way, min(candidates, key=lambda each: legs_m.between(here, each)))
    return way


class _Legs:
    """Path lengths on one map; each field of distances is computed once."""

    def __init__(self, world: WorldModel) -> None:
        self._world = world
        self._fields: dict[Point, DistanceField] = {}

    def between(self, way: tuple[CheckedGoal, ...], goal: CheckedGoal) -> float:
        """Return the metres from the end of a way, the robot where it is empty, to a candidate."""
        found_m = self._field(way).distance_to(goal.pose.point)
        return math.inf if found_m is None else found_m

    def along(self, way: tuple[CheckedGoal, ...]) -> tuple[float, ...]:
        """Return the metres of each leg."""
        return tuple(self.between(way[:n], each) for n, each in enumerate(way))

    def _field(self, way: tuple[CheckedGoal, ...]) -> DistanceField:
        if not way:
            return self._world.distances
        start = way[-1].pose.point
        if start not in self._fields:
            self._fields[start] = self._world.distances.from_elsewhere(start)
        return self._fields[start]
