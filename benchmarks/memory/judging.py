"""Judges answers by what is true: the right thing, honestly unsure, or confident and wrong."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from benchmarks.memory.asking import Request, ask, list_requests
from benchmarks.memory.observer import Memory
from benchmarks.memory.places import truth_of
from benchmarks.memory.sites import Site, TrueThing
from mapspeak.geometry import wrap_angle
from mapspeak.memory.search.answer import EntryKind, Verdict
from mapspeak.places.asking import Recall
from mapspeak.places.candidate import SURE_RATIO, RecallCandidate
from mapspeak.places.goalcheck import judge_goal
from mapspeak.worldmodel.model import WorldModel

__all__ = ["Facing", "Fault", "Judged", "Outcome", "choose", "judge_all"]

NEAR_M = 1.5
FACING_RAD = math.radians(30)
HALF_WIDTH_M = 0.3


class Outcome(StrEnum):
    """How an answer is judged, by its verdict alone: what its advice adds does not count."""

    RIGHT = "right thing"
    HONEST = "honest: ambiguous or not remembered"
    WRONG = "confident and wrong"


class Fault(StrEnum):
    """How a wrong answer came about."""

    NO_THING = "a remembered place, not a thing"
    OTHER_NAME = "a thing of another name"
    WRONG_VIEWS = "made of wrong views: nothing of that name is there"
    OTHER_ROOM = "a thing of that name in another room"
    MISPLACED = "the thing itself, placed more than 1.5 m off"


class Facing(StrEnum):
    """How a goal lies before the true thing."""

    FACES = "faces it from 1.5 m"
    NO_DRIVE = "cannot be driven to"
    SEEN_FROM = "is only where it was seen from"
    FAR = "is farther than 1.5 m"
    TURNED = "is turned away"
    HIDDEN = "has something between"


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """An answer and how it is judged.

    Attributes:
        site: In which building.
        request: What was asked.
        was_annotated: Whether the thing that gave rise to the request was ever written down.
        answer: What the memory said.
        outcome: How that is judged.
        is_listed: Whether one of the candidates is right.
        facing: How the goal lies before the thing; None where nothing right was found.
        fault: How a wrong answer came about; None of all others.
        off_m: From the first candidate to the nearest thing that was asked for.
    """

    site: str
    request: Request
    was_annotated: bool
    answer: Recall
    outcome: Outcome
    is_listed: bool
    facing: Facing | None
    fault: Fault | None
    off_m: float

    @property
    def is_told_unsure(self) -> bool:
        """True when what was found has less trust than the advice calls sure."""
        first = self.answer.candidates[:1]
        is_found = self.answer.verdict is Verdict.FOUND
        return is_found and first[0].trust.ratio < SURE_RATIO


def judge_all(site: Site, memory: Memory, world: WorldModel) -> Iterator[Judged]:
    """Ask for everything in a building and judges the answers."""
    for number, request in list_requests(site):
        answer = ask(world, request)
        meant = [_meant(site, request, each) for each in answer.candidates]
        facing = fault = None
        outcome = Outcome.HONEST
        if answer.verdict is Verdict.FOUND:
            first, truth = answer.candidates[0], meant[0]
            outcome = Outcome.WRONG if truth is None else Outcome.RIGHT
            if truth is None:
                fault = _find_fault(site, memory, world, request, first)
            else:
                facing = _judge_goal(site, world, truth, first)
        yield Judged(
            site=site.name,
            request=request,
            was_annotated=site.things[number] in memory.annotated,
            answer=answer,
            outcome=outcome,
            is_listed=any(meant),
            facing=facing,
            fault=fault,
            off_m=_off_m(site, request, answer),
        )


def _off_m(site: Site, request: Request, answer: Recall) -> float:
    at = answer.candidates[0].position if answer.candidates else None
    if at is None:
        return math.inf
    return min(truth.point.distance_to(at) for truth in _asked_for(site, request))


def _meant(site: Site, request: Request, candidate: RecallCandidate) -> TrueThing | None:
    """Return the true thing at the place that was named, where it is one that was asked for."""
    at = candidate.position
    if at is None or candidate.kind is not EntryKind.THING:
        return None
    near = [truth for truth in _asked_for(site, request) if truth.point.distance_to(at) <= NEAR_M]
    return min(near, key=lambda truth: truth.point.distance_to(at), default=None)


def _asked_for(site: Site, request: Request) -> list[TrueThing]:
    return [
        truth
        for truth in site.things
        if truth.label == request.label and request.room_id in (None, site.room_of(truth))
    ]


def _judge_goal(site: Site, world: WorldModel, truth: TrueThing, found: RecallCandidate) -> Facing:
    pose = found.pose
    off_rad = abs(wrap_angle(pose.point.bearing_to(truth.point) - pose.yaw_rad))
    # A large thing is faced when any part of it is ahead.
    half_rad = math.atan2(HALF_WIDTH_M, max(pose.point.distance_to(truth.point), 1e-6))
    if not judge_goal(site.grid, world.distances, pose).is_ok:
        return Facing.NO_DRIVE
    if truth.distance_to(pose.point) > NEAR_M:
        return Facing.FAR if found.is_faced else Facing.SEEN_FROM
    if off_rad > FACING_RAD + half_rad:
        return Facing.TURNED
    return Facing.FACES if site.sees(pose.point, truth) else Facing.HIDDEN


def _find_fault(
    site: Site, memory: Memory, world: WorldModel, request: Request, found: RecallCandidate
) -> Fault:
    remembered = world.recollection.find_thing(found.id)
    if remembered is None:
        return Fault.NO_THING
    if found.name != request.label:
        return Fault.OTHER_NAME
    truth = truth_of(memory, remembered.thing)
    if truth is None or truth.label != request.label:
        return Fault.WRONG_VIEWS
    if request.room_id not in (None, site.room_of(truth)):
        return Fault.OTHER_ROOM
    return Fault.MISPLACED


def choose(judged: Sequence[Judged], *, n: int, seed: int) -> list[Judged]:
    """Return so many of the answers, drawn by a seed."""
    drawn = np.random.default_rng(seed).permutation(len(judged))[:n]
    return [judged[i] for i in sorted(drawn.tolist())]
