"""Looks that should have shown a thing and did not, and things that stand elsewhere since."""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime

import numpy as np

from mapspeak.geometry import Point, wrap_angle
from mapspeak.memory.consistency.findings import FindingKind, MemoryFinding, judge_trust
from mapspeak.memory.merging import NEAR_M, SAME_BEARING_RAD, find_cone, find_named
from mapspeak.memory.things.finding import Things
from mapspeak.memory.things.labels import group_names, name_the_same
from mapspeak.memory.things.thing import Thing
from mapspeak.memory.waypoint import Landmark, SemanticMap, Waypoint
from mapspeak.spatial.grid import FloatArray

LEAST_SHOWN_RATIO = 0.25
"""A look that shows a thing less likely says nothing of it."""
MOVED_RATIO = 0.5
"""A thing that later looks leave less likely may be the one of its name that is seen elsewhere."""


def check_unseen(
    places: SemanticMap, found: Things, placed: Sequence[Thing], at: FloatArray
) -> Iterator[MemoryFinding]:
    """Return things that looks should have shown, and those that may have been moved.

    Args:
        placed: The things with a position.
        at: Where these are, shape (n, 2), metres.
    """
    by_name = {each.name: each for each in places.waypoints}
    owners = {
        (view.waypoint, view.landmark): thing for thing in placed for view in thing.supporting
    }
    unseen = [finding for thing in placed for finding in _missed(thing, by_name)]
    for waypoint in places.waypoints:
        unseen += _not_shown(found, waypoint, placed, at, owners)
    yield from unseen
    yield from _moved(placed, unseen)


def _missed(thing: Thing, by_name: Mapping[str, Waypoint]) -> Iterator[MemoryFinding]:
    """Return the places it was once seen from, whose later looks did not name it."""
    for view in thing.supporting:
        look = by_name.get(view.waypoint)
        if look is not None and view.landmark.n_missed and _is_later(look, thing.last_seen):
            yield MemoryFinding(
                kind=FindingKind.NOT_SEEN,
                waypoints=(view.waypoint,),
                things=(thing,),
                far_m=view.far_m,
                n_since=view.landmark.n_missed,
            )


def _is_later(look: Waypoint, last_seen: datetime | None) -> bool:
    if look.recorded_at is None or last_seen is None:
        return False
    return look.recorded_at > last_seen


def _not_shown(
    found: Things,
    waypoint: Waypoint,
    placed: Sequence[Thing],
    at: FloatArray,
    owners: Mapping[tuple[str, Landmark], Thing],
) -> Iterator[MemoryFinding]:
    """Return unnamed things that a waypoint shows within the cone of what it names."""
    cone = find_cone(waypoint)
    if cone is None:
        return
    pose, named = waypoint.pose, find_named(waypoint)
    near = np.flatnonzero(np.hypot(*(at - (pose.x, pose.y)).T) <= NEAR_M).tolist()
    shown = _measure_shown(found, waypoint, [placed[i] for i in near], cone)
    for i, shown_ratio in zip(near, shown.tolist(), strict=True):
        thing, point = placed[i], Point(*at[i].tolist())
        bearing_rad = wrap_angle(pose.point.bearing_to(point) - pose.yaw_rad)
        if shown_ratio < LEAST_SHOWN_RATIO or _is_told(thing, waypoint, named, bearing_rad, owners):
            continue
        yield MemoryFinding(
            kind=FindingKind.NOT_SEEN,
            waypoints=(waypoint.name,),
            things=(thing,),
            far_m=pose.point.distance_to(point),
            n_since=int(_is_later(waypoint, thing.last_seen)),
            shown_ratio=shown_ratio,
        )


def _is_told(
    thing: Thing,
    waypoint: Waypoint,
    named: Sequence[Landmark],
    bearing_rad: float,
    owners: Mapping[tuple[str, Landmark], Thing],
) -> bool:
    """Return True when a waypoint names what may be a thing, or itself counts that it does not.

    Args:
        bearing_rad: From the waypoint's heading to the thing.
    """
    return any(
        _may_be(thing, each, bearing_rad, owners.get((waypoint.name, each))) for each in named
    ) or any(view.waypoint == waypoint.name and view.landmark.n_missed for view in thing.supporting)


def _may_be(thing: Thing, landmark: Landmark, bearing_rad: float, owner: Thing | None) -> bool:
    """Return True for a landmark that may be a thing, and is not of another one seen elsewhere."""
    is_ahead = (
        landmark.bearing_rad is None
        or abs(wrap_angle(landmark.bearing_rad - bearing_rad)) <= SAME_BEARING_RAD
    )
    is_others = owner is not None and owner is not thing and len(owner.waypoints) > 1
    return is_ahead and not is_others and name_the_same(landmark.label, thing.label)


def _measure_shown(
    found: Things, waypoint: Waypoint, things: Sequence[Thing], cone: tuple[float, float]
) -> FloatArray:
    """Return how likely a look shows each thing: over all that it may be, near, ahead, in sight."""
    spots = [np.empty((0, 2)) if each.whereabouts is None else each.whereabouts for each in things]
    points = np.concatenate([np.empty((0, 2)), *spots])
    pose = waypoint.pose
    east, north = (points - (pose.x, pose.y)).T
    off_rad = np.remainder(np.arctan2(north, east) - pose.yaw_rad + np.pi, 2 * np.pi) - np.pi
    is_ahead = (cone[0] <= off_rad) & (off_rad <= cone[1]) & (np.hypot(east, north) <= NEAR_M)
    in_sight = is_ahead * found.find_sight_ratios(waypoint, points)
    n_spots = np.array([len(each) for each in spots], dtype=np.intp)
    sums = np.bincount(
        np.repeat(np.arange(len(spots)), n_spots), weights=in_sight, minlength=len(spots)
    )
    return sums / np.maximum(n_spots, 1)


def _moved(placed: Sequence[Thing], unseen: Sequence[MemoryFinding]) -> Iterator[MemoryFinding]:
    """Return pairs of a thing that is gone and the only one of its name that is new since."""
    against: defaultdict[int, list[MemoryFinding]] = defaultdict(list)
    for finding in unseen:
        for thing in finding.things:
            against[id(thing)].append(finding)
    gone = {
        id(thing)
        for thing in placed
        if any(each.n_since for each in against[id(thing)])
        and judge_trust(thing, against[id(thing)]).ratio < MOVED_RATIO
    }
    pairs = [
        (old, new)
        for alike in _group_by_name(placed)
        for old in alike
        for new in alike
        if id(old) in gone and id(new) not in gone and _is_newer(new, old)
        if name_the_same(old.label, new.label)
    ]
    n_pairs = Counter(id(thing) for pair in pairs for thing in pair)
    for old, new in pairs:
        if n_pairs[id(old)] == n_pairs[id(new)] == 1:
            yield MemoryFinding(
                kind=FindingKind.MOVED, waypoints=new.waypoints[:1], things=(old, new)
            )


def _group_by_name(things: Sequence[Thing]) -> Iterator[list[Thing]]:
    """Return things in groups, so that two that may be one are in the same."""
    by_label: defaultdict[str, list[Thing]] = defaultdict(list)
    for thing in things:
        by_label[thing.label].append(thing)
    for group in group_names(list(by_label)):
        yield [thing for label in sorted(group) for thing in by_label[label]]


def _is_newer(new: Thing, old: Thing) -> bool:
    if new.first_seen is None or old.last_seen is None:
        return False
    return new.first_seen > old.last_seen
