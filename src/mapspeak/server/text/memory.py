"""The state of the memory and its events, as text; what was observed is quoted."""

import math
from collections.abc import Collection, Iterator, Sequence
from datetime import datetime

from mapspeak.driving.drivereport import Drive
from mapspeak.geometry import wrap_angle
from mapspeak.memory import Confidence, Landmark, Merge, Reunion, SemanticMap, Waypoint
from mapspeak.memory.consistency.findings import MemoryFinding
from mapspeak.memory.events import Event
from mapspeak.memory.frames import FrameId, Frames
from mapspeak.memory.quoting import quote, quote_name, tell_name
from mapspeak.places.recall.events import (
    OnWay,
    closes_robot_in,
    find_also_closed,
    find_cut_off,
    find_on_way,
    find_region_around,
)
from mapspeak.server.text.episodes import OBSERVED
from mapspeak.server.text.findings import say_finding, say_trust
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import list_some, say_count, say_pose, shorten
from mapspeak.worldmodel.model import WorldModel


def say_age(moment: datetime, now: datetime) -> str:
    """Return how long ago something was: "3 h ago"."""
    age_s = (now - moment).total_seconds()
    for unit, length_s in (("d", 86_400), ("h", 3600), ("min", 60)):
        if age_s >= 2 * length_s:
            return f"{age_s / length_s:.0f} {unit} ago"
    return f"{max(age_s, 0):.0f} s ago"


def say_loaded(found: SemanticMap, placed: SemanticMap, *, robot: str, now: datetime | None) -> str:
    """Say what was remembered before, how old it is, and how much of it is of this map.

    Args:
        found: As it was before.
        placed: As it is now, on the robot's map.
        robot: The name of this robot.
    """
    names = {each.name for each in found.waypoints} | {each.name for each in found.elsewhere}
    if not names:
        return ""
    elsewhere = [each for each in placed.elsewhere if each.name in names]
    times = [each.recorded_at for each in found.waypoints if each.recorded_at is not None]
    age = f", the last {say_age(max(times), now)}" if times and now is not None else ""
    by = _say_robots(placed.frames, {each.frame for each in found.waypoints}, robot)
    fits = "on this map"
    if len(elsewhere) == len(names):
        fits = "not on this map: none is used here"
    elif elsewhere:
        fits = f"on this map but for {len(elsewhere)} of other maps, which are left out"
    return f"Memory: {say_count(len(names), 'place')} remembered before{age}{by}, {fits}."


def _say_robots(frames: Frames, used: Collection[FrameId], robot: str) -> str:
    """Name the robots that made the maps of records, where that was noted."""
    robots = {each.robot for each in frames.items if each.id in used and each.robot}
    named = ("this robot" if each == robot else quote_name(each) for each in sorted(robots))
    return f", by {' and '.join(named)}" if robots else ""


MOST_LISTED = 30
MOST_OF_A_THING = 3
TO_MEND = (
    "To mend one: look again from there and call {write_semantic_data}, with gone for what is no "
    "longer there."
)


def describe_check(world: WorldModel, *, first: int) -> str:
    """Return what is odd about the memory: first by thing, the least trusted first, then the rest.

    Args:
        first: The number of the row to begin with, of both lists.
    """
    judge = world.judge
    findings = sorted(judge.findings, key=lambda finding: finding.weight)
    trusts = [(judge.judge_thing(each, now=world.now), each) for each in world.things]
    doubted = sorted(
        ((trust, each) for trust, each in trusts if trust.findings),
        key=lambda pair: (pair[0].ratio, int(pair[1].id[1:])),
    )
    told = [each for trust, _ in doubted for each in trust.findings[:MOST_OF_A_THING]]
    others = [each for each in findings if each not in told]
    n_once = sum(len(each.thing.supporting) == 1 for each in world.things)
    summary = (
        f"{say_count(len(world.places), 'place')} and {say_count(len(world.things), 'thing')} "
        f"remembered, {n_once} of these seen from one place only; "
        f"{say_count(len(findings), 'finding')}. A finding lowers trust and takes nothing away."
    )
    lines = [
        *(summary, OBSERVED),
        *_rows(
            "Things with something against them, least trusted first",
            [
                f"{each.id} {quote(each.thing.label)}, trust {trust.ratio:.2f}: "
                f"{' '.join(say_trust(trust)[: 1 + MOST_OF_A_THING])}"
                for trust, each in doubted[first : first + MOST_LISTED]
            ],
            n_all=len(doubted),
            first=first,
        ),
        *_rows(
            f"{'Other findings' if doubted else 'Findings'}, the gravest first",
            [_say_finding(each) for each in others[first : first + MOST_LISTED]],
            n_all=len(others),
            first=first,
        ),
        lead(TO_MEND) if findings else "Nothing is odd.",
    ]
    return "\n".join(lines)


def _rows(heading: str, rows: list[str], *, n_all: int, first: int) -> Iterator[str]:
    if not n_all:
        return
    shown = f"{first + 1} to {first + len(rows)} of {n_all}" if rows else f"none of {n_all}"
    yield f"## {heading} (showing {shown})"
    yield from rows


def _say_finding(finding: MemoryFinding) -> str:
    return f"{finding.kind.replace('_', ' ')}: {say_finding(finding)}"


ON_WAY = {
    OnWay.AT_GOAL: "{} ends: its goal lies there.",
    OnWay.LED_ROUND: "{} is led round it.",
    OnWay.NO_WAY_ROUND: "{} has no way round and ends before it.",
}


