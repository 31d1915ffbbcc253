"""Frontiers as values, and their ids from call to call."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.rooms.identity import match_best_first

TOUCH_M = 0.3
"""Points of one frontier on two maps are at most this far apart."""
SAME_PLACE_M = 2.0
"""A frontier that moved farther than this gets a new id."""
SAME_FLOOR_RATIO = 0.95
"""A map with less of the floor known before has lost some, or is another map."""
PROMISED_ONCE_RATIO, BEYOND_RATIO, MOST_BEYOND = 0.8, 8.0, 3.0
"""Fitted to explorations of the 14 shipped worlds (`benchmarks/explored_share.py`)."""
SAME_RATIO = 0.25
"""Two frontiers are one when this share of the shorter lies on the other."""


class FrontierMerit(StrEnum):
    """Merits that distinguish a frontier from the others."""

    ONLY = "only"
    BEST = "best"
    MOST_PER_METRE = "most_per_metre"
    MOST_TO_SEE = "most_to_see"
    NEAREST = "nearest"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Frontier:
    """A border between known floor and the unknown that the robot can go and look beyond.

    Attributes:
        id: Such as "F2"; the same from call to call while the frontier exists.
        points: The centres of its cells in metres, shape (n, 2).
        anchor: The point that the pose looks over.
        gain_m2: Unknown floor expected to come into view at the pose.
        distance_m: From the robot to the pose, by path.
        openness_m: Mean viewing distance on this map, used for the gain.
        pose: The viewpoint: the robot can reach it and faces the unknown there.
        detour_m: Growth of the round through all frontiers if it begins with this one; None if not
            computed, because others promise more.
    """

    id: str
    points: FloatArray = field(repr=False)
    anchor: Point
    length_m: float
    gain_m2: float
    distance_m: float
    openness_m: float
    pose: Pose
    merits: tuple[FrontierMerit, ...] = ()
    detour_m: float | None = None

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=np.float64)
        points.setflags(write=False)
        object.__setattr__(self, "points", points)


class RefusalReason(StrEnum):
    """Reason for refusing a border with the unknown."""

    NO_WAY = "no_way"
    TOO_NARROW = "too_narrow"
    NOTHING_TO_SEE = "nothing_to_see"
    LOOKED_ALREADY = "looked_already"
    DRIVE_FAILED = "drive_failed"
    """A drive there failed, and the map has not changed there since."""
    PROVED_NARROW = "proved_narrow"
    """Behind a gap that the robot did not pass."""
    CLOSED_OFF = "closed_off"
    """No way leads there while areas are closed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RefusedFrontier:
    """A border with the unknown that is refused as a goal.

    Attributes:
        anchor: One of its cells, near its middle.
        gap_width_m: Width of the way at its narrowest, if too narrow.
        gap_at: Where the gap is that the robot did not pass.
        needed_width_m: Width of the robot, if the way is too narrow.
        least_gain_m2: Gain worth a drive, if there is too little to see.
    """

    anchor: Point
    length_m: float
    reason: RefusalReason
    gap_width_m: float = 0.0
    gap_at: Point | None = None
    needed_width_m: float = 0.0
    least_gain_m2: float = 0.0


class FrontierVerdict(StrEnum):
    """State of exploration."""

    SOME_LEFT = "some_left"
    NONE_LEFT = "none_left"
    ALL_REFUSED = "all_refused"
    NONE_REACHABLE = "none_reachable"
    NOTHING_KNOWN = "nothing_known"


@dataclass(frozen=True, slots=True, eq=False)
class WaysBetween:
    """Distances between frontiers.

    Attributes:
        metres: By path, shape (n, n).
    """

    stops: tuple[Point, ...]
    metres: FloatArray = field(repr=False)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FrontierReport:
    """All frontiers of a map as seen from one place.

    Attributes:
        frontiers: Possible goals, best first.
        refused: Refused borders, longest first.
        ways: Between the frontiers that were compared; valid for this map.
        n_named: The highest frontier number given so far.
        floor_m2: Free floor on the map.
        known_ratio: Its estimated share of all floor there is; it falls only where floor is lost,
            or where one frontier alone promises more than it leaves.
    """

    frontiers: tuple[Frontier, ...]
    refused: tuple[RefusedFrontier, ...]
    verdict: FrontierVerdict
    n_named: int
    floor_m2: float
    known_ratio: float
    ways: WaysBetween | None = None

    def find(self, frontier_id: str) -> Frontier | None:
        """Find a frontier by its id; None if it is gone or never existed."""
        return next((each for each in self.frontiers if each.id == frontier_id), None)


def match_frontiers(previous: FrontierReport, current: FrontierReport) -> FrontierReport:
    """Return the current report with the previous ids of frontiers that still exist.

    Frontiers are compared by where they lie in the world, so the map may grow and move its origin
    in between. New ones get numbers that were never given before.
    """
    ids = _inherited(previous.frontiers, current.frontiers)
    n_named = previous.n_named
    named = []
    for index, frontier in enumerate(current.frontiers):
        if index not in ids:
            n_named += 1
        named.append(dataclasses.replace(frontier, id=ids.get(index, f"F{n_named}")))
    known_ratio = _hold_known_ratio(previous, current)
    return dataclasses.replace(
        current, frontiers=tuple(named), n_named=n_named, known_ratio=known_ratio
    )


def estimate_known_ratio(floor_m2: float, gains_m2: Sequence[float]) -> float:
    """Estimate which share of all floor is known, by what frontiers promise.

    Some of it is promised by two. Behind a frontier that promises much, compared with what is
    known, lies more than it promises: so little is known at first.

    Args:
        floor_m2: Known floor.
    """
    if not floor_m2:
        return 0.0
    more_m2 = sum(
        gain_m2 * (PROMISED_ONCE_RATIO + min(BEYOND_RATIO * gain_m2 / floor_m2, MOST_BEYOND))
        for gain_m2 in gains_m2
    )
    return floor_m2 / (floor_m2 + more_m2)


def _hold_known_ratio(previous: FrontierReport, current: FrontierReport) -> float:
    """Return the known share, no smaller than before on the same map: promises come and go."""
    floor_m2 = current.floor_m2
    if floor_m2 < SAME_FLOOR_RATIO * previous.floor_m2:
        return current.known_ratio
    most_m2 = max((each.gain_m2 for each in current.frontiers), default=0.0)
    most_ratio = floor_m2 / (floor_m2 + most_m2) if floor_m2 else 0.0
    return max(current.known_ratio, min(previous.known_ratio, most_ratio))


def _inherited(previous: tuple[Frontier, ...], current: tuple[Frontier, ...]) -> dict[int, str]:
    """Return the ids that pass on, largest overlap first, by index among the current ones."""
    return match_best_first(
        ((-ratio, index), old.id, index)
        for old in previous
        for index, new in enumerate(current)
        if old.pose.point.distance_to(new.pose.point) <= SAME_PLACE_M
        and (ratio := _overlap_ratio(old.points, new.points)) >= SAME_RATIO
    )


def _overlap_ratio(first: FloatArray, second: FloatArray) -> float:
    """Return the share of the shorter set of points that lies on the other."""
    shorter, longer = sorted((first, second), key=len)
    low, high = longer.min(axis=0) - TOUCH_M, longer.max(axis=0) + TOUCH_M
    near = shorter[((shorter >= low) & (shorter <= high)).all(axis=1)]
    if not len(near):
        return 0.0
    gaps = np.hypot(*(near[:, None, :] - longer[None, :, :]).transpose(2, 0, 1)).min(axis=1)
    return float((gaps <= TOUCH_M).sum()) / len(shorter)
