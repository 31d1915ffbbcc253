"""Drives, routes, explorations and searches in words: why they ended, and what comes next."""

from collections import Counter

from mapspeak.driving.drivereport import Drive
from mapspeak.driving.exploration.blocked import BlockedPlace, TripEnd
from mapspeak.driving.exploration.progress import BoundKind, ExplorationState, Progress
from mapspeak.driving.exploration.trips import Target
from mapspeak.driving.routes.following import RouteProgress, RouteState
from mapspeak.driving.routes.planning import RouteStop, StopState
from mapspeak.driving.search.candidates import CandidateKind, SearchCandidate
from mapspeak.driving.search.evidence import Earlier
from mapspeak.driving.search.progress import BudgetKind, SearchProgress, SearchState
from mapspeak.errors import LinkError
from mapspeak.geometry import Point
from mapspeak.places.goalcheck import say_check
from mapspeak.robot import Cause, CauseCode, GoalState, GoalStatus
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import say_count, say_point
from mapspeak.server.text.world.maps import say_merits, say_refusal
from mapspeak.server.text.world.notices import say_off
from mapspeak.spatial.frontiers import RefusalReason, RefusedFrontier
from mapspeak.worldmodel.remembered import RememberedThing

WORDS = {
    CauseCode.CANCELLED: "It was cancelled.",
    CauseCode.STOPPED: "The robot was stopped.",
    CauseCode.REPLACED: "A newer goal took its place.",
    CauseCode.REPLACED_BY_OTHERS: "Another client sent a newer goal.",
    CauseCode.CLIENT_GONE: "The client that sent the robot hung up.",
    CauseCode.CLIENT_SILENT: "No client was heard for {after_s:.0f} s.",
    CauseCode.SERVER_ENDED: "The server ended.",
    CauseCode.HELD: "The robot is held: {quote}.",
    CauseCode.REFUSED: "{quote}",
    CauseCode.WAITING: "It waits for the drive before it.",
    CauseCode.PREVIOUS_ENDED: "The drive before it has ended: {previous}",
    CauseCode.POSE_JUMPED: (
        "The pose jumped by {distance_m:.1f} m: the robot was carried away, or has lost its place."
    ),
    CauseCode.POSE_UNKNOWN: (
        "The robot was stopped: where it is was unknown for {after_s:.0f} s. {quote}"
    ),
    CauseCode.ROBOT_SILENT: "The robot was silent for {after_s:.0f} s. {quote}",
    CauseCode.CLOCK_STANDS: (
        "The robot's clock has stood for {after_s:.0f} s: a simulation is paused or has ended."
    ),
    CauseCode.NOT_BEGUN: (
        "The navigation has not begun for {after_s:.0f} s; the goal was withdrawn."
    ),
    CauseCode.NOT_MOVED: (
        "The navigation has not moved the robot for {after_s:.0f} s; the goal was withdrawn."
    ),
    CauseCode.STOOD_STILL: (
        "The robot has stood still for {after_s:.0f} s, {distance_m:.2f} m from the goal."
    ),
    CauseCode.GOAL_CLOSED: "The goal now lies in the {name}; the robot was stopped.",
    CauseCode.GOAL_OFF_MAP: (
        "The map has changed: the goal is off the map now; the robot was stopped."
    ),
    CauseCode.GOAL_OCCUPIED: (
        "The map has changed: the goal has an obstacle on it now; the robot was stopped."
    ),
    CauseCode.NAVIGATION_AT_AREA: (
        "The robot was stopped {distance_m:.2f} m before the {name}: its own navigation was about "
        "to drive into it, though it was led round."
    ),
    CauseCode.NO_WAY_ROUND: (
        "The robot was stopped {distance_m:.2f} m before the {name}: no known way leads round."
    ),
    CauseCode.VELOCITY_AT_AREA: (
        "The robot was stopped {distance_m:.2f} m before the {name}: a published velocity was "
        "about to drive into it. Drive it away from there, or send it to a goal: ways lead round."
    ),
    CauseCode.OTHERS_AT_AREA: (
        "The robot was stopped {distance_m:.2f} m before the {name}: something that mapspeak did "
        "not start was about to drive into it. Find out what drives it: another client's goal, or "
        "velocities of its own."
    ),
    CauseCode.NOT_SENT_ON: (
        "The robot went part of the way round what is closed and could not be sent on: it was "
        "stopped. {quote}"
    ),
    CauseCode.NOT_TAKEN: (
        "{name} gave no sign of taking the goal within {after_s:g} s: it was withdrawn, and is "
        "cancelled should it be taken later. {check}"
    ),
    CauseCode.REJECTED: "{name} rejected the goal. {quote}",
    CauseCode.NAVIGATION_LOST: (
        "{quote} {name} hangs, or it or the robot was restarted, or has ended. {check}"
    ),
    CauseCode.NAVIGATION_MUTE: "{name} gave up and did not say why.",
    CauseCode.NAVIGATION_SAID: "{quote}",
}
CHECK = {
    "move_base": "Check that move_base runs and that the robot knows where it is.",
    "Navigation": (
        "Check that Nav2 is active (`ros2 lifecycle get /bt_navigator`), that the robot knows "
        "where it is, and that the goal lies on the map."
    ),
}


