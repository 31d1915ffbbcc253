"""Asks for every goal and judges the answers."""

import math
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum

import click
import cv2
import numpy as np

from benchmarks.figure import Figure
from benchmarks.relations.goal import Expected, Goal
from benchmarks.relations.goals import build_goals
from benchmarks.relations.sites import Site, build_sites
from benchmarks.relations.truth import Truth, angle_off
from mapspeak.errors import GoalError
from mapspeak.memory import SemanticMap
from mapspeak.places.naming import Place
from mapspeak.places.relations.choosing import CheckedGoal, check_place, find_place
from mapspeak.worldmodel.model import WorldModel

__all__ = ["main", "measure"]

FACING_RAD = math.radians(12)


class Outcome(StrEnum):
    """How an answer is judged."""

    RIGHT = "right"
    REFUSED = "refused though something fits"
    ASKED = "asked back though it is clear"
    WRONG = "wrong"


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """An answer and how it is judged."""

    site: str
    goal: Goal
    outcome: Outcome
    answer: str
    took_ms: float

    @property
    def kind(self) -> str:
        """What sort of answer it was."""
        if not self.answer.startswith("refused"):
            return "a place"
        return "asked back" if is_question(self.answer) else "refused, as nothing fits"


def is_question(message: str) -> bool:
    """Return True for an error that asks which of several things is meant."""
    return any(sign in message for sign in ("Several things", "are called", "corners. Say which"))


def measure() -> Iterator[Figure]:
    """Return how many goals came out how, over all maps."""
    verdicts = list(judge_all())
    counts = Counter(verdict.outcome for verdict in verdicts)
    yield Figure(name="goals", value=len(verdicts), unit="")
    for outcome in Outcome:
        yield Figure(name=outcome.value, value=counts[outcome], unit="goals")
    yield Figure(name="right", value=100 * counts[Outcome.RIGHT] / len(verdicts), unit="%")
    kinds = Counter(verdict.kind for verdict in verdicts if verdict.outcome is Outcome.RIGHT)
    for kind, n in sorted(kinds.items()):
        yield Figure(name=f"right: {kind}", value=n, unit="goals")
    took_ms = sorted(verdict.took_ms for verdict in verdicts)
    yield Figure(name="one goal, median", value=took_ms[len(took_ms) // 2], unit="ms")
    yield Figure(name="one goal, longest", value=took_ms[-1], unit="ms")


def judge_all() -> Iterator[Verdict]:
    """Ask for every goal of every site."""
    cv2.setNumThreads(1)
    for site in build_sites():
        truth = Truth(site)
        world = _look(site, site.memory)
        for goal in build_goals(truth, world):
            asked = _look_at_twins(site) if goal.expected is Expected.ASKED else world
            yield _judge(truth, asked, goal)


def _look(site: Site, memory: SemanticMap) -> WorldModel:
    world = WorldModel(site.grid, site.robot, memory, radius_m=site.radius_m)
    _ = world.rooms, world.distances, world.frontiers
    return world


def _look_at_twins(site: Site) -> WorldModel:
    """Return the site with its last two remembered places under one name."""
    waypoints = site.memory.waypoints
    twins = (replace(each, name="twin") for each in waypoints[-2:])
    return _look(site, SemanticMap(waypoints=(*waypoints[:-2], *twins)))


def _judge(truth: Truth, world: WorldModel, goal: Goal) -> Verdict:
    started_s = time.process_time()
    answer: tuple[Place, CheckedGoal] | GoalError
    try:
        place = find_place(world, goal.words)
        answer = place, check_place(world, place)
    except GoalError as error:
        answer = error
    took_ms = 1e3 * (time.process_time() - started_s)
    if isinstance(answer, GoalError):
        said, outcome = f"refused: {answer}", _judge_refusal(truth, goal, str(answer))
    else:
        place, checked = answer
        said = f"{place.name}: {place.reason} at {checked.pose}"
        outcome = _judge_answer(truth, goal, place.name, checked)
    return Verdict(site=truth.site.name, goal=goal, outcome=outcome, answer=said, took_ms=took_ms)


def _judge_refusal(truth: Truth, goal: Goal, message: str) -> Outcome:
    if goal.expected in (Expected.REFUSED, Expected.ASKED):
        return Outcome.RIGHT if all(word in message for word in goal.says) else Outcome.WRONG
    fits = goal.fits if goal.expected is Expected.PLACE else None
    if fits is not None and not fits(truth.places, strict=True).any():
        return Outcome.RIGHT
    return Outcome.ASKED if is_question(message) else Outcome.REFUSED


def _judge_answer(truth: Truth, goal: Goal, name: str, checked: CheckedGoal) -> Outcome:
    pose = checked.pose
    if goal.expected is Expected.THING:
        return Outcome.RIGHT if name in goal.says else Outcome.WRONG
    if goal.expected is not Expected.PLACE or goal.fits is None:
        return Outcome.WRONG
    if not (checked.check.is_ok and truth.is_standable(pose.point)):
        return Outcome.WRONG
    is_fit = bool(goal.fits(np.array([[pose.x, pose.y]]), strict=False)[0])
    if goal.looks_at is not None:
        off = float(angle_off(pose.yaw_rad, pose.point.bearing_to(goal.looks_at)))
        is_fit &= off <= FACING_RAD + math.atan2(0.25, pose.point.distance_to(goal.looks_at))
    return Outcome.RIGHT if is_fit else Outcome.WRONG


@click.command()
@click.option("--all", "is_all", is_flag=True, help="Those that are right as well.")
def main(*, is_all: bool) -> None:
    """List the goals that were not answered rightly."""
    counts: Counter[tuple[str, Outcome]] = Counter()
    for verdict in judge_all():
        counts[verdict.site, verdict.outcome] += 1
        if is_all or verdict.outcome is not Outcome.RIGHT:
            click.echo(
                f"{verdict.site}: {verdict.goal.words!r}: {verdict.outcome}: {verdict.answer}"
            )
    for (site, outcome), n in counts.items():
        click.echo(f"{n:4} {outcome}, {site}")
