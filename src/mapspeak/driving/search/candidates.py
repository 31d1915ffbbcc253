"""Where to look for a thing next: remembered places, frontiers, and floor not yet seen."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from mapspeak.driving.search.evidence import Opinions, weight_of
from mapspeak.driving.search.seenfloor import REACH_M, SeenFloor
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory import TakenPicture
from mapspeak.memory.search.answer import Verdict
from mapspeak.places.naming import Place
from mapspeak.places.relations.choosing import check_place
from mapspeak.places.standing import spread_places
from mapspeak.spatial.fieldofview import floor_by_heading, heading_index, heading_rad
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.grid import Mask
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace

LEAST_AREA_M2 = 1.0
"""Less unseen floor than this in view is not worth a look."""
STOP_M = 0.5
"""What a look costs beside the way to it."""
TURN_M = 0.5
"""What half a turn costs."""
UNKNOWN_WEIGHT = 0.5
"""A square metre that is only expected counts as this much of one that is known and unseen."""
NEAR_M = 5.0
MAY_BE_NEAR = 0.8
"""The score of what lies near something remembered that speaks of the thing, or is like it."""
LEAST_SAID_RATIO = 0.5
"""A record refers to the thing from this similarity on."""
MOST_REMEMBERED = 12


class CandidateKind(StrEnum):
    """What makes a place worth a look."""

    REMEMBERED = "remembered"
    PICTURED = "pictured"
    FRONTIER = "frontier"
    UNSEEN = "unseen"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SearchCandidate:
    """A place to look for the thing from.

    Attributes:
        id: W2, T1, P5 or F3; for unseen floor its coordinates.
        area_m2: Floor that is to come into view for the first time, as far as can be told.
        score: How likely the thing is there; 0.5 if unknown.
        rate: What speaks for it: square metres by their likelihood, for each metre of way.
        name: What something remembered, or a picture, is known by during the search.
    """

    kind: CandidateKind
    id: str
    pose: Pose
    area_m2: float
    path_m: float
    score: float
    rate: float
    frontier: Frontier | None = None
    name: str = ""


def find_candidates(
    world: WorldModel,
    thing: str,
    *,
    seen: SeenFloor,
    opinions: Opinions,
    visited: Collection[str],
    pictures: Sequence[TakenPicture] = (),
) -> list[SearchCandidate]:
    """Find where to look next, best first; what is remembered comes before all else.

    After that come earlier pictures in which the robot's own detector reported such a thing.

    Args:
        visited: The names of candidates of what is remembered that were looked at already.
        pictures: Those earlier pictures, in the order in which to go there.
    """
    speaking, alike = _find_remembered(world, thing)
    remembered = [
        candidate
        for each in speaking
        if _key(each) not in visited and (candidate := _remembered(world, each)) is not None
    ]
    seen_mask = seen.mask_on(world.grid)
    near = [each.point for each in (*speaking, *alike)]
    others = [
        *_frontiers(world, seen_mask, seen.half_view_rad, opinions, near),
        *_unseen(world, seen_mask, seen.half_view_rad, opinions, near),
    ]
    pictured = [
        candidate
        for each in pictures
        if each.id not in visited and (candidate := _pictured(world, each)) is not None
    ]
    return [*remembered, *pictured, *sorted(others, key=lambda each: -each.rate)]


def unseen_area_m2(world: WorldModel, pose: Pose, *, seen: SeenFloor) -> float:
    """Return how much floor that was not looked at yet comes into view in a pose."""
    seen_mask, here = seen.mask_on(world.grid, around=pose.point), np.array([[pose.x, pose.y]])
    areas_m2 = floor_by_heading(world.grid, ~seen_mask, here, seen.half_view_rad, reach_m=REACH_M)
    return float(areas_m2[0, heading_index(pose.yaw_rad)])


def _find_remembered(world: WorldModel, thing: str) -> tuple[list[Place], list[Place]]:
    """Return what speaks of the thing, and what may be it by its likeness alone."""
    by_id = {id_: Place(id_, each) for id_, each in world.recollection.by_id.items()}
    answer = world.recollection.find(thing, limit=MOST_REMEMBERED)
    speaking = answer.find_speaking(least_said_ratio=LEAST_SAID_RATIO)
    is_open = answer.verdict in (Verdict.SEVERAL, Verdict.UNSURE)
    meant = answer.candidates[: answer.n_meant] if is_open else ()
    return (
        [by_id[each.entry.id] for each in speaking],
        [by_id[each.entry.id] for each in meant if each not in speaking],
    )


def _key(place: Place) -> str:
    """Return what it is known by as long as a search lasts; ids of waypoints change in between."""
    remembered = place.thing
    return remembered.waypoint.name if isinstance(remembered, RememberedPlace) else place.name


def _remembered(world: WorldModel, place: Place) -> SearchCandidate | None:
    """Return where to stand for it, or the nearest pose that works; None where none does."""
    goal = check_place(world, place)
    pose = goal.pose if goal.check.is_ok else goal.check.nearest
    path_m = None if pose is None else world.path_m(pose.point)
    if pose is None or path_m is None:
        return None
    return _certain(CandidateKind.REMEMBERED, place.name, pose, path_m, name=_key(place))


def _pictured(world: WorldModel, picture: TakenPicture) -> SearchCandidate | None:
    """Return the pose that a picture was taken in; None where the robot cannot get there now."""
    path_m = world.path_m(picture.pose.point)
    if path_m is None:
        return None
    kind = CandidateKind.PICTURED
    return _certain(kind, picture.id, picture.pose, path_m, name=picture.id)


def _certain(
    kind: CandidateKind, candidate_id: str, pose: Pose, path_m: float, *, name: str
) -> SearchCandidate:
    """Return a candidate that comes before all that are only likely."""
    return SearchCandidate(
        kind=kind,
        id=candidate_id,
        pose=pose,
        area_m2=0.0,
        path_m=path_m,
        score=1.0,
        rate=math.inf,
        name=name,
    )


def _frontiers(
    world: WorldModel, seen: Mask, half_rad: float, opinions: Opinions, near: list[Point]
) -> Iterator[SearchCandidate]:
    frontiers = world.frontiers.frontiers
    if not frontiers:
        return
    places = np.array([[each.pose.x, each.pose.y] for each in frontiers])
    areas_m2 = floor_by_heading(world.grid, ~seen, places, half_rad, reach_m=REACH_M)
    for frontier, by_heading in zip(frontiers, areas_m2, strict=True):
        unseen_m2 = float(by_heading[heading_index(frontier.pose.yaw_rad)])
        yield _rated(
            world,
            CandidateKind.FRONTIER,
            frontier.pose,
            area_m2=unseen_m2 + UNKNOWN_WEIGHT * frontier.gain_m2,
            path_m=frontier.distance_m,
            opinions=opinions,
            near=near,
            frontier=frontier,
        )


def _unseen(
    world: WorldModel, seen: Mask, half_rad: float, opinions: Opinions, near: list[Point]
) -> Iterator[SearchCandidate]:
    """Return the best heading at each of many places from which something unseen is in view."""
    # The robot may turn where it is.
    points, path_m = spread_places(world)
    places = np.concatenate([np.array([[world.robot.x, world.robot.y]]), points])
    ways_m = np.concatenate([np.zeros(1), path_m])
    areas_m2 = floor_by_heading(world.grid, ~seen, places, half_rad, reach_m=REACH_M)
    best = areas_m2.argmax(axis=1)
    for place, path_m, index, by_heading in zip(places, ways_m, best, areas_m2, strict=True):
        area_m2 = float(by_heading[index])
        if area_m2 >= LEAST_AREA_M2:
            yaw_rad = heading_rad(int(index))
            yield _rated(
                world,
                CandidateKind.UNSEEN,
                Pose(float(place[0]), float(place[1]), yaw_rad),
                area_m2=area_m2,
                path_m=float(path_m),
                opinions=opinions,
                near=near,
            )


def _rated(
    world: WorldModel,
    kind: CandidateKind,
    pose: Pose,
    *,
    area_m2: float,
    path_m: float,
    opinions: Opinions,
    near: list[Point],
    frontier: Frontier | None = None,
) -> SearchCandidate:
    looks_at = frontier.anchor if frontier else pose.transform(Point(REACH_M / 2, 0.0))
    own_id = frontier.id if frontier else f"({pose.x:.1f}, {pose.y:.1f})"
    # Finding rooms is slow, and not needed without an opinion of any.
    room_id = world.find_room_id(looks_at) if opinions.speaks_of_rooms else None
    score = opinions.score_at(looks_at, ids=(own_id, room_id or ""))
    if any(point.distance_to(looks_at) <= NEAR_M for point in near):
        score = max(score, MAY_BE_NEAR)
    turn_rad = abs(wrap_angle(pose.yaw_rad - world.robot.yaw_rad)) if path_m < STOP_M else 0.0
    cost_m = path_m + STOP_M + TURN_M * turn_rad / math.pi
    return SearchCandidate(
        kind=kind,
        id=own_id,
        pose=pose,
        area_m2=area_m2,
        path_m=path_m,
        score=score,
        rate=area_m2 * weight_of(score) / cost_m,
        frontier=frontier,
    )
