"""Several places in order, planned as a whole and driven one after the other."""

from mapspeak.driving.routes.following import (
    RouteBook,
    RouteProgress,
    RouteState,
    Stop,
    StopState,
    WhenBlocked,
)
from mapspeak.driving.routes.planning import Candidate, RoutePlan, find_candidates, plan_route

__all__ = [
    "Candidate",
    "RouteBook",
    "RoutePlan",
    "RouteProgress",
    "RouteState",
    "Stop",
    "StopState",
    "WhenBlocked",
    "find_candidates",
    "plan_route",
]
