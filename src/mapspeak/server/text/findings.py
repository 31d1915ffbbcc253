"""What is odd about a memory, in words: why its entries are trusted, and whose map they are on."""

import math
from collections.abc import Awaitable

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point
from mapspeak.memory.alignment.comparing import MapComparison, MapRelation
from mapspeak.memory.alignment.fitting import (
    LEAST_SHARED_M,
    Certainty,
    MapFit,
)
from mapspeak.memory.alignment.keeping import RealignReceipt
from mapspeak.memory.alignment.surfaces import (
    MapAgreement,
)
from mapspeak.memory.consistency.findings import FindingKind, MemoryFinding, Trust
from mapspeak.memory.quoting import quote_name
from mapspeak.memory.things.thing import Thing, View
from mapspeak.server.text.offered import lead

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


def say_guess(radius_m: float) -> str:
    """Say how well a place is known that is told by one direction alone."""
    return (
        f"a guess good to {radius_m:.1f} m: of one direction and no range, put at the wall or "
        "furniture there"
    )


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
    if finding.kind is FindingKind.MOVED:
        old, new = map(_say_thing, finding.things)
        return f"The {new} may be the {old}, which later looks do not show: it may have been moved."
    if finding.kind is FindingKind.AGED:
        age, half_life = map(_say_duration, (finding.age_s, finding.half_life_s))
        thing = _say_thing(finding.things[0])
        return f"The {thing} was last seen {age} ago; half of such things are moved in {half_life}."
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
            f"not name it{_say_since(finding.n_since)}"
        ),
    }
    return f"{quote_name(finding.waypoints[0])} {said[finding.kind]}"


def _say_duration(duration_s: float) -> str:
    hours = duration_s / 3600
    return f"{hours:.0f} h" if hours < 2 * 24 else f"{hours / 24:.0f} days"


def _say_since(n_since: int) -> str:
    """Say that a thing was not there at so many looks after it was seen last."""
    if not n_since:
        return ""
    return ", after it was seen last" + (f": the last {n_since} looks" if n_since > 1 else "")


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


async def say_moved(comparing: Awaitable[MapComparison | None]) -> str:
    """Say what to do where the memory belongs to another map; empty where all is well."""
    try:
        comparison = await comparing
    except SemanticMapError as error:
        return str(error)
    if comparison is None:
        return ""
    todo = lead(AFTER_MOVE.get(comparison.relation, UNSURE))
    return f"{say_comparison(comparison)} {todo}"


_ALIGN = "Places remembered on another map are left out. {realign_memory} aligns it."
AFTER_MOVE = {
    MapRelation.SAME: _ALIGN,
    MapRelation.MOVED: _ALIGN,
    MapRelation.OTHER: "Places remembered on another map are left out: they mean nothing here.",
}
UNSURE = (
    "Places remembered on another map are left out. Let the robot see more, then call "
    "{realign_memory}."
)


def say_receipt(receipt: RealignReceipt) -> str:
    """Say what was moved, how the maps go together and how sure that is.

    Raises:
        SemanticMapError: Nothing was moved, since the maps do not tell surely enough how.
    """
    said, motion = say_comparison(receipt.comparison), receipt.motion
    if receipt.comparison.relation in (MapRelation.OTHER, MapRelation.UNKNOWN):
        raise SemanticMapError(
            f"The records stay where they are. {said}",
            hint="Let the robot see more of the building and try again, or use another file "
            "for this map.",
        )
    if motion is None or receipt.certainty is None:
        return f"Nothing had to be aligned. {said}"
    turn_deg = math.degrees(motion.yaw_rad)
    return (
        f"{receipt.n_waypoints} waypoints and {receipt.n_events} events more can be used here: "
        f"their map lies turned by {turn_deg:.1f} degrees, its origin at ({motion.x:.2f}, "
        f"{motion.y:.2f}). {said} Certainty: {receipt.certainty}."
    )


def say_comparison(comparison: MapComparison) -> str:
    """Say how the records' map and the robot's go together, with figures."""
    relation, fit = comparison.relation, comparison.fit
    figures = _say_agreement(comparison.as_it_lies)
    if fit is None and relation is MapRelation.SAME:
        return f"The map is the one that the records belong to: {figures}."
    if fit is None and relation is MapRelation.UNKNOWN:
        return (
            f"Whether this is the map that the records belong to cannot be told yet: one of the "
            f"two maps shows {comparison.shortest_m:.0f} m of walls, and {LEAST_SHARED_M:.0f} m "
            "are needed."
        )
    said = f"{_RELATIONS[relation]} As they lie, {figures}."
    return said if fit is None else f"{said} {_say_fit(fit)}"


_RELATIONS = {
    MapRelation.SAME: "The map is the one that the records belong to, with changes in it.",
    MapRelation.MOVED: "The building is the one that the records belong to, but its map has moved.",
    MapRelation.OTHER: "This map shows another building than the one that the records belong to, "
    "or another part of it.",
    MapRelation.UNKNOWN: "Whether this is the map that the records belong to cannot be told.",
}
_CERTAINTIES = {
    Certainty.SURE: "This is sure.",
    Certainty.LIKELY: "This is likely right.",
    Certainty.AMBIGUOUS: "The building looks alike in both places: which one is right cannot be "
    "told from its walls.",
    Certainty.UNSURE: "This is not enough to rely on.",
}


def _say_agreement(quality: MapAgreement) -> str:
    return (
        f"{quality.agreement_ratio:.0%} of the walls that both maps show agree "
        f"({quality.shared_m:.0f} m, {quality.overlap_ratio:.0%} of the smaller map)"
    )


def _say_fit(fit: MapFit) -> str:
    turn = f"turned by {math.degrees(fit.new_from_old.yaw_rad):.1f} degrees"
    said = (
        f"Laid on the new map {turn} and shifted so that its middle moves {fit.off_m:.2f} m, "
        f"{_say_placing(fit.quality)}"
    )
    rival = "no other place comes near"
    if fit.rival is not None:
        rival = f"in the next best place, {_say_placing(fit.rival)}"
    return f"{said}; {rival}. {_CERTAINTIES[fit.certainty]}"


def _say_placing(quality: MapAgreement) -> str:
    return (
        f"{quality.agreement_ratio:.0%} of the walls agree, of {quality.shared_m:.0f} m that both "
        f"maps show ({quality.overlap_ratio:.0%} of the smaller map)"
    )
