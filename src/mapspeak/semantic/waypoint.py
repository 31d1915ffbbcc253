"""A remembered place, what is seen from it, and all places of one map (paper eq. 8 and 9)."""

import math
import unicodedata
from dataclasses import dataclass
from datetime import datetime

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose, wrap_angle

_JOINERS = "\u200c\u200d"
"""Invisible, yet part of how Persian, Indic and emoji words are written."""


def clean_line(text: str) -> str:
    """Gives the text on one line: every run of spaces and unprintable characters is one space."""
    if not text.isprintable():
        text = "".join(c if c.isprintable() or c in _JOINERS else " " for c in text)
    return " ".join(text.split())


def clean_text(text: str) -> str:
    """Gives the text with every line cleaned and empty lines at its ends cut."""
    lines = text.replace("\r\n", "\n").split("\n")
    return "\n".join(map(clean_line, lines)).strip("\n")


def name_key(name: str) -> str:
    """Gives what two spellings of one place's name have in common: case and spaces do not count."""
    return clean_line(unicodedata.normalize("NFKC", name).casefold())


@dataclass(frozen=True, slots=True, kw_only=True)
class Landmark:
    """A thing seen from a waypoint. Only the label is always known.

    Attributes:
        label: What it is, in a few words.
        purpose: What it is good for.
        bearing_rad: Its direction from the waypoint's heading, left positive.
        range_m: Its distance from the waypoint.
        note: Anything else.

    Raises:
        SemanticMapError: The label is empty, or a number is not finite or below zero.
    """

    label: str
    purpose: str | None = None
    bearing_rad: float | None = None
    range_m: float | None = None
    note: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "label", _required_line(self.label, "A landmark's label"))
        if self.purpose is not None:
            object.__setattr__(self, "purpose", clean_line(self.purpose) or None)
        if self.note is not None:
            object.__setattr__(self, "note", clean_line(self.note) or None)
        if self.bearing_rad is not None:
            _require(math.isfinite(self.bearing_rad), f"The bearing of {self.label!r}", "an angle")
            object.__setattr__(self, "bearing_rad", wrap_angle(self.bearing_rad))
        if self.range_m is not None:
            is_distance = math.isfinite(self.range_m) and self.range_m >= 0
            _require(is_distance, f"The range of {self.label!r}", "0 m or more")


@dataclass(frozen=True, slots=True, kw_only=True)
class Waypoint:
    """A remembered place (paper eq. 8).

    Attributes:
        name: How people call it; unique in its map, whatever its case (`name_key`).
        description: The place in natural language; may have several lines.
        pose: From where it was observed, in the map frame.
        safety_landmarks: Fixed safety equipment.
        functional_landmarks: Fixed equipment and objects that tasks need.
        geometric_features: Persistent layout, such as "corner of two walls".
        stamp_s: Robot time of the observation.
        recorded_at: The same by the calendar, with its time zone.
        map_id: Which map the pose belongs to; None where the store decides.

    Raises:
        SemanticMapError: The name is empty, the pose or stamp not finite, or the time has no zone.
    """

    name: str
    pose: Pose
    description: str = ""
    safety_landmarks: tuple[Landmark, ...] = ()
    functional_landmarks: tuple[Landmark, ...] = ()
    geometric_features: tuple[str, ...] = ()
    stamp_s: float | None = None
    recorded_at: datetime | None = None
    map_id: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", _required_line(self.name, "A waypoint's name"))
        object.__setattr__(self, "description", clean_text(self.description))
        features = (clean_line(feature) for feature in self.geometric_features)
        object.__setattr__(self, "geometric_features", tuple(filter(None, features)))
        _require(self.pose.is_finite(), f"The pose of {self.name!r}", "three finite numbers")
        is_stamped = self.stamp_s is None or math.isfinite(self.stamp_s)
        _require(is_stamped, f"The stamp of {self.name!r}", "a finite number of seconds")
        has_zone = self.recorded_at is None or self.recorded_at.tzinfo is not None
        _require(has_zone, f"The time of {self.name!r}", "a time with its zone")

    @property
    def landmarks(self) -> tuple[Landmark, ...]:
        """The safety landmarks, then the functional ones."""
        return self.safety_landmarks + self.functional_landmarks


@dataclass(frozen=True, slots=True, kw_only=True)
class SemanticMap:
    """All remembered places of one map (paper eq. 9).

    Attributes:
        map_id: Which map the poses belong to; None where nobody said.
        waypoints: In the order of the file.
        warnings: What its reader should know: another map's places, a file that is broken by now,
            a key that looks misspelt.
    """

    map_id: str | None = None
    waypoints: tuple[Waypoint, ...] = ()
    warnings: tuple[str, ...] = ()

    def find_waypoint(self, name: str) -> Waypoint | None:
        """Gives the place of that name, whatever its case, or None."""
        key = name_key(name)
        return next((place for place in self.waypoints if name_key(place.name) == key), None)


def _required_line(text: str, what: str) -> str:
    line = clean_line(text)
    _require(bool(line), what, "at least one visible character")
    return line


def _require(is_right: object, what: str, expected: str) -> None:
    if not is_right:
        message = f"{what} is not {expected}."
        raise SemanticMapError(message, hint=f"Give {expected} and write it again.")
