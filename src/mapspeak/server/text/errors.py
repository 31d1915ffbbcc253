"""Errors in words: what is wrong, and the tool that does the next step."""

from mapspeak.errors import MapspeakError, NextStep

STEPS = {
    NextStep.CHOOSE_ON_MAP: "{hint}; call look_at_map and choose another one.",
    NextStep.DRIVE_THERE: "{hint}; call navigate_to with it, or call look_at_map.",
    NextStep.SEE_PLACES: "{hint}. Call look_at_map to see them.",
    NextStep.MEASURE: "Call look_at_map, or measure, and name another place.",
    NextStep.MEASURE_BETWEEN: "Call measure between the two, and leave one of them out.",
    NextStep.READ_MORE: "{hint}; find_place says more.",
    NextStep.LOOK_AROUND: "Call describe_place with {about}, then choose another place.",
    NextStep.LOOK_FROM: "Call navigate_to with {about} and look from there.",
    NextStep.CHECK_NEAR: "{hint}, or call check_goal to find a pose near it that works.",
    NextStep.WAIT_OR_CANCEL: "Wait for its end with wait_for_goal, or end it with cancel_goal.",
    NextStep.WAIT_OR_STOP: "{hint} with stop_robot.",
    NextStep.DRIVE_FIRST: "Call navigate_to first.",
    NextStep.DRIVE_AGAIN: "Call navigate_to again when it may drive.",
    NextStep.DRIVE_ROUND: "{hint}, or use navigate_to, which leads round.",
    NextStep.USE_OTHER_TOOLS: "To drive use navigate_to, to stop stop_robot. {hint}.",
    NextStep.BEGIN_ROUTE: "Call follow_route with its stops.",
}
"""What is said instead of a hint in plain words, with or without it."""


def say_error(error: MapspeakError) -> str:
    """Say what is wrong and what to do next, by the tools there are."""
    return f"{error.message} {say_hint(error)}"


def say_hint(error: MapspeakError) -> str:
    """Say what to do next, by the tools there are."""
    if error.step is None:
        return error.hint
    return STEPS[error.step].format(hint=error.hint.removesuffix("."), about=error.about)
