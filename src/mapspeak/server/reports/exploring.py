"""What the model reads while the robot explores, searches or follows a route."""

import math
from collections.abc import Sequence
from typing import Self

from pydantic import Field

from mapspeak.driving.exploration.progress import BoundKind, ExplorationState, Progress
from mapspeak.driving.routes.following import RouteProgress, RouteState
from mapspeak.driving.routes.planning import RoutePlan, RouteStop, StopState
from mapspeak.driving.search.progress import SearchProgress, SearchState, SeenRegion
from mapspeak.memory import TakenPicture
from mapspeak.server.reports.maps import PoseReport, Report
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import say_pose, say_pose_doubt
from mapspeak.server.text.world.drives import (
    say_blocked,
    say_candidate,
    say_obstacle,
    say_progress,
    say_route,
    say_standing,
    say_target,
    say_unreachable,
)
from mapspeak.server.text.world.maps import say_merits

MOST_NAMED = 8
WHOLE_RATIO = 0.9

NEXT_STEP = {
    ExplorationState.DRIVING: "Call {explore} again to go on. {stop_robot} ends it.",
    ExplorationState.AT_GOAL: (
        "Look at the picture. Record what matters with {write_semantic_data}. Call {explore} to go "
        "on."
    ),
    ExplorationState.BOUND_REACHED: "Call {explore} again to go on as far again.",
    ExplorationState.NOTHING_LEFT: "Call {look_at_map}.",
    ExplorationState.REST_UNREACHABLE: (
        "All that can be reached is known. Where cannot_reach says closed, open it or wait, then "
        "call {explore} again."
    ),
    ExplorationState.NOTHING_KNOWN: "Start SLAM, or wait until the first map has floor on it.",
    ExplorationState.INTERRUPTED: (
        "The robot was stopped or sent elsewhere. Call {explore} to go on."
    ),
}

RAISE_BOUND = (
    "A room may lie behind any frontier that is left: call {explore} with a higher known_percent, "
    "or without it, to see the rest. With the same bound it ends at once."
)
DETOUR_M = 0.05
ROUTE_NEXT_STEP = {
    RouteState.DRIVING: "Call {follow_route} without stops to go on. {stop_robot} ends it.",
    RouteState.AT_STOP: (
        "Look. Record what matters with {write_semantic_data}. Then call {follow_route} without "
        "stops."
    ),
    RouteState.PLANNED: (
        "Nothing was driven and no route was changed. Call {follow_route} with these stops, "
        "without drive=false, to drive it."
    ),
    RouteState.BLOCKED: (
        "Call {follow_route} without stops to try again, or with when_blocked=skip to leave it out."
    ),
    RouteState.INTERRUPTED: (
        "The robot was stopped or sent elsewhere. Call {follow_route} without stops to go on."
    ),
    RouteState.DONE: "The route is over.",
}


class ExploreAnswer(Report):
    """How an exploration stands."""

    state: ExplorationState = Field(description="driving and at_goal go on with the next call")
    reason: str
    n_goals: int = Field(
        description="frontiers it set out to: n_arrived, n_seen, n_blocked, n_ended and the one "
        "under way"
    )
    n_arrived: int
    n_seen: int = Field(description="left on the way: seen from afar")
    n_blocked: int
    n_ended: int = Field(description="cancelled, or ended by a stop or another goal")
    driven_m: float
    elapsed_s: float = Field(description="robot time of all calls of this exploration")
    known_area_m2: float = Field(description="free floor on the map")
    known_percent: float = Field(description="of the floor that is to be expected")
    walls_pictured_percent: float | None = Field(description="of those in sight; for the camera")
    frontiers: list[str] = Field(description="ids, the one under way first, then best first")
    n_frontiers: int
    next: str = Field(description="the frontier under way or to come, and what speaks for it")
    goal_id: str | None
    robot: PoseReport
    pose_uncertain: str = Field(description="why the robot may be elsewhere; empty if it is not")
    cannot_reach: list[str] = Field(
        description="what was blocked and, at the end, what is left: where, and why"
    )
    on_the_way: list[str] = Field(
        description="in pictures taken on the way, which count but are not shown: what the "
        "detector reports there alone (bearing, left positive; range)"
    )
    next_step: str

    @classmethod
    def of(cls, progress: Progress, on_the_way: Sequence[TakenPicture] = ()) -> Self:
        """Make the report of an exploration, and of what was seen on the way since the last."""
        trip = progress.trip
        return cls(
            state=progress.state,
            reason=say_progress(progress),
            n_goals=progress.n_goals,
            n_arrived=progress.n_arrived,
            n_seen=progress.n_seen,
            n_blocked=progress.n_blocked,
            n_ended=progress.n_ended,
            driven_m=round(progress.driven_m, 1),
            elapsed_s=round(progress.elapsed_s, 1),
            known_area_m2=round(progress.known_area_m2, 1),
            known_percent=round(100 * progress.known_ratio, 1),
            walls_pictured_percent=_percent(progress.pictured_ratio),
            frontiers=_list_frontiers(progress)[:MOST_NAMED],
            n_frontiers=len(progress.frontiers),
            next=_say_next(progress),
            goal_id=None if trip is None else trip.goal_id,
            robot=PoseReport.of(progress.pose),
            pose_uncertain=say_pose_doubt(progress.pose_doubt),
            cannot_reach=_say_rest(progress),
            on_the_way=[_say_readings(each) for each in on_the_way],
            next_step=lead(_find_next_step(progress)),
        )


