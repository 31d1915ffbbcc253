"""The poses that the words for one stop of a route may mean."""

from collections.abc import Iterator
from dataclasses import dataclass

from mapspeak.errors import GoalError
from mapspeak.geometry import Pose
from mapspeak.places.choosing import CheckedGoal, check_place
from mapspeak.places.goalcheck import say_refusal
from mapspeak.places.naming import AmbiguousPlaceError, Place
from mapspeak.places.places import find_place
from mapspeak.places.relations import Nearest, find_all_near, parse_relation
from mapspeak.worldmodel.model import Atlas

__all__ = ["MOST_CANDIDATES", "Candidate", "find_candidates"]

MOST_CANDIDATES = 12
LEAST_SAID_RATIO = 0.75
"""Of words that are no name, so much must be said of what they are taken for."""
SAME_SAID_RATIO = 0.9
"""What says so nearly as much of them as the best may be meant too."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """One thing that a stop may mean, where the robot can stand.

    Attributes:
        name: Such as "W3".
        pose: Where to stand.
        title: The name with the reason, where words had to be read for it.
        comes_straight_on: Nobody asked for a heading: it is that of the way from where the robot
            will be, and not of the way from where it was when the route was planned.
    """

    name: str
    pose: Pose
    title: str
    comes_straight_on: bool = False


def find_candidates(atlas: Atlas, words: str) -> tuple[Candidate, ...]:
    """Finds all that words may mean and the robot can get to.

    Raises:
        GoalError: They mean nothing, or nothing that can be reached.
    """
    goals = [check_place(atlas, place) for place in _find_places(atlas, words)]
    good = [goal for goal in goals if goal.check.is_ok]
    if not good:
        raise GoalError(
            say_refusal(goals[0].name, goals[0].check),
            hint="Leave this stop out, or call check_goal to find a pose near it that works.",
        )
    unique = {(goal.pose.x, goal.pose.y): _candidate_of(goal) for goal in reversed(good)}
    return tuple(reversed(unique.values()))[:MOST_CANDIDATES]


def _candidate_of(goal: CheckedGoal) -> Candidate:
    return Candidate(goal.name, goal.pose, goal.title, goal.comes_straight_on)


def _find_places(atlas: Atlas, words: str) -> list[Place]:
    """Finds what words mean; "the nearest door" is nearest on the route, so any door may be it."""
    relation = parse_relation(words)
    if isinstance(relation, Nearest) and relation.to is None:
        near = find_all_near(atlas, relation.kind)
        if near:
            return list(near)
    try:
        return [find_place(atlas, words)]
    except AmbiguousPlaceError as error:
        found = list(_find_meanings(atlas, words, error))
        if found:
            return found
        raise
    except GoalError:
        remembered = list(_find_remembered(atlas, words))
        if remembered:
            return remembered
        raise


def _find_meanings(atlas: Atlas, words: str, error: AmbiguousPlaceError) -> Iterator[Place]:
    """Gives the places for each meaning of the part of the words that has several."""
    at = words.casefold().find(error.words.casefold())
    for meaning in error.meanings:
        said = words[:at] + meaning + words[at + len(error.words) :] if at >= 0 else meaning
        try:
            yield find_place(atlas, said)
        except GoalError:
            continue


def _find_remembered(atlas: Atlas, words: str) -> Iterator[Place]:
    """Gives what is surely meant or says the words; nobody is driven to what is only like them."""
    answer = atlas.recollection.find(words, limit=MOST_CANDIDATES)
    speaking = answer.find_speaking(least_said_ratio=LEAST_SAID_RATIO)
    most_said = max((each.said_ratio for each in speaking), default=0.0)
    by_id = {each.id: each for each in atlas.recollection.everything}
    for each in speaking:
        if each.said_ratio >= SAME_SAID_RATIO * most_said:
            yield Place(each.entry.id, by_id[each.entry.id])
