"""What the model reads while the robot follows a route."""

from typing import Self

from pydantic import Field

from mapspeak.driving.routes.following import RouteProgress, RouteState
from mapspeak.driving.routes.planning import RoutePlan, RouteStop, StopState
from mapspeak.server.reports.maps import PoseReport, Report
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import say_pose_doubt
from mapspeak.server.text.world.drives import say_obstacle, say_route

DETOUR_M = 0.05
NEXT_STEP = {
    RouteState.DRIVING: "Call {follow_route} without stops to go on. {stop_robot} ends it.",
    RouteState.AT_STOP: "Look, record what matters, then call {follow_route} without stops.",
    RouteState.BLOCKED: (
        "Call {follow_route} without stops to try again, or with when_blocked=skip to leave it out."
    ),
    RouteState.INTERRUPTED: (
        "The robot was stopped or sent elsewhere. Call {follow_route} without stops to go on."
    ),
    RouteState.DONE: "The route is over.",
}


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
            greedy_m=round(plan.greedy_m, 1) if _is_better(plan) else None,
            as_given_m=None if plan.as_given_m is None else round(plan.as_given_m, 1),
            robot=PoseReport.of(progress.pose),
            pose_uncertain=say_pose_doubt(progress.pose_doubt),
            next_step=lead(NEXT_STEP[progress.state]),
        )


def _is_better(plan: RoutePlan) -> bool:
    return plan.greedy_m > plan.total_m + DETOUR_M


def _say(stop: RouteStop) -> str:
    """Return the words of a stop, with what they are taken for where that is something else."""
    name, words = stop.goal.name, " ".join(stop.asked.split())
    is_point = name.startswith("(")
    return name if is_point or name.casefold() == words.casefold() else f"{words} ({name})"


def _say_in_full(stop: RouteStop) -> str:
    return stop.goal.title if stop.goal.title.startswith(stop.asked) else _say(stop)