def not_stopped(error: LinkError) -> LinkError:
    """Return the error of a stop that did not reach the robot, as a person must read it."""
    return LinkError(
        f"NOT STOPPED: {error.message}",
        hint=f"The robot may still move: press its own stop button. {error.hint}",
    )


def say_cause(cause: Cause | None) -> str:
    """Say why a drive ended as it did, or why it waits; empty where nobody said."""
    if cause is None:
        return ""
    return WORDS[cause.code].format(
        after_s=cause.after_s,
        distance_m=cause.distance_m,
        name=cause.name,
        quote=cause.quote,
        previous=say_cause(cause.previous),
        check=CHECK.get(cause.name, ""),
    )


def say_end(
    status: GoalStatus, thing: RememberedThing | None = None, robot: Point | None = None
) -> str:
    """Say why a drive ended as it did, and what became of it since; empty where nobody said.

    Args:
        thing: What it went to see: how far that is counts where the robot has arrived.
        robot: Where the robot is; None where that is not sure.
    """
    said = " ".join(filter(None, (say_cause(status.cause), status.afterwards)))
    if said or thing is None or robot is None or status.state is not GoalState.ARRIVED:
        return said
    return f"{say_off(robot, thing)}."


def say_on_the_way(drive: Drive) -> str:
    """Say of a picture that it was not taken at a drive's end."""
    said = f"Taken on the way: {drive.goal_id} to {drive.place} has not ended."
    return " ".join(filter(None, (said, lead("Call {wait_for_goal}."))))


def say_route(progress: RouteProgress) -> str:
    """Say why a call of a route ended as it did."""
    if progress.state is RouteState.DONE:
        stops = (*progress.plan.stops, *progress.plan.left_out)
        n_skipped = sum(stop.state is StopState.SKIPPED for stop in stops)
        left_out = f", {n_skipped} of them left out" if n_skipped else ""
        return f"No stop is left{left_out}."
    if progress.state is RouteState.PLANNED:
        return "The route is only planned."
    if progress.number is None:
        return _say_driving(progress)
    stop, number = progress.plan.stops[progress.number], progress.number + 1
    words = stop.asked
    if progress.state is RouteState.AT_STOP:
        off = say_off(progress.pose.point, stop.goal.thing)
        return f"The robot stands at stop {number}, {words}.{off and f' {off}.'}"
    if progress.ended is not None:
        return (
            say_cause(progress.ended.cause)
            or f"The drive to stop {number} was {progress.ended.state}."
        )
    return f"Stop {number}, {words}: {say_obstacle(stop)}"


