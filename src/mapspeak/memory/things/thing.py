"""A thing as it is remembered, and the views that speak for it and against it."""

import math
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum

from mapspeak.geometry import Point
from mapspeak.memory.waypoint import Confidence, Landmark
from mapspeak.spatial.grid import FloatArray

_DOUBTS = {Confidence.CERTAIN: 0.5, Confidence.LIKELY: 1.0, Confidence.UNSURE: 2.0, None: 1.0}
"""How many times as often as usual an observer errs, by its own word."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseModel:
    """What is believed of observers, before anything was observed; fitted to no map.

    A view is wrong as a whole now and then, in its label or its direction, and then says nothing
    of the thing; else its direction is off by a Gaussian, and its range, where it has one, too.

    Attributes:
        bearing_rad: Standard deviation of a direction that an observer judges.
        measured_rad: The same of one that was measured, such as by the column of a picture.
        wrong_ratio: The share of views that are wrong as a whole.
        range_m: The part of a range's standard deviation that is the same near and far.
        range_ratio: The part that grows with the range.
        wrong_range_ratio: The share of ranges that are wrong where the direction is right. Small,
            for most errors take both, and those `wrong_ratio` counts; not 0, so that a range that
            fits nothing in sight leaves the direction its say.
        seen_over_ratio: How often one sees over something that stands free, such as a table.
            Counted in drawn buildings, 4 m away at most: 0.89.
        seen_by_edge_ratio: How often a thing whose middle a corner hides is seen by its edge.
        floor_per_m: Things on a square metre of floor for those on a metre of wall or furniture.
        reach_m: Nobody names a thing that is farther.
        named_m: At so many metres things are named .61 times as often as near by (a Gaussian).
        misplaced_ratio: How likely what hangs on walls is at what stands free, and a table at a
            wall.
        laser_m: Standard deviation of where the middle of a cell is that a beam of the laser ended
            in: what pose and map are good to, and half a cell.
        laser_update_m: A beam that ends nearer to something on the map has met just that.
        laser_met_ratio: How often what a laser met and the map has not is as good a place for a
            thing as what the map has: the rest are people, and what is gone tomorrow.
        laser_through_ratio: How likely a thing still is where the map has something that a beam
            passed, for those where the map is right: the laser looks at one height, and things
            hang above it and lie below it.
    """

    bearing_rad: float = math.radians(10)
    measured_rad: float = math.radians(3.5)
    wrong_ratio: float = 0.2
    range_m: float = 0.1
    range_ratio: float = 0.15
    wrong_range_ratio: float = 0.02
    seen_over_ratio: float = 0.9
    seen_by_edge_ratio: float = 0.2
    floor_per_m: float = 0.1
    reach_m: float = 20.0
    named_m: float = 10.0
    misplaced_ratio: float = 0.1
    laser_m: float = 0.15
    laser_update_m: float = 0.3
    laser_met_ratio: float = 0.9
    laser_through_ratio: float = 0.8

    def bearing_rad_of(self, landmark: Landmark) -> float:
        """Return the standard deviation of a landmark's direction."""
        is_judged = landmark.bearing_from is None
        return self.bearing_rad if is_judged else self.measured_rad

    def wrong_ratio_of(self, confidence: Confidence | None) -> float:
        """Return how often views are wrong whose observer was so sure."""
        return min(self.wrong_ratio * _DOUBTS[confidence], 0.5)


NOISE = NoiseModel()


class Stance(StrEnum):
    """Where such things usually are: on walls, as signs, or away from them, as tables."""

    ANYWHERE = "anywhere"
    ON_WALL = "on_wall"
    FREE = "free"


class Category(StrEnum):
    """How the filtering policy sorts a thing."""

    SAFETY = "safety"
    FUNCTIONAL = "functional"


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """One landmark, as it was seen from one pose, and what it says of a thing.

    Attributes:
        place: Where it was seen from: that waypoint's place, or the view's own.
        far_m: From there to the thing; None where the view says no direction or the thing has no
            position.
        off_rad: How far the view points past the thing, without a sign; None as before.
        recorded_point: Where the record has it without a map: by its range, else by the laser.
    """

    waypoint: str
    landmark: Landmark
    place: Point
    far_m: float | None = None
    off_rad: float | None = None
    recorded_point: Point | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """One thing in the building, out of everything that was seen of it. It has no id.

    Attributes:
        position: Where it is; None where no view says a direction.
        uncertainty_m: The radius around the position that holds it with 90 %; None without one.
        supporting: Views of it, by waypoint; one waypoint may have several, each from its pose.
        confidence_ratio: That there is such a thing there, by its views alone.
        n_agreeing: From how many different places it was seen by views that agree on where it is.
        whereabouts: Points of the map frame, shape (n, 2), locked: its surface is as likely at any
            as at any other. None without a position; no part of what makes two things equal.
        first_seen: When the earliest of its views was recorded; None without a time.
        last_seen: When the latest was.
    """

    label: str
    other_labels: tuple[str, ...]
    category: Category
    purposes: tuple[str, ...]
    position: Point | None
    uncertainty_m: float | None
    supporting: tuple[View, ...]
    conflicting: tuple[View, ...]
    confidence_ratio: float
    n_agreeing: int
    whereabouts: FloatArray | None = field(default=None, compare=False, repr=False)
    first_seen: datetime | None = None
    last_seen: datetime | None = None

    @property
    def is_guessed(self) -> bool:
        """True where only one direction is known, and where the map ends it is taken to be."""
        has_range = any(view.landmark.range_m is not None for view in self.supporting)
        return self.position is not None and self.n_agreeing < 2 and not has_range

    @property
    def recorded_point(self) -> Point | None:
        """Where the first record that says so has it without a map."""
        points = (view.recorded_point for view in self.supporting)
        return next((each for each in points if each is not None), None)

    @property
    def waypoints(self) -> tuple[str, ...]:
        """The places it was seen from, each once."""
        return tuple(dict.fromkeys(view.waypoint for view in self.supporting))
