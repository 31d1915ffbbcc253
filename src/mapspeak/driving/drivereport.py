"""A drive that was sent to the robot, and how it stands."""

from dataclasses import dataclass

from mapspeak.geometry import Point, Pose
from mapspeak.robot import GoalState, GoalStatus, PoseDoubt

JUST_SENT = GoalStatus(state=GoalState.ACCEPTED)


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """A drive that was sent to the robot.

    Attributes:
        goal_id: The name it goes by: G1, G2, ...
        goal: Where to.
        place: What the goal was called when it was asked for.
        robot_goal_id: What the robot's navigation calls it; None before it was sent there.
        started_s: Robot time at which it was sent.
        client: Who asked for it; empty where there can be only one.
        begun_at: Where the robot was when it was sent; None where it waited its turn.
        ended_at: Where the robot was when it was heard that the drive had ended; None where that
            is not known.
        heard: How it stood when the robot was heard last.
        final: How it ended, once it has.
    """

    goal_id: str
    goal: Pose
    place: str
    robot_goal_id: str | None
    started_s: float
    client: str = ""
    begun_at: Point | None = None
    ended_at: Point | None = None
    heard: GoalStatus = JUST_SENT
    final: GoalStatus | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveReport:
    """A drive and how it stands.

    Attributes:
        drive: The drive.
        status: How it stands, or stood when the robot was heard last.
        pose: Where the robot is now, or was last seen.
        pose_age_s: How old that pose is.
        pose_doubt: Why the robot may be elsewhere; None for a fresh pose on the map.
        silence: What is missing of the robot, in words; empty where nothing is.
        is_stop_owed: It has to be stopped, and the robot could not be told so yet.
        elapsed_s: Robot time since the drive was sent.
    """

    drive: Drive
    status: GoalStatus
    pose: Pose
    pose_age_s: float
    pose_doubt: PoseDoubt | None
    silence: str
    is_stop_owed: bool
    elapsed_s: float
