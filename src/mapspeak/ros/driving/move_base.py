"""move_base: the action MoveBase of ROS 1."""

from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.ros.driving.navigating import Navigation
from mapspeak.ros.messages import (
    Dialect,
    FramedPose,
    Message,
    read_pose_stamped,
    write_pose_stamped,
)


def _write_goal(pose: FramedPose) -> Message:
    return {"target_pose": write_pose_stamped(pose, dialect=Dialect.ROS1)}


def _read_feedback(feedback: Message, goal: Pose) -> tuple[float | None, int]:
    try:
        here = read_pose_stamped(feedback.get("base_position") or {}).pose
    except LinkError:
        return None, 0
    # move_base does not say how long its path is; the straight line is the least it can be.
    return here.point.distance_to(goal.point), 0


MOVE_BASE = Navigation(
    title="move_base",
    dialect=Dialect.ROS1,
    type_name="move_base_msgs/MoveBase",
    write_goal=_write_goal,
    read_feedback=_read_feedback,
    hint="Check that move_base runs and that the robot knows where it is.",
    # It gives none while a recovery turns the robot once round.
    feedback_s=20.0,
)
