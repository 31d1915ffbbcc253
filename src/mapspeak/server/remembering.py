"""What a write changed in the memory, in words."""

import math
from collections.abc import Iterator

from mapspeak.geometry import wrap_angle
from mapspeak.semantic import Confidence, Landmark, Merge, Reunion, Waypoint
from mapspeak.server.wording import say_pose, shorten

__all__ = ["say_landmarks", "say_replaced"]

MOVED_M = 0.05
TURNED_RAD = math.radians(2.0)
"""A pose that differs by less is the same pose, estimated again."""


def say_landmarks(merge: Merge) -> Iterator[str]:
    """Gives what became of each landmark: "new sink, +20 deg, 1.5 m, likely"."""
    for landmark in merge.new:
        yield f"new {', '.join([landmark.label, *_measures(landmark)])}{_say_doubt(landmark)}"
    for reunion in merge.merged:
        after = reunion.after
        yield f"merged {after.label}: {_say_change(reunion)}{_say_doubt(after)}"
    for landmark in merge.kept:
        yield f"kept {', '.join([landmark.label, *_measures(landmark)])}: not named this time"
    for landmark in merge.gone:
        yield f"gone {landmark.label}"


def say_replaced(previous: Waypoint | None, now: Waypoint) -> Iterator[str]:
    """Gives what was known of the place itself and reads otherwise from now on."""
    if previous is None:
        return
    if previous.description != now.description:
        yield f"description {shorten(previous.description)!r}"
    moved_m = previous.pose.point.distance_to(now.pose.point)
    turned_rad = abs(wrap_angle(previous.pose.yaw_rad - now.pose.yaw_rad))
    if moved_m > MOVED_M or turned_rad > TURNED_RAD:
        away = f", {moved_m:.1f} m away" if moved_m > MOVED_M else ""
        yield f"pose {say_pose(previous.pose)}{away}"
    if previous.geometric_features != now.geometric_features:
        yield f"layout {shorten('; '.join(previous.geometric_features))!r}"


def _say_change(reunion: Reunion) -> str:
    before, after = reunion.before, reunion.after
    was, now = _measures(before), _measures(after)
    news = []
    if was != now:
        news.append(f"now {', '.join(now)}, was {', '.join(was) or 'a label alone'}")
    for name in ("purpose", "note"):
        old, new = getattr(before, name), getattr(after, name)
        if old != new:
            news.append(f"{name} now {new!r}" + ("" if old is None else f", was {old!r}"))
    return "; ".join(news) or "as before"


def _say_doubt(landmark: Landmark) -> str:
    is_unsure = landmark.confidence is Confidence.UNSURE
    return "; look again from nearer by to be sure" if is_unsure else ""


def _measures(landmark: Landmark) -> list[str]:
    """Gives what was measured or judged of a landmark, each in a word or two."""
    parts = []
    if landmark.bearing_rad is not None:
        parts.append(f"{math.degrees(landmark.bearing_rad):+.0f} deg")
    if landmark.range_m is not None:
        parts.append(f"{landmark.range_m:.1f} m")
    if landmark.confidence is not None:
        parts.append(str(landmark.confidence))
    return parts
