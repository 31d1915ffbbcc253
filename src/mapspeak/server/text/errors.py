"""Errors in words: what is wrong, and the tool that does the next step."""

from mapspeak.errors import MapspeakError, NextStep
from mapspeak.server.text.offered import lead

STEPS = {
    NextStep.CHOOSE_ON_MAP: "{hint}. Call {look_at_map} and choose another one.",
    NextStep.DRIVE_THERE: "{hint}. Call {navigate_to} with it. {look_at_map} shows other places.",
    NextStep.SEE_PLACES: "{hint}. {look_at_map} shows them.",
    NextStep.MEASURE: "Name another place. {look_at_map} shows them.",
    NextStep.MEASURE_BETWEEN: "Leave one of them out. {measure} tells of the way between.",
    NextStep.READ_MORE: "{hint}. {find_place} says more.",
    NextStep.LOOK_AROUND: "Choose another place. {describe_place} tells of {about}.",
    NextStep.LOOK_FROM: "Look from {about}. {navigate_to} goes there.",
    NextStep.CHECK_NEAR: "{hint}. {check_goal} finds a pose near it that works.",
    NextStep.WAIT_OR_CANCEL: "Wait for its end with {wait_for_goal}. {cancel_goal} ends it.",
    NextStep.WAIT_OR_STOP: "{hint}. {stop_robot} ends it.",
    NextStep.DRIVE_FIRST: "Call {navigate_to} first.",
    NextStep.DRIVE_AGAIN: "Call {navigate_to} again when it may drive.",
    NextStep.DRIVE_ROUND: "{hint}. {navigate_to} leads round.",
    NextStep.USE_OTHER_TOOLS: "To drive use {navigate_to}. To stop use {stop_robot}. {hint}.",
    NextStep.BEGIN_ROUTE: "Call {follow_route} with its stops.",
}
"""What is said in place of a hint in plain words, with or without it."""


def say_error(error: MapspeakError) -> str:
    """Say what is wrong and what to do next, by the tools there are."""
    return f"{error.message} {say_hint(error)}".rstrip()


def say_hint(error: MapspeakError) -> str:
    """Say what to do next, by the tools there are."""
    if error.step is None:
        return error.hint
    return lead(STEPS[error.step], hint=error.hint.removesuffix("."), about=error.about)