def _list_frontiers(progress: Progress) -> list[str]:
    ids = [frontier.id for frontier in progress.frontiers]
    under_way = "" if progress.trip is None else progress.trip.target.id
    return sorted(ids, key=lambda each: each != under_way)


def _find_next_step(progress: Progress) -> str:
    if progress.bound is BoundKind.KNOWN:
        return RAISE_BOUND if progress.frontiers else "No frontier is left. Call {look_at_map}."
    return NEXT_STEP[progress.state]


def _percent(ratio: float | None) -> float | None:
    return None if ratio is None else round(100 * ratio, 1)


def _say_next(progress: Progress) -> str:
    """Say where it goes by the frontiers as they are: the one under way may be none any more."""
    target = None if progress.trip is None else progress.trip.target
    if target is not None and target.frontier is None:
        return say_target(target)
    ids = _list_frontiers(progress)
    following = next((each for each in progress.frontiers if each.id == ids[0]), None)
    return "" if following is None else f"{following.id}: {say_merits(following)}"


def _say_rest(progress: Progress) -> list[str]:
    """Say what was blocked, and in the end also which borders are out of reach."""
    unreachable = progress.unreachable if progress.state.is_end else ()
    told = [
        *(say_blocked(place) for place in progress.blocked),
        *(say_unreachable(border) for border in unreachable),
        *(f"{say_blocked(place)} Nothing is left there." for place in progress.passed_over),
    ]
    left_out = len(told) - MOST_NAMED
    return told if left_out <= 0 else [*told[:MOST_NAMED], f"and {left_out} more"]


def _say_readings(picture: TakenPicture) -> str:
    """Say where a picture was taken, and what is reported in it."""
    things = (
        f"{each.label}, {math.degrees(each.bearing_rad):+.0f} deg, {each.range_m:.1f} m"
        for each in picture.readings
    )
    return f"{picture.id} at {say_pose(picture.pose)}: {'; '.join(things)}"


def _say_seen(regions: Sequence[SeenRegion]) -> list[str]:
    """Say how much of rooms was seen: of those that were not seen as good as whole."""
    partly = [each for each in regions if each.seen_ratio < WHOLE_RATIO]
    partly.sort(key=lambda each: each.seen_ratio)
    told = [f"{each.id} {100 * each.seen_ratio:.0f} %" for each in partly[:MOST_NAMED]]
    n_more, n_whole = len(partly) - len(told), len(regions) - len(partly)
    told += [f"and {n_more} more in part"] if n_more else []
    return [*told, f"{n_whole} at least {WHOLE_RATIO:.0%}"] if n_whole else told


SEARCH_STEP = {
    SearchState.DRIVING: "Call {search_for} again to go on. {stop_robot} ends it.",
    SearchState.LOOK: "Judge the picture, then call {search_for} with seen and, if not, likely.",
    SearchState.REPORTED: "Judge the picture, then call {search_for} with seen.",
    SearchState.FOUND: "Remember the place with {write_semantic_data}.",
    SearchState.NOT_FOUND: "It is in none of the places seen, as far as pictures showed them.",
    SearchState.BUDGET_SPENT: "Call {search_for} again for a new search, or look elsewhere.",
    SearchState.INTERRUPTED: "The robot was stopped or sent elsewhere. Call {search_for} to go on.",
}


