"""What became of goals and publications, and what is said when a tool of ROS cannot do it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import anyio

from mapspeak.errors import ConfigError, GoalError, LinkError, MapspeakError
from mapspeak.installation import shell_command
from mapspeak.ros.actions import ActionClient
from mapspeak.ros.activity import ActionGoal, ActionState
from mapspeak.ros.census import Nodes
from mapspeak.ros.definitions.types import Field
from mapspeak.ros.port import RosConnection, find_nearest
from mapspeak.server.text.offered import lead
from mapspeak.server.text.ros.listening import say_loss, say_nodes
from mapspeak.server.text.ros.views import view_fields
from mapspeak.server.text.values import cut, show_message, show_value
from mapspeak.server.text.wording import say_count


@dataclass(frozen=True, slots=True)
class Refusal:
    """What is wrong and what to do next, with gaps.

    Attributes:
        hint: Its sentences that lead to tools are said where these are offered.
        kind: The kind of its error.
    """

    message: str
    hint: str
    kind: type[MapspeakError] = LinkError

    def error(self, **details: object) -> MapspeakError:
        """Return the error, with the gaps filled in."""
        return self.kind(self.message.format_map(details), hint=lead(self.hint, **details))


HOW_TO_GET_ROS = (
    "`{simulate}` makes the simulated robot one; connect to that, or to any other, with --robot "
    "ws://HOST:9090."
)
NO_ROS = Refusal("This robot is no ROS robot: the simulated one is none.", HOW_TO_GET_ROS)
NO_ROS_TOOLS = Refusal(
    f"The ros toolset needs a ROS robot. {NO_ROS.message}", HOW_TO_GET_ROS, ConfigError
)

NO_NAME = Refusal("{name!r} is no name in ROS.", "It looks like /map or /robot1/cmd_vel.")
NONE_AT_ALL = Refusal("The robot has no {what}s at all.", "Start its ROS nodes.")
NONE_SUCH = Refusal("The robot has no {what} {name!r}.", "{such} {names}. {listing}")

NO_TYPE = Refusal(
    "{type!r} is no full name of a type.",
    "{meant}It looks like geometry_msgs/msg/Twist (ROS 2) or geometry_msgs/Twist (ROS 1).",
)
UNTOLD_TYPE = Refusal(
    "The robot does not tell the type of {name}: {why}",
    "Give it as type, as `ros2 action list -t` says on the robot.",
)
NOT_INSTALLED = Refusal(
    "Unknown type {type}: the ROS on this machine does not have it.",
    "Install it: `sudo apt install ros-$ROS_DISTRO-{package}`, or source the workspace that has "
    "it, and start mapspeak again.",
)
UNKNOWN_TYPE = Refusal(
    "Unknown type {type}: neither the robot nor mapspeak describes it.{meant}",
    "Give its definition, as `ros2 interface show` (ROS 1: `rosmsg show -r`, `rossrv show -r`) "
    "prints it on the robot, with --- between the parts. {ros_type} takes it. In skills.yaml it is "
    "the key `definition`.",
)
KNOWN_TYPE = Refusal(
    "What a {type} looks like is known already.",
    "Call {ros_type} without a definition to see it.",
)
ODD_LINE = Refusal(
    "The definition of {type} has a line that defines nothing: {line!r}.",
    "A line is a type and a name, as in `float64 x`, or a constant: `uint8 A=1`.",
)
UNKNOWN_WITHIN = Refusal(
    "The definition of {type} holds the type {within}, which nobody knows.",
    "Give the definition of {within} to {ros_type} first.",
)
OTHER_TYPE = Refusal(
    "{topic} is a {known}, not a {given}.",
    "Leave the type away, and give the fields of its own type.",
)

NOTHING = "No message came on {topic} within {waited_s:g} s."
LOST_MEANWHILE = Refusal(f"{NOTHING} {{loss}}", "Read it again once the connection is back.")
UNPUBLISHED = Refusal(NOTHING, "{nobody} publishes it: start the node that should.")
SILENT = Refusal(
    NOTHING,
    "It is published by {publishers}, yet {silence}: its node may have died or be without data; "
    "what speaks seldom needs a larger wait_s.",
)

NO_FRAME = Refusal(
    "TF has no frame {name!r}: a goal given in it would never be reached.",
    "Its {n} frames are such as {near}. {ros_frames} lists all.",
)
ENDLESS = Refusal(
    "{topic} takes velocities: without an end the robot would go on.",
    "Give duration_s, in seconds up to {most_s:g}.",
)
STOPPED_BEFORE = Refusal(
    "The robot was stopped before anything was published.", "Publish again when it may move."
)
NO_CONNECTION = Refusal(
    "Nothing can be sent on {topic}: there is no connection.",
    "Try again: the connection is made anew by itself.",
)
STOP = "{stop_robot} ends it."
DRIVE_UNDER_WAY = Refusal(
    "{goal_id} to {place} is under way: a velocity on {topic} would work against it.",
    f"Wait for its end, or end it. {{wait_for_goal}} waits. {STOP}",
    GoalError,
)
PUBLICATION_UNDER_WAY = Refusal(
    "Another publication moves the robot on {topic} for {left_s:.1f} s more.",
    f"Wait for its end, or end it. {STOP}",
    GoalError,
)
BY_HAND = (
    "If the robot still moves, stop it by hand. {stop_robot} works once the connection is back."
)
CUT_OFF = Refusal(
    "{said}, then the connection was lost: whether the latest arrived is not known.",
    "Publish it again.",
)
CUT_OFF_STANDING = Refusal(
    "{said}, then the connection was lost; it is back, and a stand was sent.", BY_HAND
)
CUT_OFF_MOVING = Refusal(
    "{said}, then the connection was lost. The stand could not be sent: whether the robot stands "
    "is not known.",
    BY_HAND,
)

ONE_OF_BOTH = Refusal(
    "Give either goal_id or action.",
    "goal_id ends one goal that was sent here, action every goal of that action.",
    GoalError,
)

NO_PARAMETER = Refusal("{node} has no parameter {name!r}.", "{has}")
NO_PARAMETER_TO_DELETE = Refusal(NO_PARAMETER.message, "{ros_parameters} lists them.")
OTHER_KIND = Refusal(
    "{name} is {old} ({shown}), not {new}.",
    "Give a value of that kind; to change the kind, delete it first with null.",
)


def refuse_without_ros(refusal: Refusal) -> MapspeakError:
    """Return the error for a robot that is no ROS robot."""
    return refusal.error(simulate=shell_command("simulate --rosbridge"))


def refuse_name(what: str, name: str, known: Iterable[str]) -> MapspeakError:
    """Return the error for a topic, service, action or node that is not there."""
    names = sorted(known)
    if not names:
        return NONE_AT_ALL.error(what=what)
    near = find_nearest(name, names)
    such = f"The nearest of {len(names)}:" if near else f"There are {len(names)}, such as"
    listing = lead(f"{{ros_{what}s}} lists all.")
    told = ", ".join(near or names[:5])
    return NONE_SUCH.error(what=what, name=name[:80], such=such, names=told, listing=listing)


def refuse_goal(handle: str | None, known: Sequence[str]) -> GoalError:
    """Return the error for a goal that was not sent here."""
    hint = (
        f"The latest are {', '.join(known[-5:])}." if known else lead("{ros_send_goal} sends one.")
    )
    said = f"There is no goal {handle[:40]!r}." if handle else "No goal has been sent yet."
    return GoalError(said, hint=hint)


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
    latest = f", the latest {MOST_LISTED}" if len(lines) > MOST_LISTED else ""
    head = f"{say_count(len(lines), 'goal')}{latest}, by the server's ids:"
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


def say_subscribers(subscribers: Nodes | LinkError) -> str:
    """Say who heard what was published."""
    if isinstance(subscribers, LinkError):
        return f"Who heard it is not known: {subscribers.message}"
    return f"Heard by: {say_nodes(subscribers)}."


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
