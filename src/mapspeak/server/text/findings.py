"""What is odd about remembered places and things, in words: why they are trusted, or less."""

import math

from mapspeak.geometry import Point
from mapspeak.memory.consistency.findings import FindingKind, MemoryFinding, Trust
from mapspeak.memory.quoting import quote_name
from mapspeak.memory.things.thing import Thing, View

FARTHEST_M = 1e6


def say_trust(trust: Trust) -> list[str]:
    """Say who speaks for a thing or a place, then what speaks against it."""
    views = [] if trust.thing is None else [_say_views(trust.thing)]
    return [*views, *map(say_finding, trust.findings)]


def _say_views(thing: Thing) -> str:
    names = ", ".join(map(quote_name, thing.waypoints))
    n_views = len(thing.supporting)
    views = "" if n_views == len(thing.waypoints) else f" in {n_views} views"
    return f"Seen from {len(thing.waypoints)}{views}: {names}."


def say_support(view: View) -> str:
    """Say why a view speaks for a thing."""
    if view.far_m is None or view.off_rad is None:
        return "names it, without a direction"
    range_m = view.landmark.range_m
    told = "" if range_m is None else f", told as {range_m:.1f} m"
    return f"saw it {view.far_m:.1f} m away{told}, {math.degrees(view.off_rad):.0f} deg off"


def say_conflict(view: View) -> str:
    """Say why a view speaks against a thing."""
    off_deg = math.degrees(view.off_rad or 0.0)
    return f"has it in plain sight, but points {off_deg:.0f} deg past it"


def say_finding(finding: MemoryFinding) -> str:
    """Say what is odd, with numbers."""
    if finding.kind is FindingKind.TWO_LABELS:
        one, other = (f"{_say_thing(each)} by {_count_views(each)}" for each in finding.things)
        return f"In one place stand a {one} and a {other}."
    if finding.kind is FindingKind.DUPLICATE:
        one, other = map(quote_name, finding.waypoints)
        return f"{one} and {other} stand {finding.far_m:.2f} m apart and name the same things."
    said = _say_of_place(finding) if finding.label is None else _say_of_landmark(finding)
    return f"{said}."


def _say_of_place(finding: MemoryFinding) -> str:
    told, here = finding.ids or ("", "")
    at = "" if finding.at is None else _say_point(finding.at)
    thing = next(map(_say_thing, finding.things), "")
    said = {
        FindingKind.OTHER_MAP: (
            f"belongs to the map {quote_name(told)}, but the robot is on {quote_name(here)}"
        ),
        FindingKind.OFF_MAP: f"stands at {at}, off the map",
        FindingKind.IN_OBSTACLE: f"stands at {at}, where the map has an obstacle now",
        FindingKind.IN_UNKNOWN: f"stands at {at}, where nobody has seen the floor",
        FindingKind.UNREACHABLE: (
            f"stands at {at}, where a robot of {finding.radius_m or 0.0:.2f} m radius cannot get "
            "to now"
        ),
        FindingKind.WRONG_ROOM: f"is filed under {told}, but stands in {here}",
        FindingKind.NOT_SEEN: (
            f"looked to where the {thing} should be, {finding.far_m or 0.0:.1f} m away, and does "
            "not name it"
        ),
    }
    return f"{quote_name(finding.waypoints[0])} {said[finding.kind]}"


def _say_of_landmark(finding: MemoryFinding) -> str:
    place = quote_name(finding.waypoints[0])
    if finding.view is not None:
        return f"{place} {say_conflict(finding.view)}, the {_say_thing(finding.things[0])}"
    what = f"{quote_name(finding.label or '')} of {place}"
    if finding.ids is not None:
        there, start = finding.ids
        return f"{what} lies in {there}, which no door on the line from {start} opens to"
    if finding.kind is FindingKind.THROUGH_UNKNOWN:
        return f"{what}: the line to it leaves the seen floor after {finding.open_m:.1f} m"
    return (
        f"{what}: it is told as {finding.told_m:.1f} m away, behind a wall at "
        f"{finding.open_m:.1f} m"
    )


def _say_thing(thing: Thing) -> str:
    at = "" if thing.position is None else f" at ({thing.position.x:.2f}, {thing.position.y:.2f})"
    return f"{quote_name(thing.label)}{at}"


def _count_views(thing: Thing) -> str:
    n = len(thing.supporting)
    return "one view" if n == 1 else f"{n} views"


def _say_point(point: Point) -> str:
    is_near = max(abs(point.x), abs(point.y)) < FARTHEST_M
    return f"({point.x:.2f}, {point.y:.2f})" if is_near else f"({point.x:g}, {point.y:g})"
