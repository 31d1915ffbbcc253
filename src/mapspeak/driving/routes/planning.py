"""The shortest way past several stops in order, where a stop may mean several places."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from mapspeak.driving.routes.ordering import RouteOrder, order_shortest
from mapspeak.errors import GoalError, NextStep
from mapspeak.geometry import Point
from mapspeak.places.goalcheck import GoalCheck, say_refusal
from mapspeak.places.naming import START, AmbiguousPlaceError, Place, Spot
from mapspeak.places.relations.choosing import CheckedGoal, check_place, find_group, find_place
from mapspeak.places.relations.grammar import Superlative, parse_relation
from mapspeak.places.relations.superlatives import find_all_near
from mapspeak.robot import GoalStatus
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.paths import DistanceField
from mapspeak.worldmodel.model import WorldModel

MOST_CANDIDATES = 12
LEAST_SAID_RATIO = 0.75
"""Words that are not a name need at least this similarity to a place."""
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
    if isinstance(relation, Superlative) and relation == Superlative(
        kind=relation.kind, label=relation.label
    ):
        near = find_all_near(world, relation)
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
    """Return what is surely meant or contains the words; similarity alone is never driven to."""
    answer = world.recollection.find(words, limit=MOST_CANDIDATES)
    speaking = answer.find_speaking(least_said_ratio=LEAST_SAID_RATIO)
    most_said = max((each.said_ratio for each in speaking), default=0.0)
    for each in speaking:
        if each.said_ratio >= SAME_SAID_RATIO * most_said:
            yield Place(each.entry.id, world.recollection.by_id[each.entry.id])


MOST_STOPS = 20

Asked = tuple[str, tuple[CheckedGoal, ...]]
"""The words of a stop, and all that they may mean."""


class WhenBlocked(StrEnum):
    """What becomes of a route when a stop cannot be reached."""

    WAIT = "wait"
    SKIP = "skip"


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
        as_given_m: The whole length in the order in which the stops were given; None where that is
            their order, or the route ends elsewhere.
        left_out: Of "all rooms" and the like, those that the robot cannot get to.
    """

    stops: tuple[RouteStop, ...]
    greedy_m: float
    as_given_m: float | None = None
    left_out: tuple[RouteStop, ...] = ()

    @property
    def total_m(self) -> float:
        """The whole length by path."""
        return math.fsum(stop.leg_m for stop in self.stops)


def plan_route(
    world: WorldModel,
    stops: Sequence[str],
    *,
    order: RouteOrder = RouteOrder.AS_GIVEN,
    end_at: str | None = None,
    when_blocked: WhenBlocked = WhenBlocked.WAIT,
) -> RoutePlan:
    """Plan a route past stops, each an id, a name, "x, y" or other words.

    The places of "all rooms" and the like follow one another on the shortest way past them.

    Args:
        order: Whether the stops are driven past as they are given, or on the shortest way.
        end_at: A last stop, whatever the order; "start" is where the robot is now.
        when_blocked: Whether a stop that cannot be reached now is left out.

    Raises:
        GoalError: There are no stops or too many, one means nothing that can be reached, or no way
            leads from one to the next.
    """
    _require_number(len(stops))
    legs_m = _Legs(world)
    asked, left_out = _spread(world, legs_m, stops, when_blocked)
    as_given_m = math.fsum(legs_m.along(_choose_shortest(legs_m, asked)))
    last = [] if end_at is None else [_find_end(world, end_at)]
    _require_number(len(asked) + len(last))
    if order is RouteOrder.SHORTEST:
        asked = _reorder(legs_m, [*asked, *last], is_end_fixed=bool(last))
    else:
        asked = [*asked, *last]
    chosen = _choose_shortest(legs_m, asked)
    legs = zip(asked, chosen, legs_m.along(chosen), strict=True)
    return RoutePlan(
        stops=tuple(
            RouteStop(asked=words, goal=goal, n_candidates=len(candidates), leg_m=leg_m)
            for (words, candidates), goal, leg_m in legs
        ),
        greedy_m=math.fsum(legs_m.along(_choose_greedily(legs_m, asked))),
        as_given_m=as_given_m if order is RouteOrder.SHORTEST and not last else None,
        left_out=left_out,
    )


def _require_number(n_stops: int) -> None:
    if not 1 <= n_stops <= MOST_STOPS:
        raise GoalError(
            f"A route has 1 to {MOST_STOPS} stops; this one has {n_stops}.",
            hint="Give the stops in order, as ids, names or phrases.",
        )


