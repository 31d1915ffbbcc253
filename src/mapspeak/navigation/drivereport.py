"""A drive that was sent to the robot, and how it stands."""

from dataclasses import dataclass

from mapspeak.geometry import Point, Pose
from mapspeak.robot import GoalStatus

__all__ = ["Drive", "DriveReport"]


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
        ended_at: Where the robot was when it was heard that the drive had ended.
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
    final: GoalStatus | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveReport:
    """A drive and how it stands.

    Attributes:
        drive: The drive.
        status: How it stands.
        pose: Where the robot is now, or was last seen.
        elapsed_s: Robot time since the drive was sent.
    """

    drive: Drive
    status: GoalStatus
    pose: Pose
    elapsed_s: float
