"""What happens in a building for a while: closures and notices, as data that planning can use."""

from mapspeak.semantic.events.event import (
    OPEN_AGAIN,
    ROBOT,
    SHUT,
    Effect,
    Event,
    current_events,
    find_place_ids,
    is_name_of_robot,
)
from mapspeak.semantic.events.wording import gives_orders, tell_place

__all__ = [
    "OPEN_AGAIN",
    "ROBOT",
    "SHUT",
    "Effect",
    "Event",
    "current_events",
    "find_place_ids",
    "gives_orders",
    "is_name_of_robot",
    "tell_place",
]
