"""What became of goals and publications, in words."""

from collections.abc import Iterable, Mapping, Sequence

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.actions import ActionClient
from mapspeak.ros.activity import ActionGoal, ActionState
from mapspeak.ros.census import Nodes
from mapspeak.ros.definitions.types import Field
from mapspeak.ros.port import RosConnection
from mapspeak.server.text.offered import lead
from mapspeak.server.text.ros.listening import say_loss, say_nodes
from mapspeak.server.text.ros.refusals import STOP
from mapspeak.server.text.ros.values import cut, show_message, show_value
from mapspeak.server.text.ros.views import view_fields
from mapspeak.server.text.wording import say_count

NEXT_STEP = {
    ActionState.SUCCEEDED: "",
    ActionState.ABORTED: "The action server gave up: see its result and reason.",
    ActionState.CANCELLED: "It was cancelled before it was done.",
    ActionState.REJECTED: "It was not taken: check its values, and that the server is active.",
    ActionState.LOST: "Nobody knows how it ended: look at the robot, then send it again.",
}
UNANSWERED = (
    "Should it be taken later, it is cancelled at once. Check that the server is active; what has "
    "just started may not be found yet by all: then send it again."
)
GOES_ON = "It goes on. {ros_goal_status} waits for it, {ros_cancel_goal} ends it."
MOST_LISTED = 20
READ_AT_START = "A node of ROS 1 that runs may notice only when it is started again."
NO_TYPE_TOLD = "(its type is not told)"
UNTIL_STOPPED = " until the robot was stopped"
UNTIL_DRIVE = " until {goal_id} began, which drives the robot now"


def say_goal(
    handle: str, goal: ActionGoal, *, result_fields: Iterable[Field], connection: RosConnection
) -> str:
    """Say how a goal stands or ended, with its result or its latest feedback.

    Args:
        handle: The model's name of it.
        goal: As it stands now.
        result_fields: Of its result's type; empty where that is not described.
        connection: To the action's server.
    """
    passed_s = (goal.ended_s or anyio.current_time()) - goal.sent_s
    loss = "" if goal.is_over else say_loss(connection, since_s=goal.sent_s)
    reason = f"{goal.reason.rstrip('. ')}." if goal.reason else ""
    is_unanswered = goal.state is ActionState.REJECTED and goal.is_withdrawn
    step = UNANSWERED if is_unanswered else lead(NEXT_STEP.get(goal.state, GOES_ON))
    parts = [
        f"{handle} ({goal.action}): {goal.state} after {passed_s:.1f} s.",
        " ".join(filter(None, (loss, reason, goal.afterwards, step))),
    ]
    if goal.result is not None:
        views, plain = view_fields(result_fields, goal.result)
        parts += ["result:", *(f"{name}: {view.text}" for name, view in views.items())]
        parts += [show_message(plain)] if plain or not views else []
    elif goal.feedback is not None:
        parts.append(f"latest feedback of {goal.n_feedback}:\n{show_message(goal.feedback)}")
    return cut("\n".join(filter(None, parts)))


def say_goals(client: ActionClient, handles: Mapping[str, str], loss: str) -> str:
    """Return the latest goals that an action server knows, under their number.

    Args:
        client: Of the action.
        handles: Of goals that were sent with the tools, by their ids.
        loss: What is said of a lost connection.
    """
    ours = {at: f"ours, {handles.get(goal.id, 'of a drive')}" for at, goal in client.ours.items()}
    lines = [f"{at}: {state}, {ours.get(at, 'not ours')}" for at, state in client.listed.items()]
    head = f"{say_count(len(lines), 'goal')}, by the server's ids:"
    return "\n".join([head, *(lines[-MOST_LISTED:] or ["none"]), *filter(None, [loss])])


def say_published(
    topic: str, n_sent: int, passed_s: float, ended_by: str, *, then_stood: bool = False
) -> str:
    """Say how often a message was published, and what ended it before its time."""
    times = "once" if n_sent == 1 else f"{n_sent} times"
    stood = ", then a stand" if then_stood else ""
    return f"Published {times} in {passed_s:.2f} s{ended_by}{stood} on {topic}"


def say_going_on(left_s: float | None) -> str:
    """Say that another publication still moves the robot, even after a zero velocity."""
    if left_s is None:
        return ""
    return f"Another publication goes on there for {left_s:.1f} s. {lead(STOP)}".rstrip()


def say_hearers(hearers: Nodes | LinkError) -> str:
    """Say who heard what was published."""
    if isinstance(hearers, LinkError):
        return f"Who heard it is not known: {hearers.message}"
    return f"Heard by: {say_nodes(hearers)}."


def say_set(node: str, parameter: str, before: object, after: object, notes: Sequence[str]) -> str:
    """Say what a parameter was and is now, and what is to be noted of that."""
    said = f"{parameter} of {node} was {show_value(before)}, is {show_value(after)} now."
    return " ".join([said, *filter(None, notes)])


def say_deleted(node: str, parameter: str) -> str:
    """Say that a parameter is gone."""
    return f"{parameter} of {node} is deleted."


def say_new(near: Sequence[str]) -> str:
    """Say that a parameter was not there, and which one may have been meant."""
    return f"It is new{f': the nearest that it had is {near[0]}' if near else ''}."
