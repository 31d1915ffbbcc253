"""Observations, and queries for them."""

import hashlib
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from enum import StrEnum

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point, Pose
from mapspeak.memory.quoting import clean_line, clean_text
from mapspeak.memory.waypoint import SemanticMap, Waypoint

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_ID_BYTES = 6


class ObservationKind(StrEnum):
    """Origin of an observation."""

    PICTURE = "picture"
    RECORD = "record"
    NOTE = "note"


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """One observation: made at one moment from one place.

    Attributes:
        recorded_at: Calendar time with time zone.
        picture: Name of the picture in the memory's folder; None without one or after thinning.
        room_id: Id, at that time, of the room or corridor it was observed from.
        id: Derived from the content unless given, so that a repeated write changes nothing.
    """

    recorded_at: datetime
    pose: Pose
    kind: ObservationKind
    text: str = ""
    labels: tuple[str, ...] = ()
    picture: str | None = None
    stamp_s: float | None = None
    map_id: str | None = None
    room_id: str | None = None
    id: str = ""

    def __post_init__(self) -> None:
        labels = dict.fromkeys(filter(None, map(clean_line, self.labels)))
        object.__setattr__(self, "text", clean_text(self.text))
        object.__setattr__(self, "labels", tuple(labels))
        for name in ("picture", "map_id", "room_id"):
            object.__setattr__(self, name, clean_line(getattr(self, name) or "") or None)
        object.__setattr__(self, "id", self.id or self._derived_id())

    @property
    def searched_text(self) -> str:
        """The words and labels that are searched."""
        return "\n".join(filter(None, (self.text, "; ".join(self.labels))))

    def _derived_id(self) -> str:
        said = (
            microseconds_of(self.recorded_at),
            (self.pose.x, self.pose.y, self.pose.yaw_rad),
            str(self.kind),
            self.text,
            self.labels,
            self.picture,
            self.stamp_s,
            self.map_id,
            self.room_id,
        )
        return "o" + hashlib.blake2b(repr(said).encode(), digest_size=_ID_BYTES).hexdigest()


def microseconds_of(time: datetime) -> int:
    """Return the microseconds since 1970, exactly."""
    return (time - _EPOCH) // timedelta(microseconds=1)


Rank = Callable[[str, Sequence[str]], Sequence[float]]
"""Returns for each text how well it fits a query: up to 1; 0 or less if it does not fit."""


class EpisodeOrder(StrEnum):
    """Order of observations."""

    NEWEST = "newest"
    OLDEST = "oldest"
    BEST = "best"
    NEAREST = "nearest"


@dataclass(frozen=True, slots=True)
class MapPlacing:
    """Transform from one map into the map of the query."""

    map_id: str | None
    motion: Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeQuery:
    """A query for the observations that pass every given filter.

    Attributes:
        near: Near to a place in the map frame; or to where the first observation of another query
            was made, and then without the observations that the other query's words or labels fit.
        labels: A thing seen, by any of these labels; case does not matter.
        placings: Transforms of maps into the map of the query; observations of other maps are
            never near. None uses all poses unmoved.
        order: Which come first; None for the best where words are given, else the nearest where a
            place is given without a radius, else the newest.
        as_of: Only this many of the first ever written, so that pages do not shift.

    Raises:
        SemanticMapError: A radius has no place or is not above 0, or an order has nothing to order
            by.
    """

    words: str | None = None
    near: "Point | EpisodeQuery | None" = None
    radius_m: float | None = None
    room_id: str | None = None
    since: datetime | None = None
    until: datetime | None = None
    labels: tuple[str, ...] = ()
    kind: ObservationKind | None = None
    map_id: str | None = None
    placings: tuple[MapPlacing, ...] | None = None
    order: EpisodeOrder | None = None
    limit: int = 20
    offset: int = 0
    as_of: int | None = None

    def __post_init__(self) -> None:
        is_radius = self.radius_m is None or (math.isfinite(self.radius_m) and self.radius_m > 0)
        _require(is_radius, "radius_m", "more than 0 m")
        _require(self.radius_m is None or self.near is not None, "near", "given with radius_m")
        needed = {EpisodeOrder.BEST: self.words, EpisodeOrder.NEAREST: self.near}
        is_ordered = self.order is None or needed.get(self.order, True)
        _require(is_ordered, "order", "one that words (best) or near (nearest) are given for")

    @property
    def effective_order(self) -> EpisodeOrder:
        """The order that was asked for, or the one that follows from the filters."""
        if self.order is not None:
            return self.order
        if self.words:
            return EpisodeOrder.BEST
        is_nearest = self.near is not None and self.radius_m is None
        return EpisodeOrder.NEAREST if is_nearest else EpisodeOrder.NEWEST


