"""The end of a drive in words."""

from mapspeak.robot import Cause, CauseCode, GoalStatus

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
        "to drive into it. Lead it round by goals on the way."
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


def say_end(status: GoalStatus) -> str:
    """Say why a drive ended as it did, with what became of it since; empty where nobody said."""
    return " ".join(filter(None, (say_cause(status.cause), status.afterwards)))