def say_consequences(world: WorldModel, event: Event, now: datetime, drive: Drive | None) -> str:
    """Say what an event that closes floor means for the robot, where it stands or drives now."""
    if closes_robot_in(world, event, now):
        return "The robot stands inside: it has to drive out before that begins."
    told, cut_off = [say_also_closed(world, event, now)], find_cut_off(world, event, now)
    if region_id := find_region_around(world, event):
        told.append(f"That is not all of {region_id}: for all of it give {region_id} as place.")
    if drive is not None and (means := find_on_way(world, event, drive.goal.point, now)):
        told.append(ON_WAY[means].format(f"{drive.goal_id} to {drive.place}"))
    if cut_off:
        told.append(f"While it lasts the robot cannot get to {', '.join(cut_off)} from here.")
    return " ".join(filter(None, told))


def say_also_closed(world: WorldModel, event: Event, now: datetime) -> str:
    """Say what else closes the place of an event; empty where nothing does."""
    titles = [f"the {each.title}" for each in find_also_closed(world.map, event, now)]
    return f"Closed there, too: {' and '.join(titles)}." if titles else ""


MOST_KEPT = 6
MOVED_M = 0.05
FAR_M = 3.0
"""Looks at one place are taken from no farther apart: a corridor of 35 m is one room, too."""
TURNED_RAD = math.radians(2.0)
"""A pose that differs by less is the same pose, estimated again."""


def say_landmarks(merge: Merge) -> Iterator[str]:
    """Return what became of each landmark: 'new "sink", +20 deg, 1.5 m, likely'."""
    for landmark in merge.new:
        said = ", ".join([quote_name(landmark.label), *_measures(landmark)])
        yield f"new {said}{_say_doubt(landmark)}"
    for reunion in merge.merged:
        after = reunion.after
        yield f"merged {quote_name(after.label)}: {_say_change(reunion)}{_say_doubt(after)}"
    if kept := [quote_name(views[0].label) for views in merge.kept]:
        yield f"kept, not named this time: {list_some(kept, most=MOST_KEPT)}"
    for landmark in merge.gone:
        yield f"gone {quote_name(landmark.label)}"


def say_replaced(previous: Waypoint | None, now: Waypoint) -> Iterator[str]:
    """Return what was known of the place itself and reads otherwise from now on."""
    if previous is None:
        return
    if previous.description != now.description:
        yield f"description {quote(shorten(previous.description))}"
    moved_m = previous.pose.point.distance_to(now.pose.point)
    turned_rad = abs(wrap_angle(previous.pose.yaw_rad - now.pose.yaw_rad))
    if moved_m > MOVED_M or turned_rad > TURNED_RAD:
        away = f", {moved_m:.1f} m away" if moved_m > MOVED_M else ""
        yield f"pose {say_pose(previous.pose)}{away}"
    if previous.geometric_features != now.geometric_features:
        yield f"layout {quote(shorten('; '.join(previous.geometric_features)))}"


def say_far(previous: Waypoint, now: Waypoint, *, rooms: Sequence[str | None]) -> list[str]:
    """Warn where a name was noted so far from before that another place may be meant.

    Args:
        previous: As it was remembered.
        now: As it is from now on.
        rooms: The rooms that the earlier and the later pose lie in, by id.
    """
    before, after = (room or "no room" for room in rooms)
    at, away_m = previous.pose, previous.pose.point.distance_to(now.pose.point)
    if before == after and away_m <= FAR_M:
        return []
    said = f"{quote_name(now.name)} moved {away_m:.1f} m: noted from {after} now, from {before}"
    advice = "If that is another place, write it under a name of its own."
    back = f"To leave it where it was, write it again with x {at.x:.2f}, y {at.y:.2f}."
    return [f"{said} before. {advice} {back}"]


def _say_change(reunion: Reunion) -> str:
    before, after = reunion.before, reunion.after
    was, now = _measures(before), _measures(after)
    news = []
    if was != now:
        unknown = "seen from elsewhere" if reunion.further else "a label alone"
        news.append(f"now {', '.join(now)}, was {', '.join(was) or unknown}")
    news += _say_number((after, *reunion.further))
    for name in ("purpose", "note"):
        old, new = getattr(before, name), getattr(after, name)
        if old != new:
            news.append(f"{name} now {_say(new)}" + ("" if old is None else f", was {_say(old)}"))
    return "; ".join(news) or "as before"


def _say(text: str | None) -> str:
    return "none" if text is None else quote(text)


def _say_number(views: Sequence[Landmark]) -> list[str]:
    return [f"{len(views)} views of it"] if len(views) > 1 else []


def _say_doubt(landmark: Landmark) -> str:
    is_unsure = landmark.confidence is Confidence.UNSURE
    return "; look again from nearer by to be sure" if is_unsure else ""


def _measures(landmark: Landmark) -> list[str]:
    """Return what was measured or judged of a landmark, each in a word or two."""
    parts = []
    if landmark.bearing_rad is not None:
        parts.append(f"{math.degrees(landmark.bearing_rad):+.0f} deg")
    if landmark.range_m is not None:
        by = f" by the {tell_name(landmark.range_from)}" if landmark.range_from else ""
        parts.append(f"{landmark.range_m:.1f} m{by}")
    if landmark.confidence is not None:
        parts.append(str(landmark.confidence))
    if landmark.pose is not None:
        parts.append(f"seen from {say_pose(landmark.pose)}")
    return parts
