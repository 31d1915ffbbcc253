"""Requests such as "go to the ladder in R3", answered by the memory and judged by the truth."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from benchmarks.memory.sites import Site, TrueThing
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.navigation.goals import check_goal
from mapspeak.semantic import SemanticMap
from mapspeak.semantic.consistency import Finding, check_memory, judge_trust
from mapspeak.semantic.things import Thing, Things, find_approach, find_fronts, name_the_same
from mapspeak.simulator import BODY_RADIUS_M
from mapspeak.spatial.paths import DistanceField, distances_from

__all__ = ["Answer", "Finder", "Library", "Outcome", "Request", "Verdict", "ask", "by_label"]

SURE_RATIO = 0.98
MOST_UNCERTAIN_M = 1.2
NEAR_M = 1.5
FACING_RAD = math.radians(30)
RADIUS_M = BODY_RADIUS_M + 0.03


class Outcome(StrEnum):
    """How an answer is judged."""

    RIGHT = "right thing"
    HONEST = "honestly unsure or not remembered"
    WRONG = "confident and wrong"


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What somebody wants to be driven to.

    Attributes:
        label: What it is called.
        room_id: In which room; None where any will do.
    """

    label: str
    room_id: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What the memory says.

    Attributes:
        thing: The likeliest; None where none is remembered.
        pose: Where to stand for it.
        is_sure: False for "not remembered", "only seen once", "somewhere there".
    """

    thing: Thing | None
    pose: Pose | None
    is_sure: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Library:
    """What a finder may look at.

    Attributes:
        places: The records.
        found: The things made of them.
        findings: What is odd about them.
        distances: From the robot.
        room_at: Gives the room of a place.
    """

    places: SemanticMap
    found: Things
    findings: tuple[Finding, ...]
    distances: DistanceField
    room_at: Callable[[Point], str | None]


Finder = Callable[[Library, Request], Answer]


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """An answer and how it is judged.

    Attributes:
        request: What was asked.
        was_annotated: Whether the thing that gave rise to the request was ever written down.
        outcome: How the answer is judged.
        answer: What was said.
        faces: Whether the pose faces the thing from near; None where nothing right was named.
    """

    request: Request
    was_annotated: bool
    outcome: Outcome
    answer: Answer
    faces: bool | None


def by_label(library: Library, request: Request) -> Answer:
    """Finds a thing by its label and room: of those to be sure of, the nearest by path."""
    named = [each for each in library.found.things if name_the_same(each.label, request.label)]
    candidates = []
    for thing in named:
        pose = _approach(library, thing)
        rooms = _rooms_of(library, thing)
        if request.room_id in (None, *rooms):
            trust = judge_trust(thing, library.findings).ratio
            is_sure = (
                trust >= SURE_RATIO
                and pose is not None
                and (thing.uncertainty_m or math.inf) <= MOST_UNCERTAIN_M
                and (request.room_id is None or rooms == {request.room_id})
            )
            way_m = library.distances.distance_to(pose.point) if pose else None
            candidates.append((not is_sure, way_m or math.inf, thing, pose))
    if not candidates:
        return Answer(thing=None, pose=None, is_sure=False)
    is_unsure, _, thing, pose = min(candidates, key=lambda each: each[:2])
    return Answer(thing=thing, pose=pose, is_sure=not is_unsure)


def _rooms_of(library: Library, thing: Thing) -> set[str]:
    """Gives the rooms on the near side of a thing, for each who saw it; several where unsure."""
    if thing.position is None:
        return set()
    seen_from = [view.place for view in thing.supporting]
    fronts = find_fronts(library.found.sight, thing.position, seen_from)
    return {room for room in map(library.room_at, fronts) if room is not None}


def _approach(library: Library, thing: Thing) -> Pose | None:
    if thing.position is None:
        return None
    seen_from = [view.place for view in thing.supporting]
    return find_approach(library.found.sight, library.distances, thing.position, seen_from)


def open_library(site: Site, places: SemanticMap, found: Things) -> Library:
    """Gives what a finder may look at: the records and the map, nothing that is true."""
    distances = distances_from(site.grid, Point(0.0, 0.0), radius_m=RADIUS_M)
    findings = check_memory(places, found, distances=distances, rooms=site.rooms)

    def room_at(point: Point) -> str | None:
        region = site.rooms.find_region_at(point)
        return None if region is None else region.id

    return Library(
        places=places, found=found, findings=findings, distances=distances, room_at=room_at
    )


def ask(
    site: Site, library: Library, annotated: tuple[TrueThing, ...], finder: Finder
) -> Iterator[Verdict]:
    """Asks for every thing of a building, by its name alone and by name and room."""
    for truth in site.things:
        for room_id in (None, site.room_of(truth)):
            request = Request(label=truth.label, room_id=room_id)
            answer = finder(library, request)
            meant = _meant(site, request, answer) if answer.is_sure else None
            outcome = Outcome.HONEST
            if answer.is_sure:
                outcome = Outcome.RIGHT if meant else Outcome.WRONG
            yield Verdict(
                request=request,
                was_annotated=truth in annotated,
                outcome=outcome,
                answer=answer,
                faces=_faces(site, library, meant, answer.pose) if meant else None,
            )


def _meant(site: Site, request: Request, answer: Answer) -> TrueThing | None:
    """Gives the true thing at the place that was named, where it is one that was asked for."""
    at = answer.thing.position if answer.thing else None
    if at is None:
        return None
    fitting = [
        truth
        for truth in site.things
        if truth.label == request.label
        and request.room_id in (None, site.room_of(truth))
        and truth.point.distance_to(at) <= NEAR_M
    ]
    return min(fitting, key=lambda truth: truth.point.distance_to(at), default=None)


def _faces(site: Site, library: Library, truth: TrueThing, pose: Pose | None) -> bool:
    if pose is None or not check_goal(site.grid, library.distances, pose).is_ok:
        return False
    off_rad = abs(wrap_angle(pose.point.bearing_to(truth.point) - pose.yaw_rad))
    # A large thing is faced when any part of it is ahead.
    half_rad = math.atan2(0.3, max(pose.point.distance_to(truth.point), 1e-6))
    is_near = truth.distance_to(pose.point) <= NEAR_M
    return is_near and off_rad <= FACING_RAD + half_rad and site.sees(pose.point, truth)


def choose(verdicts: list[Verdict], *, n: int, seed: int) -> list[Verdict]:
    """Gives so many of the verdicts, drawn by a seed."""
    drawn = np.random.default_rng(seed).permutation(len(verdicts))[:n]
    return [verdicts[i] for i in sorted(drawn.tolist())]
