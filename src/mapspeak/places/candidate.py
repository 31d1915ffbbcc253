"""What is known of a place or thing that may be meant, and why it may still be wrong."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark
from mapspeak.memory.consistency.findings import WEIGHTS, FindingKind, Trust
from mapspeak.memory.search.answer import EntryCandidate, EntryKind
from mapspeak.places.goalcheck import GoalCheck, judge_goal
from mapspeak.places.naming import Place
from mapspeak.places.standing import find_overlook_of
from mapspeak.places.ways import stand_at
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import Remembered, RememberedPlace, RememberedThing


@dataclass(frozen=True, slots=True, kw_only=True)
class RecallCandidate:
    """A place or a thing that may be meant.

    Attributes:
        id: "T1" or "W1": a goal for the robot.
        match: How it matches the request; None where nothing was asked.
        away_m: From the point that the request is near to, straight; None where it has none.
        seen_from: Ids of the places that it was seen from; of a place, its own.
        pictures: That it was seen in, by their relative names.
        position: Where it is; None where nobody noted a direction.
        uncertainty_m: The radius around that which holds it with 90 %; None without a position,
            and for a place.
        recorded_point: Where the record of a thing has it without a map, by a range or the laser.
        is_guessed: Only one direction is known, and where the map ends it is taken to be.
        pose: Where the robot would stand: of a thing, near it and facing it where it can.
        is_faced: True when it would stand near it and face it.
        faced_ratio: The share of where a thing may be that it would face there.
        last_seen: By the calendar; None where nobody noted it.
    """

    id: str
    kind: EntryKind
    name: str
    match: EntryCandidate | None
    away_m: float | None
    seen_from: tuple[str, ...]
    pictures: tuple[str, ...]
    position: Point | None
    uncertainty_m: float | None
    recorded_point: Point | None
    is_guessed: bool
    room_ids: tuple[str, ...]
    pose: Pose
    is_faced: bool
    faced_ratio: float
    check: GoalCheck
    last_seen: datetime | None
    trust: Trust


class RecallDoubt(StrEnum):
    """Why what was found may still be wrong."""

    DOUBTFUL_RECORD = "doubtful_record"
    NOT_NOTED = "not_noted"
    NOT_ON_MAP = "not_on_map"
    CONTRADICTED = "contradicted"
    LONG_AGO = "long_ago"
    FEW_VIEWS = "few_views"
    IMPRECISE = "imprecise"
    OTHER_ROOM = "other_room"
    OUT_OF_SIGHT = "out_of_sight"
    HARDLY_IN_SIGHT = "hardly_in_sight"


def kind_of(remembered: Remembered) -> EntryKind:
    """Return whether it is a place or a thing."""
    return EntryKind.PLACE if isinstance(remembered, RememberedPlace) else EntryKind.THING


def point_of(remembered: Remembered) -> Point:
    """Return where it is; of a thing without a position, where it was seen from."""
    if isinstance(remembered, RememberedPlace):
        return remembered.waypoint.pose.point
    return remembered.point


def find_rooms_of(world: WorldModel, remembered: Remembered) -> tuple[str, ...]:
    """Return the rooms it may be in, by id."""
    if isinstance(remembered, RememberedThing):
        return world.rooms_before(remembered)
    room_id = world.find_room_id(remembered.waypoint.pose.point)
    return () if room_id is None else (room_id,)


def last_seen(world: WorldModel, remembered: Remembered) -> datetime | None:
    """Return when it was last seen, by the calendar; None if not noted."""
    if isinstance(remembered, RememberedPlace):
        return remembered.waypoint.recorded_at
    times = (view.recorded_at for _, view in _list_views(world, remembered))
    return max(filter(None, times), default=None)


def _list_views(world: WorldModel, thing: RememberedThing) -> Iterator[tuple[str, Landmark]]:
    """Return what was seen of a thing, each with its time and picture, and from which place."""
    for view in thing.thing.supporting:
        place = world.recollection.find_place(view.waypoint)
        if place is not None:
            yield place.id, place.waypoint.dated(view.landmark)


def describe_candidate(
    world: WorldModel,
    remembered: Remembered,
    *,
    match: EntryCandidate | None = None,
    near: Point | None = None,
) -> RecallCandidate:
    """Return what is known of a place or thing, and how a robot would stand for it."""
    position: Point | None
    recorded_point: Point | None = None
    if isinstance(remembered, RememberedPlace):
        waypoint = remembered.waypoint
        name, position, uncertainty_m = waypoint.name, waypoint.pose.point, None
        is_guessed = False
        seen_from, pictures = [remembered.id], [waypoint.picture]
        is_faced, faced_ratio = False, 0.0
        trust = world.judge.judge_place(remembered)
    else:
        thing, views = remembered.thing, list(_list_views(world, remembered))
        name, position, uncertainty_m = thing.label, thing.position, thing.uncertainty_m
        is_guessed, recorded_point = thing.is_guessed, thing.recorded_point
        seen_from, pictures = [each for each, _ in views], [view.picture for _, view in views]
        is_looked_for = find_overlook_of(world, remembered) is not None
        is_faced = world.find_approach(remembered) is not None and not is_looked_for
        faced_ratio = world.measure_faced(remembered)
        trust = world.judge.judge_thing(remembered, now=world.now)
    pose = stand_at(world, Place(remembered.id, remembered))
    return RecallCandidate(
        id=remembered.id,
        kind=kind_of(remembered),
        name=name,
        match=match,
        away_m=None if near is None else point_of(remembered).distance_to(near),
        seen_from=tuple(dict.fromkeys(seen_from)),
        pictures=tuple(dict.fromkeys(filter(None, pictures))),
        position=position,
        uncertainty_m=uncertainty_m,
        recorded_point=recorded_point,
        is_guessed=is_guessed,
        room_ids=find_rooms_of(world, remembered),
        pose=pose,
        is_faced=is_faced,
        faced_ratio=faced_ratio,
        check=judge_goal(world.grid, world.distances, pose, opened=world.map.open.distances_from),
        last_seen=last_seen(world, remembered),
        trust=trust,
    )


SURE_RATIO = 0.98
"""A thing that two good views agree on is surer than that, and one view alone is not."""
DOUBTFUL_RATIO = 0.5
LEAST_STAYED_RATIO = WEIGHTS[FindingKind.AGED]
LARGEST_OFF_M = 1.2
"""A thing located less precisely may not be in view from in front of it."""
LEAST_FACED_RATIO = 0.3
"""Least share of where a thing may be that must lie ahead to promise that the robot faces it."""


def find_doubt(first: RecallCandidate, *, room_id: str | None) -> RecallDoubt | None:
    """Return why what was found may still be wrong; None where nothing speaks for that.

    Args:
        first: The only one that is meant.
        room_id: Where it was asked for.
    """
    if first.kind is EntryKind.PLACE:
        return RecallDoubt.DOUBTFUL_RECORD if first.trust.ratio < DOUBTFUL_RATIO else None
    if first.position is None or first.uncertainty_m is None:
        return RecallDoubt.NOT_NOTED if first.recorded_point is None else RecallDoubt.NOT_ON_MAP
    doubts = {
        RecallDoubt.CONTRADICTED: first.trust.ratio < DOUBTFUL_RATIO,
        RecallDoubt.LONG_AGO: first.trust.stayed_ratio < LEAST_STAYED_RATIO,
        RecallDoubt.FEW_VIEWS: first.trust.ratio < SURE_RATIO * first.trust.stayed_ratio,
        RecallDoubt.IMPRECISE: first.uncertainty_m > LARGEST_OFF_M,
        RecallDoubt.OTHER_ROOM: room_id is not None and set(first.room_ids) != {room_id},
        RecallDoubt.OUT_OF_SIGHT: first.check.is_ok and not first.is_faced,
        RecallDoubt.HARDLY_IN_SIGHT: first.check.is_ok and first.faced_ratio < LEAST_FACED_RATIO,
    }
    return next((doubt for doubt, is_so in doubts.items() if is_so), None)