class SearchAnswer(Report):
    """How a search stands."""

    state: SearchState = Field(description="driving, look and reported go on with the next call")
    reason: str
    thing: str
    n_looks: int = Field(description="pictures shown so far, this one included")
    n_earlier: int = Field(description="pictures from before that count as looked at, for now")
    driven_m: float
    looks_at: str = Field(description="where the robot looks or is on its way to, and why there")
    goal_id: str | None
    next: list[str] = Field(description="where it could look next, best first; F ids take scores")
    seen_percent: float = Field(description="of the known floor, by the camera from near")
    places_seen: list[str] = Field(description="in the end: of each room, the least seen first")
    cannot_reach: list[str]
    robot: PoseReport
    pose_uncertain: str = Field(description="why the robot may be elsewhere; empty if it is not")
    next_step: str

    @classmethod
    def of(cls, standing: SearchProgress) -> Self:
        """Make the report of a search."""
        return cls(
            state=standing.state,
            reason=say_standing(standing),
            thing=standing.thing,
            n_looks=standing.n_looks,
            n_earlier=standing.n_earlier,
            driven_m=round(standing.driven_m, 1),
            looks_at="" if standing.here is None else say_candidate(standing.here),
            goal_id=standing.goal_id,
            next=[say_candidate(candidate) for candidate in standing.next],
            seen_percent=round(100 * standing.seen_ratio, 1),
            places_seen=_say_seen(standing.regions),
            cannot_reach=[say_blocked(place) for place in standing.blocked][:MOST_NAMED],
            robot=PoseReport.of(standing.pose),
            pose_uncertain=say_pose_doubt(standing.pose_doubt),
            next_step=lead(SEARCH_STEP[standing.state]),
        )


class RouteAnswer(Report):
    """How a route stands."""

    state: RouteState = Field(description="driving, at_stop: call again to go on")
    reason: str
    done: list[str]
    skipped: list[str] = Field(description="with the reason")
    next: str = Field(description="the stop under way")
    remaining: list[str] = Field(description="the stops after that")
    left_m: float | None = Field(description="by path, to the next stop")
    legs_m: list[float] = Field(description="by path, as planned, from the robot on")
    total_m: float
    total_s: float | None = Field(
        description="pauses included, at its pace so far; null before it has driven"
    )
    greedy_m: float | None = Field(
        description="the total if the nearest candidate were taken each time, where that is more"
    )
    as_given_m: float | None = Field(description="the total in the order given, where that is more")
    robot: PoseReport
    pose_uncertain: str = Field(description="why the robot may be elsewhere; empty if it is not")
    next_step: str

    @classmethod
    def of(cls, progress: RouteProgress) -> Self:
        """Make the report of a route."""
        plan = progress.plan
        ahead = [stop for stop in plan.stops if stop.state is StopState.AHEAD]
        return cls(
            state=progress.state,
            reason=say_route(progress),
            done=[_say(stop) for stop in plan.stops if stop.state is StopState.DONE],
            skipped=[
                f"{_say(stop)}: {say_obstacle(stop)}"
                for stop in (*plan.stops, *plan.left_out)
                if stop.state is StopState.SKIPPED
            ],
            next=_say_in_full(ahead[0]) if ahead else "",
            remaining=[_say(stop) for stop in ahead[1:]],
            left_m=None if progress.left_m is None else round(progress.left_m, 1),
            legs_m=[round(stop.leg_m, 1) for stop in plan.stops],
            total_m=round(plan.total_m, 1),
            total_s=None if progress.whole_s is None else float(round(progress.whole_s)),
            greedy_m=round(plan.greedy_m, 1) if _is_better(plan) else None,
            as_given_m=None if plan.as_given_m is None else round(plan.as_given_m, 1),
            robot=PoseReport.of(progress.pose),
            pose_uncertain=say_pose_doubt(progress.pose_doubt),
            next_step=lead(ROUTE_NEXT_STEP[progress.state]),
        )


def _is_better(plan: RoutePlan) -> bool:
    return plan.greedy_m > plan.total_m + DETOUR_M


def _say(stop: RouteStop) -> str:
    """Return the words of a stop, with what they are taken for where that is something else."""
    name, words = stop.goal.name, " ".join(stop.asked.split())
    is_point = name.startswith("(")
    said = name if is_point or name.casefold() == words.casefold() else f"{words} ({name})"
    return f"{said}{_say_view(stop)}"


def _say_in_full(stop: RouteStop) -> str:
    title = stop.goal.title
    return f"{title}{_say_view(stop)}" if title.startswith(stop.asked) else _say(stop)


def _say_view(stop: RouteStop) -> str:
    """Say from how far a thing is seen at a stop, as it is remembered."""
    if (thing := stop.goal.thing) is None:
        return ""
    at = thing.thing.position
    where = "where it was seen" if at is None else f"{at.distance_to(stop.goal.pose.point):.1f} m"
    return f", from {where}"
