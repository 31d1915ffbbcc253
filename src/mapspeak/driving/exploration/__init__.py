"""Exploring: frontier after frontier, until nothing is left or what is left cannot be reached."""

from mapspeak.driving.exploration.blocked import BlockedPlace, BlockedPlaces, TripEnd, has_room_at
from mapspeak.driving.exploration.explorer import Explorer, Pick, take_first
from mapspeak.driving.exploration.progress import (
    BoundKind,
    Bounds,
    ExplorationState,
    Progress,
)
from mapspeak.driving.exploration.trips import (
    SLACK_S,
    OnTrip,
    Target,
    Trip,
    TripContext,
    Trips,
    TripState,
    spread_headings,
    turn_to,
)

__all__ = [
    "SLACK_S",
    "BlockedPlace",
    "BlockedPlaces",
    "BoundKind",
    "Bounds",
    "ExplorationState",
    "Explorer",
    "OnTrip",
    "Pick",
    "Progress",
    "Target",
    "Trip",
    "TripContext",
    "TripEnd",
    "TripState",
    "Trips",
    "has_room_at",
    "spread_headings",
    "take_first",
    "turn_to",
]
