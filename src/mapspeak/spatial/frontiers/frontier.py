"""Frontiers as values: where to go to see more, and where not, and why."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.spatial.grid import FloatArray

__all__ = [
    "Frontier",
    "FrontierReport",
    "FrontierVerdict",
    "RefusalReason",
    "RefusedFrontier",
    "WaysBetween",
]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Frontier:
    """A border between known floor and the unknown that the robot can go and look beyond.

    Attributes:
        id: Such as "F2"; the same from call to call while the frontier exists.
        points: The centres of its cells in metres, shape (n, 2).
        anchor: The one of them that the pose looks over.
        length_m: Along the border.
        gain_m2: Unknown floor that is to be expected to come into view at the pose.
        distance_m: From the robot to the pose, by path.
        openness_m: What that was reckoned with: how far one sees on this map, on average.
        pose: Where to go: a place the robot can reach and stand in, facing the unknown.
        reason: Why it stands where it stands in the ranking, in words with numbers.
    """

    id: str
    points: FloatArray = field(repr=False)
    anchor: Point
    length_m: float
    gain_m2: float
    distance_m: float
    openness_m: float
    pose: Pose
    reason: str

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=np.float64)
        points.setflags(write=False)
        object.__setattr__(self, "points", points)


class RefusalReason(StrEnum):
    """Why a border with the unknown is no place to go."""

    NO_WAY = "no_way"
    TOO_NARROW = "too_narrow"
    NOTHING_TO_SEE = "nothing_to_see"
    LOOKED_ALREADY = "looked_already"


@dataclass(frozen=True, slots=True, kw_only=True)
class RefusedFrontier:
    """A border with the unknown that is no place to go.

    Attributes:
        anchor: One of its cells, near its middle.
        length_m: Along the border.
        reason: What kind of refusal it is.
        sentence: The same in words with numbers.
    """

    anchor: Point
    length_m: float
    reason: RefusalReason
    sentence: str


class FrontierVerdict(StrEnum):
    """What is left to explore."""

    SOME_LEFT = "some_left"
    NONE_LEFT = "none_left"
    ALL_REFUSED = "all_refused"
    NOTHING_KNOWN = "nothing_known"


@dataclass(frozen=True, slots=True, eq=False)
class WaysBetween:
    """How far it is from frontier to frontier.

    Attributes:
        stops: Their poses' places.
        metres: By path, shape (n, n).
    """

    stops: tuple[Point, ...]
    metres: FloatArray = field(repr=False)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FrontierReport:
    """All frontiers of a map as seen from one place.

    Attributes:
        frontiers: Where to go, best first.
        refused: Where not to go, longest first.
        n_specks: Borders so short that they are nothing but noise, which are not listed.
        verdict: Whether anything is left.
        sentence: The verdict in words with numbers.
        ways: Between those that were weighed against each other; they hold while the map does.
        n_named: The highest number given to a frontier so far; the next new one gets one more.
    """

    frontiers: tuple[Frontier, ...]
    refused: tuple[RefusedFrontier, ...]
    n_specks: int
    verdict: FrontierVerdict
    sentence: str
    n_named: int
    ways: WaysBetween | None = None

    def find(self, frontier_id: str) -> Frontier | None:
        """Finds a frontier by its id; None where it is gone or was never there."""
        return next((each for each in self.frontiers if each.id == frontier_id), None)
