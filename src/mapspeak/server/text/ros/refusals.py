"""What is said when a tool of ROS cannot do what was asked."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from mapspeak.errors import ConfigError, GoalError, LinkError, MapspeakError
from mapspeak.installation import shell_command
from mapspeak.ros.port import find_nearest
from mapspeak.server.text.offered import lead


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
NONE_SUCH = Refusal("The robot has no {what} {name!r}.", "{such} {names}. ros_{what}s lists all.")

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
    "Give its definition to {ros_type}, as `ros2 interface show` (ROS 1: `rosmsg show -r`, "
    "`rossrv show -r`) prints it on the robot, with --- between the parts.",
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
    return NONE_SUCH.error(what=what, name=name[:80], such=such, names=", ".join(near or names[:5]))


def refuse_goal(handle: str | None, known: Sequence[str]) -> GoalError:
    """Return the error for a goal that was not sent here."""
    hint = (
        f"The latest are {', '.join(known[-5:])}." if known else lead("{ros_send_goal} sends one.")
    )
    said = f"There is no goal {handle[:40]!r}." if handle else "No goal has been sent yet."
    return GoalError(said, hint=hint)
