"""A thing as it is remembered, and the views that speak for it and against it."""

from dataclasses import dataclass, field
from enum import StrEnum

from mapspeak.geometry import Point
from mapspeak.semantic.waypoint import Landmark
from mapspeak.spatial.grid import FloatArray

__all__ = ["Category", "Thing", "View"]


class Category(StrEnum):
    """How the filtering policy sorts a thing."""

    SAFETY = "safety"
    FUNCTIONAL = "functional"


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """One landmark, as it was seen from one pose, and what it says of a thing.

    Attributes:
        waypoint: The name of the place it was seen from.
        landmark: What was seen.
        place: Where it was seen from: that waypoint's place, or the view's own.
        why: Why it speaks for the thing or against it, in words with numbers.
    """

    waypoint: str
    landmark: Landmark
    place: Point
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """One thing in the building, out of everything that was seen of it. It has no id.

    Attributes:
        label: What most views call it.
        other_labels: What else it was called.
        category: What most views file it under.
        purposes: What it is good for, each once.
        position: Where it is; None where no view says a direction.
        uncertainty_m: The radius around the position that holds it with 90 %; None without one.
        supporting: Views of it, by waypoint; one waypoint may have several, each from its pose.
        conflicting: Views that say otherwise.
        confidence_ratio: That there is such a thing there, by its views alone.
        n_agreeing: From how many different places it was seen by views that agree on where it is.
        whereabouts: Points of the map frame, shape (n, 2), locked: its surface is as likely at any
            as at any other. None without a position; no part of what makes two things equal.
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

    @property
    def waypoints(self) -> tuple[str, ...]:
        """The places it was seen from, each once."""
        return tuple(dict.fromkeys(view.waypoint for view in self.supporting))
