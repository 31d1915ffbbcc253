"""One place seen again: what is new joins what was remembered, thing by thing.

A landmark that is not named this time is kept, with the time it was last seen: an observer who
reports the dock today has not said that the extinguisher beside it is gone. The words for the place
itself, its description and its layout, are said anew as a whole.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.semantic.waypoint import Confidence, Landmark, Waypoint, name_key

__all__ = ["Merge", "Reunion", "merge_waypoint", "seen_from"]

SAME_BEARING_RAD = math.radians(30.0)
"""Two looks at one thing, each 10 degrees off as a rule, differ by less 19 times in 20."""
SAME_RANGE_RATIO = 0.5
"""Ranges of one thing differ by less than this share of the longer one."""
SAME_SPOT_M = 0.5
"""From so near by a thing 3 m away has the same bearing to 10 degrees."""

_WEIGHT = {Confidence.CERTAIN: 2, Confidence.LIKELY: 1, None: 1, Confidence.UNSURE: 0}


@dataclass(frozen=True, slots=True, kw_only=True)
class Reunion:
    """A landmark that was remembered and is seen again.

    Attributes:
        before: As it was remembered, as seen from the waypoint's new pose.
        after: As it is remembered from now on.
    """

    before: Landmark
    after: Landmark


@dataclass(frozen=True, slots=True, kw_only=True)
class Merge:
    """A waypoint written again, and what became of each landmark.

    Attributes:
        waypoint: As it is to be remembered.
        new: Landmarks that were not there before.
        merged: Landmarks that were, and are seen again.
        kept: Landmarks that were, and are not named this time; as seen from the new pose.
        gone: Landmarks that were, and are said to be gone.
    """

    waypoint: Waypoint
    new: tuple[Landmark, ...]
    merged: tuple[Reunion, ...]
    kept: tuple[Landmark, ...]
    gone: tuple[Landmark, ...]


def merge_waypoint(before: Waypoint | None, now: Waypoint, *, gone: Iterable[str] = ()) -> Merge:
    """Gives what is remembered of a place that is seen again.

    The same label near the same bearing is the same thing. Of its two looks the surer one counts,
    or the later of two equally sure ones; what that leaves open, the other fills in.

    Args:
        before: What was remembered under that name; None for a new place.
        now: What is seen.
        gone: Labels of things that are not there any more.
    """
    if before is None:
        return Merge(waypoint=now, new=now.landmarks, merged=(), kept=(), gone=())
    gone_keys = {name_key(label) for label in gone}
    old = [seen_from(before.dated(thing), before.pose, now.pose) for thing in before.landmarks]
    partner = dict(_pair(now.landmarks, old))
    joined = {j: _joined(old[i], now.landmarks[j]) for j, i in partner.items()}
    missed = [i for i in range(len(old)) if i not in partner.values()]
    kept = [i for i in missed if name_key(old[i].label) not in gone_keys]
    after = [joined.get(j, thing) for j, thing in enumerate(now.landmarks)]
    n_now, n_before = len(now.safety_landmarks), len(before.safety_landmarks)
    waypoint = replace(
        now,
        safety_landmarks=(*after[:n_now], *(old[i] for i in kept if i < n_before)),
        functional_landmarks=(*after[n_now:], *(old[i] for i in kept if i >= n_before)),
        geometric_features=now.geometric_features or before.geometric_features,
    )
    return Merge(
        waypoint=waypoint,
        new=tuple(thing for j, thing in enumerate(now.landmarks) if j not in joined),
        merged=tuple(Reunion(before=old[partner[j]], after=joined[j]) for j in sorted(joined)),
        kept=tuple(old[i] for i in kept),
        gone=tuple(old[i] for i in missed if i not in kept),
    )


def seen_from(landmark: Landmark, old: Pose, new: Pose) -> Landmark:
    """Gives a landmark with its bearing and range as from another pose.

    A range goes with a bearing into a point, and that moves exactly. A bearing alone, or a range
    alone, holds only within half a metre of where it was taken, and is left out beyond.
    """
    if old == new:
        return landmark
    moved_m = old.point.distance_to(new.point)
    bearing_rad, range_m = landmark.bearing_rad, landmark.range_m
    if bearing_rad is not None and range_m is not None:
        ahead = Point(range_m * math.cos(bearing_rad), range_m * math.sin(bearing_rad))
        there = new.inverse().transform(old.transform(ahead))
        bearing_rad, range_m = math.atan2(there.y, there.x), math.hypot(there.x, there.y)
    elif moved_m > SAME_SPOT_M:
        bearing_rad = range_m = None
    elif bearing_rad is not None:
        bearing_rad += old.yaw_rad - new.yaw_rad
    return replace(landmark, bearing_rad=bearing_rad, range_m=range_m)


def _pair(some: Sequence[Landmark], others: Sequence[Landmark]) -> list[tuple[int, int]]:
    """Pairs what is the same thing, the nearest bearings first."""
    likenesses = sorted(
        (turn_rad, i, j)
        for i, one in enumerate(some)
        for j, other in enumerate(others)
        if (turn_rad := _find_turn_rad(one, other)) is not None
    )
    pairs: list[tuple[int, int]] = []
    for _, i, j in likenesses:
        if all(i != other_i and j != other_j for other_i, other_j in pairs):
            pairs.append((i, j))
    return pairs


def _find_turn_rad(one: Landmark, other: Landmark) -> float | None:
    """Gives how far apart two looks at the same thing point; None for two things."""
    if name_key(one.label) != name_key(other.label):
        return None
    if one.range_m is not None and other.range_m is not None:
        longer_m = max(one.range_m, other.range_m)
        if abs(one.range_m - other.range_m) > SAME_RANGE_RATIO * longer_m:
            return None
    if one.bearing_rad is None or other.bearing_rad is None:
        return SAME_BEARING_RAD
    turn_rad = abs(wrap_angle(one.bearing_rad - other.bearing_rad))
    return turn_rad if turn_rad <= SAME_BEARING_RAD else None


def _joined(before: Landmark, now: Landmark) -> Landmark:
    """Gives one thing from two looks at it."""
    is_surer_before = _WEIGHT[before.confidence] > _WEIGHT[now.confidence]
    surer, other = (before, now) if is_surer_before else (now, before)
    is_equal = _WEIGHT[before.confidence] == _WEIGHT[now.confidence]
    return replace(
        now,
        label=surer.label,
        purpose=now.purpose or before.purpose,
        bearing_rad=other.bearing_rad if surer.bearing_rad is None else surer.bearing_rad,
        range_m=other.range_m if surer.range_m is None else surer.range_m,
        confidence=surer.confidence or (other.confidence if is_equal else None),
        note=now.note or before.note,
    )
