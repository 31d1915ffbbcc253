"""Several places in order, planned as a whole and driven one after the other."""

from mapspeak.driving.routes.following import (
    RouteBook,
    RouteProgress,
    RouteState,
    RouteStop,
    StopState,
    WhenBlocked,
)
from mapspeak.driving.routes.planning import RoutePlan, StopCandidate, find_candidates, plan_route

__all__ = [
    "RouteBook",
    "RoutePlan",
    "RouteProgress",
    "RouteState",
    "RouteStop",
    "StopCandidate",
    "StopState",
    "WhenBlocked",
    "find_candidates",
    "plan_route",
]
