"""A route in words: why a call ended, and why a stop was left out."""

from mapspeak.driving.routes.following import RouteProgress, RouteState
from mapspeak.driving.routes.planning import RouteStop, StopState
from mapspeak.places.goalcheck import say_check
from mapspeak.robot import GoalStatus
from mapspeak.server.text.drives import say_cause


def say_route(progress: RouteProgress) -> str:
    """Say why a call of a route ended as it did."""
    if progress.state is RouteState.DONE:
        n_skipped = sum(stop.state is StopState.SKIPPED for stop in progress.plan.stops)
        left_out = f", {n_skipped} of them left out" if n_skipped else ""
        return f"No stop is left{left_out}."
    if progress.number is None:
        return _say_driving(progress)
    stop = progress.plan.stops[progress.number]
    number, words = progress.number + 1, stop.asked
    if progress.state is RouteState.AT_STOP:
        return f"The robot stands at stop {number}, {words}."
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
