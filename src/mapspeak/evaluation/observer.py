"""The scripted observer: turns the simulated detector's lines into a semantic record.

A language model looks at the picture itself. A script cannot, so it reads what the robot's detector
(in the simulator: the *simulated detector*) reports, and sorts it by the paper's filtering policy.
"""

import re
from dataclasses import dataclass
from typing import Any

SIGHTING = re.compile(
    r"^- (?P<label>[^,]+), bearing (?P<bearing>[+-]?[\d.]+) deg, range (?P<range>[\d.]+) m",
    re.MULTILINE,
)
CLEAR_RANGE_M = 6.0
"""Farther things are left to a waypoint that is nearer to them."""

SAFETY_WORDS = ("extinguisher", "first-aid", "first aid", "exit", "eye", "hose", "fire")


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectedThing:
    """One thing the detector reported.

    Attributes:
        label: What it took it for.
        bearing_deg: From the robot's heading, left positive.
        range_m: From the robot.
    """

    label: str
    bearing_deg: float
    range_m: float

    @property
    def is_safety(self) -> bool:
        """True for fixed safety equipment, by the paper's first category."""
        return any(word in self.label for word in SAFETY_WORDS)

    def as_landmark(self) -> dict[str, Any]:
        """Return it as `write_semantic_data` takes it."""
        return {"label": self.label, "bearing_deg": self.bearing_deg, "range_m": self.range_m}


def read_sightings(text: str) -> tuple[DetectedThing, ...]:
    """Read the detector's lines in the answer of `look_through_camera`, nearest first."""
    sightings = (
        DetectedThing(
            label=match["label"],
            bearing_deg=float(match["bearing"]),
            range_m=float(match["range"]),
        )
        for match in SIGHTING.finditer(text)
    )
    return tuple(sorted(sightings, key=lambda sighting: sighting.range_m))


def describe_view(number: int, place: str, sightings: tuple[DetectedThing, ...]) -> dict[str, Any]:
    """Return the arguments of `write_semantic_data` for what is seen from here."""
    clear = [sighting for sighting in sightings if sighting.range_m <= CLEAR_RANGE_M]
    names = ", ".join(dict.fromkeys(sighting.label for sighting in clear))
    seen = f"The simulated detector reports: {names}." if names else "Nothing it knows is near."
    return {
        "name": f"view {number}",
        "description": f"View from {place}. {seen}",
        "safety_landmarks": [thing.as_landmark() for thing in clear if thing.is_safety],
        "functional_landmarks": [thing.as_landmark() for thing in clear if not thing.is_safety],
        "geometric_features": [f"stands in {place}"],
    }
