"""Which old pictures go: a rule, and the pure function that applies it."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from mapspeak.geometry import Pose

__all__ = ["StoredPicture", "ThinningRule", "choose_dropped"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ThinningRule:
    """What is kept of the pictures: all new ones, then one per place and hour, then per day.

    Observations themselves are never dropped, nor a picture that a record of the semantic map
    names. Hours and days are those of UTC, so that the answer is the same everywhere.

    Attributes:
        all_for: As old as this, every picture is kept.
        hourly_for: As old as this, one per place and hour is kept; older ones, per place and day.
        place_m: Edge of the squares that count as one place, in metres.
        place_rad: Width of the directions that count as one, in radians.
        limit_mb: How large all pictures may be; the oldest go first. Those that records name stay
            even above it.
    """

    all_for: timedelta = timedelta(days=1)
    hourly_for: timedelta = timedelta(days=7)
    place_m: float = 1.0
    place_rad: float = math.radians(45)
    limit_mb: float = 500.0


@dataclass(frozen=True, slots=True)
class StoredPicture:
    """A picture in the memory's folder, with the observation that it was taken for.

    Attributes:
        name: Its file's.
        taken_at: When, with a time zone.
        pose: Of the robot, in the map frame.
        n_bytes: The size of its file.
        map_id: Which map the pose belongs to.
    """

    name: str
    taken_at: datetime
    pose: Pose
    n_bytes: int
    map_id: str | None = None


def choose_dropped(
    pictures: Sequence[StoredPicture],
    *,
    now: datetime,
    named: Collection[str],
    rule: ThinningRule,
) -> frozenset[str]:
    """Gives the names of the pictures that the rule does not keep.

    Of several in one place and hour, or day, the newest is kept. Applied again at the same moment
    to what was kept, it drops nothing.

    Args:
        pictures: All that are stored; one file may serve several observations.
        now: The time that ages are counted from.
        named: Names that records of the semantic map mention.
        rule: What is kept.
    """
    ordered = sorted(pictures, key=lambda picture: (picture.taken_at, picture.name), reverse=True)
    newest_of_group: dict[object, StoredPicture] = {}
    for picture in ordered:
        newest_of_group.setdefault(_group(picture, now, rule), picture)
    kept = {picture.name for picture in newest_of_group.values()} | set(named)
    kept = set(_within_limit(ordered, kept, named, rule))
    return frozenset({picture.name for picture in pictures} - kept)


def _group(picture: StoredPicture, now: datetime, rule: ThinningRule) -> object:
    """Gives what pictures have in common of which one is kept."""
    age = now - picture.taken_at
    if age <= rule.all_for:
        return picture.name
    span_s = 3600 if age <= rule.hourly_for else 86_400
    pose = picture.pose
    return (
        span_s,
        picture.taken_at.timestamp() // span_s,
        picture.map_id,
        math.floor(pose.x / rule.place_m),
        math.floor(pose.y / rule.place_m),
        # Half a width off, so that the directions of the axes lie in the middle of theirs.
        math.floor((pose.yaw_rad % math.tau) / rule.place_rad + 0.5)
        % max(round(math.tau / rule.place_rad), 1),
    )


def _within_limit(
    newest_first: Sequence[StoredPicture],
    kept: Collection[str],
    named: Collection[str],
    rule: ThinningRule,
) -> Iterator[str]:
    """Gives the names that stay within the size, newest first; named ones count before others."""
    sizes = {picture.name: picture.n_bytes for picture in newest_first if picture.name in kept}
    free_bytes = rule.limit_mb * 1e6 - sum(sizes.get(name, 0) for name in set(named))
    yield from named
    for name, n_bytes in sizes.items():
        free_bytes -= 0 if name in named else n_bytes
        if free_bytes < 0:
            return
        yield name
