"""A way through the map, as the value that a path search gives."""

import itertools
from dataclasses import dataclass

from mapspeak.geometry import Point

__all__ = ["Path"]


@dataclass(frozen=True, slots=True)
class Path:
    """A way from the first point to the last one, straight in between.

    Attributes:
        points: At least two places, in the order they are passed.
        length_m: Along the way.
    """

    points: tuple[Point, ...]
    length_m: float

    @classmethod
    def through(cls, points: tuple[Point, ...]) -> "Path":
        """Gives the path through the points, with its length measured."""
        return cls(points, sum(a.distance_to(b) for a, b in itertools.pairwise(points)))
