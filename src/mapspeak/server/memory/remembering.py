"""What a write changed in the memory, in words."""

import math
from collections.abc import Iterator, Sequence

from mapspeak.geometry import wrap_angle
from mapspeak.semantic import Confidence, Landmark, Merge, Reunion, Waypoint
from mapspeak.semantic.quoting import quote, quote_name, tell_name
from mapspeak.server.wording import say_pose, shorten

MOVED_M = 0.05
FAR_M = 5.0
"""Looks at one place are taken from no farther apart."""
TURNED_RAD = math.radians(2.0)
"""A pose that differs by less is the same pose, estimated again."""


def say_landmarks(merge: Merge) -> Iterator[str]:
    """Gives what became of each landmark: 'new "sink", +20 deg, 1.5 m, likely'."""
    for landmark in merge.new:
        said = ", ".join([quote_name(landmark.label), *_measures(landmark)])
        yield f"new {said}{_say_doubt(landmark)}"
    for reunion in merge.merged:
        after = reunion.after
        yield f"merged {quote_name(after.label)}: {_say_change(reunion)}{_say_doubt(after)}"
    for views in merge.kept:
        said = ", ".join([quote_name(views[0].label), *_measures(views[0]), *_say_number(views)])
        yield f"kept {said}: not named this time"
    for landmark in merge.gone:
        yield f"gone {quote_name(landmark.label)}"


def say_replaced(previous: Waypoint | None, now: Waypoint) -> Iterator[str]:
    """Gives what was known of the place itself and reads otherwise from now on."""
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


def say_far(previous: Waypoint | None, now: Waypoint, *, rooms: Sequence[str | None]) -> list[str]:
    """Warns where a name was noted so far from before that another place may be meant.

    Args:
        previous: As it was remembered.
        now: As it is from now on.
        rooms: The rooms that the earlier and the later pose lie in, by id.
    """
    if previous is None:
        return []
    before, after = (room or "no room" for room in rooms)
    away_m = previous.pose.point.distance_to(now.pose.point)
    if before == after and away_m <= FAR_M:
        return []
    said = f"was noted from {after} now, from {before} before, {away_m:.1f} m away."
    advice = "If that is another place, write it under a name of its own."
    return [f"{quote_name(now.name)} {said} {advice}"]


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
    """Gives what was measured or judged of a landmark, each in a word or two."""
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