def _spread(
    world: WorldModel, legs_m: "_Legs", stops: Sequence[str], when_blocked: WhenBlocked
) -> tuple[list[Asked], tuple[RouteStop, ...]]:
    """Return each stop with its candidates, and what is left out as it cannot be reached."""
    asked: list[Asked] = []
    left_out: list[RouteStop] = []
    for number, words in enumerate(stops):
        group = [check_place(world, place) for place in find_group(world, words)]
        ahead = [goal for goal in group if goal.check.is_ok]
        if not ahead:
            shut = _find_shut(world, words) if when_blocked is WhenBlocked.SKIP else None
            if shut is None:
                asked.append((words, _find(world, number, words)))
            else:
                left_out.append(_leave_out(shut))
            continue
        left_out += [_leave_out(goal) for goal in group if not goal.check.is_ok]
        way = asked[-1][1][:1] if asked else ()
        table = legs_m.table(way, ahead)
        shortest = order_shortest(table, is_end_fixed=False)
        asked += [(ahead[index].name, (ahead[index],)) for index in shortest]
    if left_out and not asked:
        shut = left_out[0].goal
        raise GoalError(
            f"No stop can be reached. {say_refusal(shut.name, shut.check)}",
            hint="Choose other stops, or wait until there is a way.",
        )
    return asked, tuple(left_out)


def _find_shut(world: WorldModel, words: str) -> CheckedGoal | None:
    """Return the place that words mean where the robot cannot get to it now."""
    try:
        goals = [check_place(world, place) for place in _find_places(world, words)]
    except GoalError:
        return None
    return None if any(goal.check.is_ok for goal in goals) else goals[0]


def _reorder(legs_m: "_Legs", asked: list[Asked], *, is_end_fixed: bool) -> list[Asked]:
    """Return stops on the shortest way past the likeliest meaning of each.

    Which of several places a stop means is chosen afterwards, and then the order once more.
    """
    meant = [candidates[0] for _, candidates in asked]
    for _ in range(2):
        table = legs_m.table((), meant)
        order = order_shortest(table, is_end_fixed=is_end_fixed)
        asked = [asked[index] for index in order]
        meant = list(_choose_shortest(legs_m, asked))
    return asked


def _find_end(world: WorldModel, words: str) -> Asked:
    """Return the last stop of a route."""
    if words.strip().casefold() == START:
        here = Place(START, Spot(world.robot.point, world.robot.yaw_rad))
        return START, (check_place(world, here),)
    return words, find_candidates(world, words)


def _leave_out(goal: CheckedGoal) -> RouteStop:
    return RouteStop(
        asked=goal.name,
        goal=goal,
        n_candidates=1,
        leg_m=0.0,
        state=StopState.SKIPPED,
        obstacle=goal.check,
    )


def _choose_shortest(legs_m: "_Legs", asked: Sequence[Asked]) -> tuple[CheckedGoal, ...]:
    """Return the candidate for each stop with which the whole route is shortest.

    Raises:
        GoalError: No way leads from one to the next.
    """
    best: list[tuple[float, tuple[CheckedGoal, ...]]] = [(0.0, ())]
    for number, (words, candidates) in enumerate(asked):
        best = [
            min(
                ((spent_m + legs_m.between(way, each), (*way, each)) for spent_m, way in best),
                key=lambda found: found[0],
            )
            for each in candidates
        ]
        if all(math.isinf(spent_m) for spent_m, _ in best):
            raise GoalError(
                f"No way leads from stop {number} to stop {number + 1}, {words}.",
                hint="Leave one of them out.",
                step=NextStep.MEASURE_BETWEEN,
            )
    return min(best, key=lambda found: found[0])[1]


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


def _choose_greedily(legs_m: "_Legs", asked: Sequence[Asked]) -> tuple[CheckedGoal, ...]:
    way: tuple[CheckedGoal, ...] = ()
    for _, candidates in asked:
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

    def table(self, way: tuple[CheckedGoal, ...], goals: Sequence[CheckedGoal]) -> FloatArray:
        """Return the metres from the end of a way, and from each goal, to each goal."""
        starts = [way, *((goal,) for goal in goals)]
        return np.array([[self.between(start, goal) for goal in goals] for start in starts])

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