class EpisodeFilter(StrEnum):
    """Reason for a hit; words are compared by spelling or by meaning."""

    WORDS = "words"
    MEANING = "meaning"
    PLACE = "place"
    ROOM = "room"
    LABEL = "label"
    TIME = "time"
    KIND = "kind"
    MAP = "map"


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeMatch:
    """A matching observation, and why it matches.

    Attributes:
        fitting: Which of its words fit; those asked for, where meanings were compared.
        label: The requested label, as recorded.
        near_id: The observation that a nested query found there; None without one.
        is_elsewhere: Its pose is on another map whose placing is unknown.
    """

    observation: Observation
    score_ratio: float | None = None
    distance_m: float | None = None
    filters: tuple[EpisodeFilter, ...] = ()
    fitting: tuple[str, ...] = ()
    label: str | None = None
    near: Point | None = None
    near_id: str | None = None
    is_elsewhere: bool = False

    def with_picture(self, short: str) -> "EpisodeMatch":
        """Return the same with its picture under a short id, which is that of a picture itself."""
        seen = replace(self.observation, picture=short)
        is_picture = seen.kind is ObservationKind.PICTURE
        return replace(self, observation=replace(seen, id=short) if is_picture else seen)


def placed(seen: Observation, placings: Iterable[MapPlacing] | None) -> EpisodeMatch:
    """Return an observation with its pose on the map of the query, if its placing is known."""
    for placing in placings or ():
        if placing.map_id == seen.map_id:
            is_still = placing.motion == Pose(0.0, 0.0)
            room_id = seen.room_id if is_still else None
            here = replace(seen, pose=placing.motion @ seen.pose, room_id=room_id)
            return EpisodeMatch(observation=here)
    is_elsewhere = placings is not None
    room_id = None if is_elsewhere else seen.room_id
    return EpisodeMatch(observation=replace(seen, room_id=room_id), is_elsewhere=is_elsewhere)


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodePage:
    """Observations that fit, in the order asked for.

    Attributes:
        anchor: What the nested query found, which `near` stands for; None without one.
    """

    matches: tuple[EpisodeMatch, ...]
    n_matches: int
    anchor: EpisodeMatch | None = None
    next_page: EpisodeQuery | None = None


def name_pictures(page: EpisodePage, ids: Mapping[str, str]) -> EpisodePage:
    """Return a page on which pictures go by the short ids that some have.

    Args:
        ids: Of pictures, by their names in the memory's folder.
    """

    def name(match: EpisodeMatch) -> EpisodeMatch:
        short = ids.get(match.observation.picture or "")
        return match if short is None else match.with_picture(short)

    anchor = None if page.anchor is None else name(page.anchor)
    return replace(page, matches=tuple(map(name, page.matches)), anchor=anchor)


def _require(is_right: object, what: str, expected: str) -> None:
    if not is_right:
        raise SemanticMapError(f"{what} is not {expected}.", hint=f"Give {what} as {expected}.")


def observation_of(waypoint: Waypoint) -> Observation | None:
    """Return the writing of a record as an observation; None if its time is unknown."""
    if waypoint.recorded_at is None:
        return None
    said = (waypoint.name, waypoint.description, *waypoint.geometric_features)
    return Observation(
        recorded_at=waypoint.recorded_at,
        stamp_s=waypoint.stamp_s,
        pose=waypoint.pose,
        map_id=waypoint.map_id,
        room_id=waypoint.room_id,
        kind=ObservationKind.RECORD,
        text="\n".join(filter(None, said)),
        labels=tuple(landmark.label for landmark in waypoint.landmarks),
        picture=waypoint.picture,
    )


def named_pictures(semantic_map: SemanticMap) -> frozenset[str]:
    """Return the pictures that waypoints and their landmarks name."""
    return frozenset(
        picture
        for waypoint in semantic_map.waypoints
        for picture in (waypoint.picture, *(landmark.picture for landmark in waypoint.landmarks))
        if picture
    )
