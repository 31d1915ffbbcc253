"""Merge a new look at a place with what was remembered, thing by thing.

A landmark that is not named this time is kept, with the pose and the time it was last seen from: an
observer who reports the dock today has not said that the extinguisher beside it is gone. A look at
a known thing from elsewhere is a further view of it, for two views tell where it is. The
description and layout of the place itself are replaced as a whole.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain

from mapspeak.geometry import Pose, wrap_angle
from mapspeak.memory.laserfan import SAME_STAND_M
from mapspeak.memory.quoting import name_key
from mapspeak.memory.waypoint import Confidence, Landmark, Waypoint

SAME_BEARING_RAD = math.radians(30.0)
"""Two looks at one thing, each usually 10 degrees off, differ by less 19 times in 20."""
SAME_RANGE_RATIO = 0.5
"""Ranges of one thing differ by less than this share of the longer one."""
SAME_SPOT_M = 0.5
"""Moving by less changes the bearing of a thing 3 m away by under 10 degrees."""
SAME_VIEW_RAD = math.radians(15.0)
"""A picture of a heading that much off still shows nearly all that is seen along the other."""
SAME_POSE_M = 0.05
"""A pose nearer than this is the same one, estimated again."""
LEAST_HALF_VIEW_RAD = math.radians(27.0)
"""Every usual camera of a robot shows this much to either side: depth cameras from 57 degrees."""
CONE_MARGIN_RAD = math.radians(5.0)
NEAR_M = 4.0
"""An observer looking at a thing from within this distance would name it."""
MOST_VIEWS = 4
"""Views kept per thing, about one per side a robot can come from; more add little."""

_WEIGHT = {Confidence.CERTAIN: 2, Confidence.LIKELY: 1, None: 1, Confidence.UNSURE: 0}

Views = tuple[Landmark, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reunion:
    """A remembered thing that is seen again.

    Attributes:
        before: As it was remembered, as seen from the new pose; the latest view, if of several.
        further: Views of it from elsewhere that are remembered besides, the latest first.
    """

    before: Landmark
    after: Landmark
    further: Views = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Merge:
    """A rewritten waypoint, and the outcome for each thing.

    Attributes:
        kept: Remembered things not named this time: all views of each, the latest first.
        gone: Remembered things reported gone; the latest view of each.
    """

    waypoint: Waypoint
    new: tuple[Landmark, ...]
    merged: tuple[Reunion, ...]
    kept: tuple[Views, ...]
    gone: tuple[Landmark, ...]


def merge_waypoint(before: Waypoint | None, now: Waypoint, *, gone: Iterable[str] = ()) -> Merge:
    """Merge a new look at a place with the remembered one.

    The same label near the same bearing is the same thing. Of its two looks from one spot the surer
    one counts, or the later of two equally sure ones; what that leaves open, the other fills in.
    Looks from different spots are both kept, `MOST_VIEWS` of them at most.
    """
    if before is None:
        return Merge(waypoint=now, new=now.landmarks, merged=(), kept=(), gone=())
    whole, before = before, before.present()
    gone_keys = {name_key(label) for label in gone}
    of_safety = _group(before, before.safety_landmarks)
    of_all = (*of_safety, *_group(before, before.functional_landmarks))
    old = [_dated_views(before, views) for views in of_all]
    looks = [replace(thing, pose=now.pose_of(thing)) for thing in now.landmarks]
    partner = dict(_pair(looks, old))
    united = {j: _noted(_united(looks[j], old[i]), now) for j, i in partner.items()}
    missed = [i for i in range(len(old)) if i not in partner.values()]
    lasting = [i for i in missed if name_key(old[i][0].label) not in gone_keys]
    kept = {i: _noted(_counted(old[i], before, now), now) for i in lasting}
    after = [united.get(j, (thing,)) for j, thing in enumerate(now.landmarks)]
    n_now, n_before = len(now.safety_landmarks), len(of_safety)
    safety = (*after[:n_now], *(views for i, views in kept.items() if i < n_before))
    functional = (*after[n_now:], *(views for i, views in kept.items() if i >= n_before))
    left = {i: _noted(_as_gone(old[i]), now) for i in missed if i not in kept}
    past = [
        _find_past(whole, each, now)
        for each in (whole.safety_landmarks, whole.functional_landmarks)
    ]
    waypoint = replace(
        now,
        safety_landmarks=(
            *chain.from_iterable(safety),
            *chain.from_iterable(views for i, views in left.items() if i < n_before),
            *past[0],
        ),
        functional_landmarks=(
            *chain.from_iterable(functional),
            *chain.from_iterable(views for i, views in left.items() if i >= n_before),
            *past[1],
        ),
        geometric_features=now.geometric_features or before.geometric_features,
    )
    return Merge(
        waypoint=waypoint,
        new=tuple(thing for j, thing in enumerate(now.landmarks) if j not in united),
        merged=tuple(_reunion(old[partner[j]], united[j], now) for j in sorted(united)),
        kept=tuple(kept.values()),
        gone=tuple(old[i][0] for i in missed if i not in kept),
    )


def group_views(waypoint: Waypoint) -> tuple[Views, ...]:
    """Group the landmarks of a place by thing: views of a label from different spots share one.

    Two of one label from one spot are two things, as are two in different positions.
    """
    return (
        *_group(waypoint, waypoint.safety_landmarks),
        *_group(waypoint, waypoint.functional_landmarks),
    )


def seen_from(landmark: Landmark, old: Pose, new: Pose) -> Landmark:
    """Return a landmark with its bearing and range as from another pose.

    A range goes with a bearing into a point, and that moves exactly. A bearing alone, or a range
    alone, holds only within half a metre of where it was taken, and is left out beyond. What the
    laser met holds only where it stood.
    """
    landmark = replace(landmark, pose=None)
    if old == new:
        return landmark
    moved_m = old.point.distance_to(new.point)
    bearing_rad, range_m, laser = landmark.bearing_rad, landmark.range_m, landmark.laser
    if bearing_rad is not None and range_m is not None:
        there = new.inverse().transform(old.point_at(bearing_rad, range_m))
        bearing_rad, range_m = math.atan2(there.y, there.x), math.hypot(there.x, there.y)
    elif moved_m > SAME_SPOT_M:
        bearing_rad = range_m = None
    elif bearing_rad is not None:
        bearing_rad += old.yaw_rad - new.yaw_rad
    if laser is not None:
        is_same_stand = moved_m <= SAME_STAND_M
        laser = laser.turned(old.yaw_rad - new.yaw_rad) if is_same_stand else None
    return replace(
        landmark,
        bearing_rad=bearing_rad,
        range_m=range_m,
        range_from=None if range_m is None else landmark.range_from,
        bearing_from=None if bearing_rad is None else landmark.bearing_from,
        laser=laser,
    )


def noted_at(landmark: Landmark, seen: Pose, pose: Pose) -> Landmark:
    """Return a landmark as a waypoint at a pose holds it: with its own pose if that differs.

    Args:
        landmark: With its bearing from where it was seen.
        seen: From where that was.
    """
    if not _is_measured(landmark) or seen.point.distance_to(pose.point) <= SAME_POSE_M:
        return seen_from(landmark, seen, pose)
    return replace(landmark, pose=seen)


def _group(waypoint: Waypoint, landmarks: Iterable[Landmark]) -> tuple[Views, ...]:
    groups: list[list[Landmark]] = []
    for landmark in landmarks:
        mine = (group for group in groups if _is_further_view(waypoint, landmark, group))
        group = next(mine, None)
        if group is None:
            groups.append([landmark])
        else:
            group.append(landmark)
    return tuple(map(tuple, groups))


def find_cone(look: Waypoint) -> tuple[float, float] | None:
    """Return the bearings between which a look must have shown everything; None for no such range.

    That is between the outermost things that it names, and in the middle of its picture.
    """
    bearings = [
        each.bearing_rad
        for each in find_named(look)
        if each.bearing_rad is not None and look.pose_of(each) == look.pose
    ]
    bearings = bearings if len(bearings) > 1 else []
    if look.picture is not None:
        bearings += [-LEAST_HALF_VIEW_RAD, LEAST_HALF_VIEW_RAD]
    if not bearings:
        return None
    return min(bearings) - CONE_MARGIN_RAD, max(bearings) + CONE_MARGIN_RAD


def find_named(look: Waypoint) -> list[Landmark]:
    """Return what a record names of its latest look, without what it keeps of earlier ones."""
    return [each for each in look.landmarks if not _is_of_earlier(each)]


def _is_of_earlier(landmark: Landmark) -> bool:
    return landmark.stamp_s is not None or landmark.recorded_at is not None


def _counted(views: Views, before: Waypoint, now: Waypoint) -> Views:
    """Return views of a thing that a look does not name: missed once more where it should."""
    told = (now.recorded_at, now.stamp_s)
    if now.recorded_at is not None and told == (before.recorded_at, before.stamp_s):
        # A record that is merged again is the same look and counts no second miss.
        return views
    latest, *others = views
    here = seen_from(latest, latest.pose or now.pose, now.pose)
    cone = find_cone(now)
    is_near = here.range_m is None or here.range_m <= NEAR_M
    if cone is None or here.bearing_rad is None or not is_near:
        return views
    is_shown = cone[0] <= wrap_angle(here.bearing_rad) <= cone[1]
    return (replace(latest, n_missed=latest.n_missed + is_shown), *others)


def _as_gone(views: Views) -> Views:
    return tuple(replace(each, is_gone=True) for each in views)


def _find_past(before: Waypoint, landmarks: Iterable[Landmark], now: Waypoint) -> Views:
    """Return what was gone before, but for what is seen again: that is there, as something new.

    With a forgotten place all that was seen from there is gone.
    """
    back = {name_key(each.label) for each in now.landmarks}
    gone = (each for each in landmarks if before.is_gone or each.is_gone)
    past = tuple(each for each in gone if name_key(each.label) not in back)
    return _noted(_dated_views(before, _as_gone(past)), now)


def _dated_views(waypoint: Waypoint, views: Views) -> Views:
    return tuple(replace(waypoint.dated(each), pose=waypoint.pose_of(each)) for each in views)


def _noted(views: Views, now: Waypoint) -> Views:
    """Return views as a waypoint holds them: without what it says of itself."""
    told = (now.stamp_s, now.recorded_at, now.picture)
    plain = (
        replace(view, stamp_s=None, recorded_at=None, picture=None)
        if (view.stamp_s, view.recorded_at, view.picture) == told
        else view
        for view in views
    )
    return tuple(noted_at(view, view.pose or now.pose, now.pose) for view in plain)


def _reunion(old: Views, after: Views, now: Waypoint) -> Reunion:
    before = seen_from(old[0], old[0].pose or now.pose, now.pose_of(after[0]))
    return Reunion(before=before, after=after[0], further=after[1:])


def _is_further_view(waypoint: Waypoint, view: Landmark, others: Sequence[Landmark]) -> bool:
    """Return True when a view may be of the same thing as others, each from another spot."""
    view, *seen = (replace(each, pose=waypoint.pose_of(each)) for each in (view, *others))
    return all(
        _is_measured(view)
        and _is_measured(other)
        and _apart_m(view, other) > SAME_SPOT_M
        and _find_turn_rad(view, other) is not None
        for other in seen
    )


def _pair(looks: Sequence[Landmark], things: Sequence[Views]) -> list[tuple[int, int]]:
    likenesses = sorted(
        (turn_rad, i, j)
        for i, look in enumerate(looks)
        for j, views in enumerate(things)
        if (turn_rad := _find_least_turn_rad(look, views)) is not None
    )
    pairs: list[tuple[int, int]] = []
    for _, i, j in likenesses:
        if all(i != other_i and j != other_j for other_i, other_j in pairs):
            pairs.append((i, j))
    return pairs


def _find_least_turn_rad(look: Landmark, views: Views) -> float | None:
    """Return how far a look points past a thing; None if it shows another thing.

    Views from the spot of the look decide, where there are any: those from elsewhere say less.
    """
    near = [view for view in views if _apart_m(look, view) <= SAME_SPOT_M]
    turns = [_find_turn_rad(look, view) for view in near or views]
    found = [turn for turn in turns if turn is not None]
    return min(found) if len(found) == len(turns) else None


def _find_turn_rad(one: Landmark, view: Landmark) -> float | None:
    """Return how far apart two looks at the same thing point, as from one pose; None for two."""
    if name_key(one.label) != name_key(view.label):
        return None
    other = _turned_to(view, one)
    if one.range_m is not None and other.range_m is not None:
        longer_m = max(one.range_m, other.range_m)
        if abs(one.range_m - other.range_m) > SAME_RANGE_RATIO * longer_m:
            return None
    if one.bearing_rad is None or other.bearing_rad is None:
        return SAME_BEARING_RAD
    turn_rad = abs(wrap_angle(one.bearing_rad - other.bearing_rad))
    return turn_rad if turn_rad <= SAME_BEARING_RAD else None


def _united(look: Landmark, views: Views) -> Views:
    """Return a thing's views with the present look first."""
    if _is_measured(look):
        joining = [v for v in views if _apart_m(look, v) <= SAME_SPOT_M or not _is_measured(v)]
    else:
        joining = [min(views, key=lambda view: _apart_m(look, view))]
    further = [view for view in views if view not in joining]
    for view in joining:
        look = _joined(view, look)
    if further:
        told = further[0]
        look = replace(look, purpose=look.purpose or told.purpose, note=look.note or told.note)
    return _best_apart([look, *further])


