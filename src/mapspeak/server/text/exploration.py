"""An exploration in words: why a call ended, where the robot goes next, and what is left out."""

from collections import Counter

from mapspeak.driving.exploration.blocked import BlockedPlace, TripEnd
from mapspeak.driving.exploration.progress import BoundKind, ExplorationState, Progress
from mapspeak.driving.exploration.trips import Target
from mapspeak.robot import GoalState
from mapspeak.server.text.drives import say_cause
from mapspeak.server.text.frontiers import say_merits, say_refusal
from mapspeak.server.text.wording import say_point
from mapspeak.spatial.frontiers import RefusalReason, RefusedFrontier

MOST_CLOSED = 3


STATES = {
    ExplorationState.DRIVING: "There is more to explore.",
    ExplorationState.AT_GOAL: "The robot stands at a frontier.",
    ExplorationState.NOTHING_KNOWN: "No free floor is known yet.",
    ExplorationState.INTERRUPTED: "Something ended the drive.",
}


def say_progress(progress: Progress) -> str:
    """Say why a call of an exploration ended as it did."""
    if progress.seen_id is not None:
        return f"What {progress.seen_id} promised has been seen from here."
    match progress.state:
        case ExplorationState.BOUND_REACHED:
            return _say_bound(progress)
        case ExplorationState.NOTHING_LEFT:
            return f"Nothing is left to explore{_say_not_worth(progress.not_worth)}."
        case ExplorationState.REST_UNREACHABLE:
            return _say_rest(progress)
        case ExplorationState.INTERRUPTED if said := say_trip_end(progress.trip_end):
            return said
    return STATES[progress.state]


def _say_bound(progress: Progress) -> str:
    match progress.bound:
        case BoundKind.DURATION:
            return f"{progress.bounds.duration_s:.0f} s have passed."
        case BoundKind.KNOWN:
            known_percent = 100 * (progress.bounds.known_ratio or 0.0)
            return f"{known_percent:.0f} % of the floor to be expected are known."
    goals = "goal was" if progress.n_goals == 1 else "goals were"
    return (
        f"{progress.n_goals} {goals} tried: {progress.n_arrived} reached, {progress.n_seen} seen "
        f"from afar, {progress.n_blocked} blocked."
    )


def _say_not_worth(borders: tuple[RefusedFrontier, ...]) -> str:
    if not borders:
        return ": all was seen"
    left_m = sum(each.length_m for each in borders)
    places = "places" if len(borders) > 1 else "place"
    return f" that is worth a drive; {left_m:.1f} m of border in {len(borders)} {places} stay"


def _say_rest(progress: Progress) -> str:
    closed = " and ".join(f"the {area.title}" for area in progress.closed[:MOST_CLOSED])
    reasons = Counter(each.reason for each in progress.unreachable)
    counted = (
        (reasons[RefusalReason.CLOSED_OFF], f"behind what is closed ({closed})"),
        (reasons[RefusalReason.TOO_NARROW], "behind gaps too narrow for the robot"),
        (reasons[RefusalReason.NO_WAY], "behind walls"),
        (len(progress.blocked), "where driving there failed"),
    )
    parts = ", ".join(f"{n} {where}" for n, where in counted if n)
    left_m = sum(each.length_m for each in progress.unreachable)
    return f"What is left cannot be reached: {parts}; {left_m:.1f} m of border with the unknown."


def say_target(target: Target) -> str:
    """Say where the robot goes next, and why there."""
    if target.earlier is not None:
        return f"{target.id}: another try; before: {say_trip_end(target.earlier.end)}"
    return f"{target.id}: {say_merits(target.frontier) if target.frontier else ''}"


def say_blocked(place: BlockedPlace) -> str:
    """Say where the robot could not get to, and why."""
    times = f"{place.n_tries} times" if place.n_tries > 1 else "once"
    where = f"{place.id} at {say_point(place.pose.point)}"
    return f"{where}, tried {times}: {say_trip_end(place.end)}"


def say_unreachable(border: RefusedFrontier) -> str:
    """Say where a border with the unknown is that the robot cannot get to, and why."""
    where = f"{border.length_m:.1f} m of border at {say_point(border.anchor)}"
    return f"{where}: {say_refusal(border)}"


def say_trip_end(end: TripEnd | None) -> str:
    """Say why a trip ended before its target: as the robot says it, else how its drive ended."""
    if end is None or end.cause is not None or end.goal_state is None:
        return "" if end is None else say_cause(end.cause)
    if end.goal_state in (GoalState.CANCELLED, GoalState.PREEMPTED):
        return f"{end.goal_id} was {end.goal_state}."
    return f"The drive ended as {end.goal_state}."
