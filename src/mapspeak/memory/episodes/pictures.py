"""The folder of pictures, and which old ones are deleted."""

import hashlib
import math
import os
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from mapspeak.atomic import replace_file
from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose

_SUFFIXES = {b"\xff\xd8\xff": "jpg", b"\x89PNG\r\n\x1a\n": "png"}
_OURS = re.compile(r"\.?\d{8}T\d{6}Z-[0-9a-f]{12}\.(?:jpg|png)(?:\.tmp)?")


def picture_name(content: bytes, taken_at: datetime) -> str:
    """Return the name for a picture, such as 20261122T091205Z-3fa9c1d2e4b5.jpg.

    Raises:
        SemanticMapError: It is neither JPEG nor PNG.
    """
    suffix = next((s for start, s in _SUFFIXES.items() if content.startswith(start)), None)
    if suffix is None:
        message = "The picture is neither JPEG nor PNG."
        raise SemanticMapError(message, hint="Encode it as one of them.")
    digest = hashlib.blake2b(content, digest_size=6).hexdigest()
    return f"{taken_at.astimezone(UTC):%Y%m%dT%H%M%SZ}-{digest}.{suffix}"


class PictureFolder:
    """The picture files; a change requires the writers' lock of the database."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def find(self, name: str | None) -> Path | None:
        """Return the file of a picture; None if it is missing or outside this folder."""
        if not name or Path(name).name != name:
            return None
        path = self.path / name
        return path if path.is_file() else None

    def put(self, name: str, content: bytes) -> None:
        """Write a picture; it is on the disk when this returns."""
        target = self.path / name
        if target.exists() and target.stat().st_size == len(content):
            return
        replace_file(target, content, ending="tmp")

    def remove_all_but(self, kept: Collection[str]) -> int:
        """Remove our pictures that no record names, and return how many."""
        if not self.path.is_dir():
            return 0
        unknown = [
            entry.name
            for entry in os.scandir(self.path)
            if entry.name not in kept and _OURS.fullmatch(entry.name)
        ]
        for name in unknown:
            (self.path / name).unlink(missing_ok=True)
        return len(unknown)


@dataclass(frozen=True, slots=True, kw_only=True)
class ThinningRule:
    """Retention of pictures: all new ones, then one per place and hour, then per day.

    Observations themselves are never dropped, nor a picture that a record of the semantic map
    names. Hours and days are those of UTC, so that the answer is the same everywhere.

    Attributes:
        all_for: Every picture is kept up to this age.
        hourly_for: One per place and hour is kept up to this age; then one per place and day.
        place_m: Edge of the squares that count as one place, in metres.
        place_rad: Width of the directions that count as one, in radians.
        limit_mb: Size limit of all pictures; the oldest go first. Those that records name stay
            even above it.
    """

    all_for: timedelta = timedelta(days=1)
    hourly_for: timedelta = timedelta(days=7)
    place_m: float = 1.0
    place_rad: float = math.radians(45)
    limit_mb: float = 500.0


@dataclass(frozen=True, slots=True)
class StoredPicture:
    """A picture in the memory's folder, with the observation that it was taken for."""

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
    """Return the names of the pictures that the rule does not keep.

    Of several in one place and hour, or day, the newest is kept. Applied again at the same moment
    to what was kept, it drops nothing.

    Args:
        pictures: All that are stored; one file may serve several observations.
    """
    ordered = sorted(pictures, key=lambda picture: (picture.taken_at, picture.name), reverse=True)
    newest_of_group: dict[object, StoredPicture] = {}
    for picture in ordered:
        newest_of_group.setdefault(_group(picture, now, rule), picture)
    kept = {picture.name for picture in newest_of_group.values()} | set(named)
    kept = set(_within_limit(ordered, kept, named, rule))
    return frozenset({picture.name for picture in pictures} - kept)


def _group(picture: StoredPicture, now: datetime, rule: ThinningRule) -> object:
    """Return the key that pictures share of which one is kept."""
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
        # Shifted by half a width, so that the axes lie in the middle of their sectors.
        math.floor((pose.yaw_rad % math.tau) / rule.place_rad + 0.5)
        % max(round(math.tau / rule.place_rad), 1),
    )


def _within_limit(
    newest_first: Sequence[StoredPicture],
    kept: Collection[str],
    named: Collection[str],
    rule: ThinningRule,
) -> Iterator[str]:
    """Return the names that stay within the size, newest first; named ones count before others."""
    sizes = {picture.name: picture.n_bytes for picture in newest_first if picture.name in kept}
    free_bytes = rule.limit_mb * 1e6 - sum(sizes.get(name, 0) for name in set(named))
    yield from named
    for name, n_bytes in sizes.items():
        free_bytes -= 0 if name in named else n_bytes
        if free_bytes < 0:
            return
        yield name
