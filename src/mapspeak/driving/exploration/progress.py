"""How an exploration stands, as a value."""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from mapspeak.driving.exploration.blocked import BlockedPlace, TripEnd
from mapspeak.driving.exploration.trips import Trip
from mapspeak.geometry import Point, Pose
from mapspeak.robot import PoseDoubt
from mapspeak.spatial.frontiers import (
    Frontier,
    FrontierVerdict,
    RefusalReason,
    RefusedFrontier,
)
from mapspeak.spatial.paths import DistanceField
from mapspeak.worldmodel.keepout import ClosedArea
from mapspeak.worldmodel.model import WorldModel

NEAR_M = 0.5
"""A border is reachable from floor within the robot's radius plus this."""
BESIDE_M = 1.5
"""A border with the unknown that is this near to a blocked place is what was to be seen there."""
OUT_OF_REACH = frozenset(
    {
        RefusalReason.NO_WAY,
        RefusalReason.TOO_NARROW,
        RefusalReason.PROVED_NARROW,
        RefusalReason.CLOSED_OFF,
    }
)


class ExplorationState(StrEnum):
    """How an exploration stands; all but the first two are an end, though not of the map."""

    DRIVING = "driving"
    AT_GOAL = "at_goal"
    BOUND_REACHED = "bound_reached"
    NOTHING_LEFT = "nothing_left"
    REST_UNREACHABLE = "rest_unreachable"
    NOTHING_KNOWN = "nothing_known"
    INTERRUPTED = "interrupted"

    @property
    def is_end(self) -> bool:
        """True when calling again begins anew instead of going on."""
        return self not in (ExplorationState.DRIVING, ExplorationState.AT_GOAL)


class BoundKind(StrEnum):
    """What an exploration is bounded by."""

    DURATION = "duration"
    GOALS = "goals"
    KNOWN = "known"


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """Where an exploration ends, whatever is left.

    Attributes:
        duration_s: So much robot time in calls.
        known_ratio: So much of the floor that is to be expected.
        for_camera: The camera is to see all walls, not the map alone to be complete.
        stops_at_goals: It pauses wherever the robot arrives, and where it sees from afar what it
            was sent to see, so that the caller can look around.
    """

    n_goals: int | None = None
    duration_s: float | None = None
    known_ratio: float | None = None
    stops_at_goals: bool = False
    for_camera: bool = False


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Progress:
    """How an exploration stands.

    Attributes:
        bound: The one that was reached, if one was.
        seen_id: The frontier seen from here, where it pauses for that.
        trip_end: What interrupted it; None where that is not known.
        n_seen: How many it left on the way, since what they were for had been seen from afar.
        n_ended: How many were cancelled, or ended by a stop or another goal.
        elapsed_s: Robot time of all calls.
        known_ratio: Of the free floor that is to be expected in all.
        frontiers: Where one could still go, best first.
        pose_doubt: Why it may be elsewhere.
        blocked: Where a drive failed and something unknown is left.
        passed_over: Where one failed and nothing is left, if this exploration counts any.
        pictured_ratio: Of the walls in sight of the floor in reach, the share that pictures show;
            None where the camera does not matter.
    """

    state: ExplorationState
    bounds: Bounds
    bound: BoundKind | None
    seen_id: str | None
    trip_end: TripEnd | None
    n_goals: int
    n_arrived: int
    n_seen: int
    n_blocked: int
    n_ended: int
    driven_m: float
    elapsed_s: float
    known_area_m2: float
    known_ratio: float
    frontiers: tuple[Frontier, ...]
    trip: Trip | None
    pose: Pose
    pose_doubt: PoseDoubt | None
    unreachable: tuple[RefusedFrontier, ...]
    blocked: tuple[BlockedPlace, ...]
    not_worth: tuple[RefusedFrontier, ...]
    closed: tuple[ClosedArea, ...]
    pictured_ratio: float | None = None
    passed_over: tuple[BlockedPlace, ...] = ()


def find_unreachable(world: WorldModel) -> tuple[RefusedFrontier, ...]:
    """Return borders with the unknown that the robot cannot get to, those closed off as such."""
    return tuple(each for each in find_refused(world) if each.reason in OUT_OF_REACH)


def find_refused(world: WorldModel) -> tuple[RefusedFrontier, ...]:
    """Return the borders with the unknown that are no place to go, those closed off as such."""
    return tuple(
        replace(each, reason=RefusalReason.CLOSED_OFF)
        if each.reason in OUT_OF_REACH and _is_closed_off(world, each)
        else each
        for each in world.frontiers.refused
    )


def _is_closed_off(world: WorldModel, border: RefusedFrontier) -> bool:
    """Return True where the robot would get near to a border if no area were closed."""
    if not world.map.areas:
        return False
    opened = world.map.open.distances_from(world.robot.point)
    is_near = _is_reached_near(opened, border.anchor)
    return is_near and not _is_reached_near(world.distances, border.anchor)


def _is_reached_near(distances: DistanceField, point: Point) -> bool:
    grid = distances.lattice.grid
    down, across = grid.window_around(point, distances.radius_m + NEAR_M)
    rows, cols = np.arange(down.start, down.stop), np.arange(across.start, across.stop)
    return bool(np.isfinite(distances.distances_at(rows[:, np.newaxis], cols)).any())


def is_unknown_beside(world: WorldModel, point: Point) -> bool:
    """Return True where something unknown is left that a drive to a point was for."""
    report = world.frontiers
    borders = [
        *(each.pose.point for each in report.frontiers),
        *(each.anchor for each in report.frontiers),
        *(each.anchor for each in report.refused),
    ]
    return any(point.distance_to(border) <= BESIDE_M for border in borders)


def find_not_worth(world: WorldModel) -> tuple[RefusedFrontier, ...]:
    """Return the borders with the unknown that are not worth a drive."""
    refused = world.frontiers.refused
    return tuple(each for each in refused if each.reason is RefusalReason.NOTHING_TO_SEE)


def judge_end(world: WorldModel, blocked: tuple[BlockedPlace, ...]) -> ExplorationState:
    """Return what it means that no frontier is left: all seen, or the rest out of reach."""
    if world.frontiers.verdict is FrontierVerdict.NOTHING_KNOWN:
        return ExplorationState.NOTHING_KNOWN
    if not find_unreachable(world) and not blocked:
        return ExplorationState.NOTHING_LEFT
    return ExplorationState.REST_UNREACHABLE