def _say_driving(progress: RouteProgress) -> str:
    if not progress.is_pausing:
        return "There are stops left."
    is_last = all(stop.state is not StopState.AHEAD for stop in progress.plan.stops)
    return f"The robot pauses at {'the last' if is_last else 'a'} stop."


def say_obstacle(stop: RouteStop) -> str:
    """Say why a stop was left out, or could not be reached yet."""
    if stop.obstacle is None:
        return ""
    if isinstance(stop.obstacle, GoalStatus):
        return say_cause(stop.obstacle.cause) or f"the drive was {stop.obstacle.state}"
    return say_check(stop.obstacle)


MOST_CLOSED = 3

EXPLORATION_STATES = {
    ExplorationState.DRIVING: "There is more to explore.",
    ExplorationState.AT_GOAL: "The robot stands where something new can be seen.",
    ExplorationState.NOTHING_KNOWN: "No free floor is known yet.",
    ExplorationState.INTERRUPTED: "Something ended the drive.",
}


def say_progress(progress: Progress) -> str:
    """Say why a call of an exploration ended as it did.

    At its end also how much of the walls pictures show, where that matters.
    """
    said, walls = _say_progress(progress), progress.pictured_ratio
    if walls is not None and progress.state.is_end:
        said += f" Pictures show {walls:.1%} of the walls."
    return said


def _say_progress(progress: Progress) -> str:
    if progress.seen_id is not None:
        return _say_seen(progress.seen_id, progress)
    match progress.state:
        case ExplorationState.BOUND_REACHED:
            return f"{_say_reached(progress)}{_say_left(progress)}"
        case ExplorationState.NOTHING_LEFT:
            return f"Nothing is left to explore{_say_not_worth(progress.not_worth)}."
        case ExplorationState.REST_UNREACHABLE:
            return _say_rest(progress)
        case ExplorationState.INTERRUPTED if said := say_trip_end(progress.trip_end):
            return said
    return EXPLORATION_STATES[progress.state]


def _say_seen(seen_id: str, progress: Progress) -> str:
    """Say that a frontier was seen from afar, and what is left there where it is still one."""
    said = f"Most of what {seen_id} promised has been seen from here"
    left = next((each for each in progress.frontiers if each.id == seen_id), None)
    return f"{said}." if left is None else f"{said}; about {left.gain_m2:.1f} m2 are left."


def _say_left(progress: Progress) -> str:
    """Say what a bound leaves: how many frontiers, and the largest of them."""
    if not progress.frontiers:
        return ""
    most = max(progress.frontiers, key=lambda each: each.gain_m2)
    total_m2 = sum(each.gain_m2 for each in progress.frontiers)
    if len(progress.frontiers) == 1:
        return f" Left: {most.id}, with about {total_m2:.1f} m2 to see."
    return (
        f" Left: {len(progress.frontiers)} frontiers with about {total_m2:.1f} m2 to see, most at "
        f"{most.id} ({most.gain_m2:.1f} m2)."
    )


def _say_reached(progress: Progress) -> str:
    match progress.bound:
        case BoundKind.DURATION:
            return f"{progress.bounds.duration_s:.0f} s have passed."
        case BoundKind.KNOWN:
            bound_percent = 100 * (progress.bounds.known_ratio or 0.0)
            return (
                f"{100 * progress.known_ratio:.0f} % of the expected floor is known; the bound was "
                f"{bound_percent:.0f} %."
            )
    goals = "goal was" if progress.n_goals == 1 else "goals were"
    ended = f", {progress.n_ended} ended from outside" if progress.n_ended else ""
    return (
        f"{progress.n_goals} {goals} tried: {progress.n_arrived} reached, {progress.n_seen} seen "
        f"from afar, {progress.n_blocked} blocked{ended}."
    )


