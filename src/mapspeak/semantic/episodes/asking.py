"""What can be asked of the episodes, and what comes back."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point
from mapspeak.semantic.episodes.observation import Observation, ObservationKind

__all__ = ["EpisodeMatch", "EpisodeOrder", "EpisodePage", "EpisodeQuery", "Rank"]

MOST_ROWS = 1000
MOST_HOPS = 5

Rank = Callable[[str, Sequence[str]], Sequence[float]]
"""Says of each text how well it fits a query: up to 1; 0 or less where it does not fit."""


class EpisodeOrder(StrEnum):
    """Which observations come first."""

    NEWEST = "newest"
    OLDEST = "oldest"
    BEST = "best"
    NEAREST = "nearest"


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeQuery:
    """Which observations are wanted: those that pass every filter that is given.

    Attributes:
        words: What they are about, in words.
        near: Near to a place in the map frame; or to where the first observation of another query
            was made, and then without the observations that the other query's words or label fit.
        radius_m: How near.
        room_id: Made in this room.
        since: Not before.
        until: Before.
        label: A thing seen, whatever its case.
        kind: What they came from.
        map_id: On this map.
        order: Which come first; None for the best where words are given, else the nearest where a
            place is given without a radius, else the newest.
        limit: How many, at most.
        offset: How many to leave out before.
        as_of: Only the first so many that were ever written, so that pages do not shift.

    Raises:
        SemanticMapError: A number is out of bounds, a time has no zone, an order has nothing to
            order by, or queries are nested more than five deep.
    """

    words: str | None = None
    near: "Point | EpisodeQuery | None" = None
    radius_m: float | None = None
    room_id: str | None = None
    since: datetime | None = None
    until: datetime | None = None
    label: str | None = None
    kind: ObservationKind | None = None
    map_id: str | None = None
    order: EpisodeOrder | None = None
    limit: int = 20
    offset: int = 0
    as_of: int | None = None

    def __post_init__(self) -> None:
        is_number = 1 <= self.limit <= MOST_ROWS and self.offset >= 0
        _require(is_number, "limit or offset", f"1 to {MOST_ROWS}, and 0 or more")
        is_radius = self.radius_m is None or (math.isfinite(self.radius_m) and self.radius_m > 0)
        _require(is_radius, "radius_m", "more than 0 m")
        _require(self.radius_m is None or self.near is not None, "near", "given with radius_m")
        for name, time in (("since", self.since), ("until", self.until)):
            _require(time is None or time.tzinfo is not None, name, "a time with its zone")
        needed = {EpisodeOrder.BEST: self.words, EpisodeOrder.NEAREST: self.near}
        is_ordered = self.order is None or needed.get(self.order, True)
        _require(is_ordered, "order", "one that words (best) or near (nearest) are given for")
        _require(_n_hops(self) <= MOST_HOPS, "near", f"nested at most {MOST_HOPS} deep")

    @property
    def effective_order(self) -> EpisodeOrder:
        """The order that is asked for, or follows from what else is."""
        if self.order is not None:
            return self.order
        if self.words:
            return EpisodeOrder.BEST
        is_nearest = self.near is not None and self.radius_m is None
        return EpisodeOrder.NEAREST if is_nearest else EpisodeOrder.NEWEST


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeMatch:
    """An observation that fits, and why.

    Attributes:
        observation: What was observed.
        score_ratio: How well the words fit, up to 1; None where none were asked for.
        distance_m: From where it was made to the place asked for; None where none was.
        reasons: Why it is here, one for each filter.
        evidence: Those of them that it does not show itself: which of its words fit.
    """

    observation: Observation
    score_ratio: float | None
    distance_m: float | None
    reasons: tuple[str, ...]
    evidence: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodePage:
    """Observations that fit, in the order asked for.

    Attributes:
        matches: This page of them.
        n_matches: How many fit in all.
        anchor: What the nested query found, which `near` stands for; None without one.
        next_page: Asks for those that follow; None on the last page.
    """

    matches: tuple[EpisodeMatch, ...]
    n_matches: int
    anchor: EpisodeMatch | None = None
    next_page: EpisodeQuery | None = None


def _n_hops(query: EpisodeQuery) -> int:
    return 1 + _n_hops(query.near) if isinstance(query.near, EpisodeQuery) else 0


def _require(is_right: object, what: str, expected: str) -> None:
    if not is_right:
        raise SemanticMapError(f"{what} is not {expected}.", hint=f"Give {what} as {expected}.")
