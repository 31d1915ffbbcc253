"""Whether records agree with each other: twins, two names in one place, what one did not see."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from mapspeak.geometry import wrap_angle
from mapspeak.semantic.consistency.findings import Finding, FindingKind
from mapspeak.semantic.quoting import quote_name
from mapspeak.semantic.things import Thing, Things, name_the_same
from mapspeak.semantic.waypoint import SemanticMap, Waypoint
from mapspeak.spatial.grid import FloatArray

__all__ = ["check_company", "check_duplicates"]

TWIN_M = 0.3
TWIN_RAD = math.radians(15)
ONE_PLACE_M = 0.5
NEAR_M = 4.0
"""From no farther, who looks at a thing would name it."""
CONE_MARGIN_RAD = math.radians(5)


def check_duplicates(waypoints: Sequence[Waypoint]) -> Iterator[Finding]:
    """Gives pairs of waypoints with nearly the same pose and landmarks."""
    at = np.array([(each.pose.x, each.pose.y) for each in waypoints]).reshape(-1, 2)
    for i, waypoint in enumerate(waypoints):
        for j in np.flatnonzero(np.hypot(*(at[:i] - at[i]).T) <= TWIN_M).tolist():
            other = waypoints[j]
            turn_rad = abs(wrap_angle(waypoint.pose.yaw_rad - other.pose.yaw_rad))
            named = _labels(waypoint)
            if turn_rad <= TWIN_RAD and named and named == _labels(other):
                yield Finding(
                    kind=FindingKind.DUPLICATE,
                    sentence=f"{quote_name(other.name)} and {quote_name(waypoint.name)} stand "
                    f"{other.pose.point.distance_to(waypoint.pose.point):.2f} m apart and name "
                    "the same things.",
                    waypoints=(other.name, waypoint.name),
                )


def check_company(places: SemanticMap, found: Things) -> Iterator[Finding]:
    """Gives things that some records speak against."""
    placed = [thing for thing in found.things if thing.position is not None]
    at = np.array([(t.position.x, t.position.y) for t in placed if t.position]).reshape(-1, 2)
    yield from _two_labels(placed, at)
    for thing in placed:
        for view in thing.conflicting:
            yield Finding(
                kind=FindingKind.POINTS_PAST,
                sentence=f"{quote_name(view.waypoint)} {view.why}, the {_say(thing)}.",
                waypoints=(view.waypoint,),
                label=view.landmark.label,
                things=(thing,),
            )
    for waypoint in places.waypoints:
        yield from _not_seen(found, waypoint, placed, at)


def _two_labels(placed: Sequence[Thing], at: FloatArray) -> Iterator[Finding]:
    """Gives things of different names in one place that nobody has seen beside each other."""
    for i, thing in enumerate(placed):
        for j in np.flatnonzero(np.hypot(*(at[:i] - at[i]).T) <= ONE_PLACE_M).tolist():
            other = placed[j]
            is_seen_beside = set(thing.waypoints) & set(other.waypoints)
            if not is_seen_beside and not name_the_same(thing.label, other.label):
                yield Finding(
                    kind=FindingKind.TWO_LABELS,
                    sentence=f"In one place stand a {_say(other)} by {_count(other)} and a "
                    f"{_say(thing)} by {_count(thing)}.",
                    waypoints=(*other.waypoints, *thing.waypoints),
                    things=(other, thing),
                )


def _not_seen(
    found: Things, waypoint: Waypoint, placed: Sequence[Thing], at: FloatArray
) -> Iterator[Finding]:
    """Gives things in plain sight between what a waypoint names, which it does not name."""
    seen = waypoint.standpoints[0].landmarks
    bearings = [each.bearing_rad for each in seen if each.bearing_rad is not None]
    if len(bearings) < 2:
        return
    low, high = min(bearings) - CONE_MARGIN_RAD, max(bearings) + CONE_MARGIN_RAD
    pose = waypoint.pose
    for i in np.flatnonzero(np.hypot(*(at - (pose.x, pose.y)).T) <= NEAR_M).tolist():
        thing = placed[i]
        assert thing.position is not None, "these have a place"  # noqa: S101 - our belief
        bearing_rad = wrap_angle(pose.point.bearing_to(thing.position) - pose.yaw_rad)
        is_named = any(name_the_same(each.label, thing.label) for each in waypoint.landmarks)
        if (
            low <= bearing_rad <= high
            and not is_named
            and found.is_in_plain_sight(waypoint, thing.position)
        ):
            yield Finding(
                kind=FindingKind.NOT_SEEN,
                sentence=f"{quote_name(waypoint.name)} looked to where the {_say(thing)} should "
                f"be, {pose.point.distance_to(thing.position):.1f} m away, and does not name it.",
                waypoints=(waypoint.name,),
                things=(thing,),
            )


def _labels(waypoint: Waypoint) -> list[str]:
    return sorted(each.label.casefold() for each in waypoint.landmarks)


def _say(thing: Thing) -> str:
    assert thing.position is not None, "these have a place"  # noqa: S101 - our belief
    return f"{quote_name(thing.label)} at ({thing.position.x:.2f}, {thing.position.y:.2f})"


def _count(thing: Thing) -> str:
    n = len(thing.supporting)
    return "one view" if n == 1 else f"{n} views"