def _say_not_worth(borders: tuple[RefusedFrontier, ...]) -> str:
    if not borders:
        return ": all was seen"
    left_m = sum(each.length_m for each in borders)
    where = f"{say_count(len(borders), 'place')} {'stay' if len(borders) > 1 else 'stays'}"
    return f" that is worth a drive; {left_m:.1f} m of border in {where}"


def _say_rest(progress: Progress) -> str:
    closed = " and ".join(f"the {area.title}" for area in progress.closed[:MOST_CLOSED])
    reasons = Counter(each.reason for each in progress.unreachable)
    counted = (
        (reasons[RefusalReason.CLOSED_OFF], f"behind what is closed ({closed})"),
        (reasons[RefusalReason.TOO_NARROW], "behind gaps too narrow for the robot"),
        (reasons[RefusalReason.PROVED_NARROW], "behind gaps that a drive did not pass"),
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
    merits = say_merits(target.frontier) if target.frontier else "walls that no picture shows"
    return f"{target.id}: {merits}"


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


SEARCH_STATES = {
    SearchState.DRIVING: "The robot is on its way.",
    SearchState.LOOK: "The robot looks at a new place.",
    SearchState.NOT_FOUND: "There is nowhere left to look.",
    SearchState.INTERRUPTED: "The drive was ended.",
}


def say_standing(standing: SearchProgress) -> str:
    """Say why a call of a search ended as it did, and what is new since the call before."""
    earlier = "" if standing.earlier is None else _say_earlier(standing.earlier)
    anew = "Nothing new is left: what only earlier pictures showed is looked at anew."
    told = (_say_state(standing), earlier, anew if standing.looks_anew else "")
    return " ".join(filter(None, told))


def _say_state(standing: SearchProgress) -> str:
    match standing.state:
        case SearchState.REPORTED:
            like = "" if standing.label == standing.thing else f", a name like {standing.thing}"
            return f"The robot's detector reports {standing.label}{like}."
        case SearchState.FOUND:
            return f"{standing.thing} was found."
        case SearchState.INTERRUPTED if said := say_trip_end(standing.trip_end):
            return said
        case SearchState.BUDGET_SPENT:
            return _say_spent(standing)
    return SEARCH_STATES[standing.state]


def _say_spent(standing: SearchProgress) -> str:
    if standing.spent is BudgetKind.LOOKS:
        return f"{standing.budget.n_looks} pictures were looked at."
    return f"{standing.budget.driven_m:.0f} m were driven."


def _say_earlier(earlier: Earlier) -> str:
    """Say what earlier pictures count for; nothing where there were none."""
    told = []
    if earlier.reporting:
        ids = ", ".join(each.id for each in earlier.reporting)
        pictures = say_count(earlier.n_reporting, "earlier picture")
        told.append(f"the detector reported it in {pictures}: look again from {ids}")
    if earlier.looks:
        others = "others" if told else "earlier pictures"
        told.append(f"{len(earlier.looks)} {others} count as looked at, and had none")
    if earlier.n_unread:
        told.append(f"{earlier.n_unread} earlier pictures do not count: nobody looked for it then")
    said = "; ".join(told)
    return f"{said[:1].upper()}{said[1:]}." if said else ""


def say_candidate(candidate: SearchCandidate) -> str:
    """Say where the robot could look, and why there, with numbers."""
    return f"{candidate.id}: {_say_why(candidate)}"


def _say_why(candidate: SearchCandidate) -> str:
    away = f"{candidate.path_m:.1f} m away"
    if candidate.kind is CandidateKind.REMEMBERED:
        is_thing = candidate.id.startswith("T")
        what = "thing that is remembered" if is_thing else "remembered place"
        return f"a {what} speaks of it, {away}"
    if candidate.kind is CandidateKind.PICTURED:
        return f"the detector reported it in this picture, taken {away}"
    what = "unknown or unseen floor" if candidate.frontier else "floor not looked at yet"
    liking = "" if candidate.score == 0.5 else f", score {candidate.score:.2f}"
    return f"{candidate.area_m2:.1f} m2 of {what}, {away}{liking}"
