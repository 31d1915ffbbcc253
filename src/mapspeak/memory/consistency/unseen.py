"""Looks that should have shown a thing, and did not."""

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime

import numpy as np

from mapspeak.geometry import wrap_angle
from mapspeak.memory.consistency.findings import FindingKind, MemoryFinding
from mapspeak.memory.merging import NEAR_M, SAME_BEARING_RAD, find_cone, find_named
from mapspeak.memory.things.finding import Things
from mapspeak.memory.things.labels import name_the_same
from mapspeak.memory.things.thing import Thing
from mapspeak.memory.waypoint import SemanticMap, Waypoint
from mapspeak.spatial.grid import FloatArray

LEAST_SHARE_IN_SIGHT = 0.5
"""An observer with this share of a thing's possible positions in plain sight would see it."""


def check_unseen(
    places: SemanticMap, found: Things, placed: Sequence[Thing], at: FloatArray
) -> Iterator[MemoryFinding]:
    """Return things that looks should have shown, those later than their last sighting marked.

    Args:
        placed: The things with a position.
        at: Where these are, shape (n, 2), metres.
    """
    by_name = {each.name: each for each in places.waypoints}
    last_seen = [_find_last_seen(thing, by_name) for thing in placed]
    for thing, seen_at in zip(placed, last_seen, strict=True):
        yield from _missed(thing, seen_at, by_name)
    for waypoint in places.waypoints:
        yield from _not_seen(found, waypoint, placed, at, last_seen)


def _find_last_seen(thing: Thing, by_name: Mapping[str, Waypoint]) -> datetime | None:
    views = (
        by_name[view.waypoint].dated(view.landmark)
        for view in thing.supporting
        if view.waypoint in by_name
    )
    return max((each.recorded_at for each in views if each.recorded_at), default=None)


def _missed(
    thing: Thing, last_seen: datetime | None, by_name: Mapping[str, Waypoint]
) -> Iterator[MemoryFinding]:
    """Return the places it was once seen from, whose later looks did not name it."""
    for view in thing.supporting:
        look = by_name.get(view.waypoint)
        if look is not None and view.landmark.n_missed and _is_later(look, last_seen):
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


def _not_seen(
    found: Things,
    waypoint: Waypoint,
    placed: Sequence[Thing],
    at: FloatArray,
    last_seen: Sequence[datetime | None],
) -> Iterator[MemoryFinding]:
    """Return unnamed things in plain sight within the cone of what a waypoint names."""
    cone = find_cone(waypoint)
    if cone is None:
        return
    low, high = cone
    pose, named = waypoint.pose, find_named(waypoint)
    for i in np.flatnonzero(np.hypot(*(at - (pose.x, pose.y)).T) <= NEAR_M).tolist():
        thing = placed[i]
        assert thing.position is not None, "these have a place"  # noqa: S101 - our belief
        bearing_rad = wrap_angle(pose.point.bearing_to(thing.position) - pose.yaw_rad)
        is_named = any(
            name_the_same(each.label, thing.label)
            and (
                each.bearing_rad is None
                or abs(wrap_angle(each.bearing_rad - bearing_rad)) <= SAME_BEARING_RAD
            )
            for each in named
        )
        is_counted = any(
            view.waypoint == waypoint.name and view.landmark.n_missed for view in thing.supporting
        )
        if (
            low <= bearing_rad <= high
            and not (is_named or is_counted)
            and (
                found.is_in_plain_sight(waypoint, thing.position)
                or found.measure_share_in_sight(waypoint, thing) >= LEAST_SHARE_IN_SIGHT
            )
        ):
            yield MemoryFinding(
                kind=FindingKind.NOT_SEEN,
                waypoints=(waypoint.name,),
                things=(thing,),
                far_m=pose.point.distance_to(thing.position),
                n_since=int(_is_later(waypoint, last_seen[i])),
            )