def _best_apart(views: Sequence[Landmark]) -> Views:
    left = list(views)
    while len(left) > MOST_VIEWS:
        pairs = ((i, j) for j in range(len(left)) for i in range(j))
        _, older = min(pairs, key=lambda pair: _apart_m(left[pair[0]], left[pair[1]]))
        del left[older]
    return tuple(left)


def _joined(before: Landmark, now: Landmark) -> Landmark:
    """Return one view from two looks at a thing, with the pose that its bearing is from."""
    is_surer_before = _WEIGHT[before.confidence] > _WEIGHT[now.confidence]
    is_equal = _WEIGHT[before.confidence] == _WEIGHT[now.confidence]
    surer, other = (before, now) if is_surer_before else (now, before)
    base = surer if _is_measured(surer) or not _is_measured(other) else other
    filling = _turned_to(before if base is now else now, base)
    return replace(
        now,
        label=surer.label,
        purpose=now.purpose or before.purpose,
        bearing_rad=filling.bearing_rad if base.bearing_rad is None else base.bearing_rad,
        range_m=filling.range_m if base.range_m is None else base.range_m,
        range_from=filling.range_from if base.range_m is None else base.range_from,
        bearing_from=filling.bearing_from if base.bearing_rad is None else base.bearing_from,
        confidence=surer.confidence or (other.confidence if is_equal else None),
        note=now.note or before.note,
        pose=base.pose,
        laser=filling.laser if base.bearing_rad is None else base.laser,
    )


def _turned_to(view: Landmark, other: Landmark) -> Landmark:
    """Return a view with its bearing and range as from where another one was seen."""
    return (
        view if view.pose is None or other.pose is None else seen_from(view, view.pose, other.pose)
    )


def _apart_m(one: Landmark, other: Landmark) -> float:
    assert one.pose is not None, "views have their pose here"  # noqa: S101 - our belief
    assert other.pose is not None, "views have their pose here"  # noqa: S101 - our belief
    return one.pose.point.distance_to(other.pose.point)


def _is_measured(landmark: Landmark) -> bool:
    return landmark.bearing_rad is not None or landmark.range_m is not None
