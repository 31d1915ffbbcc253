"""Nav2: the action NavigateToPose of ROS 2."""

import math

from mapspeak.geometry import Pose
from mapspeak.ros.driving.navigating import Navigation
from mapspeak.ros.messages import Dialect, FramedPose, Message, write_pose_stamped

LARGEST = 1e9
"""No distance and no count is larger; what is, is no number of Nav2's."""


def _write_goal(pose: FramedPose) -> Message:
    return {"pose": write_pose_stamped(pose, dialect=Dialect.ROS2), "behavior_tree": ""}


def _read_feedback(feedback: Message, _goal: Pose) -> tuple[float | None, int]:
    left_m = _number(feedback.get("distance_remaining"))
    return left_m, int(_number(feedback.get("number_of_recoveries")) or 0)


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) > LARGEST:
        return None
    return None if math.isnan(value) else float(value)


NAV2 = Navigation(
    title="Navigation",
    dialect=Dialect.ROS2,
    type_name="nav2_msgs/action/NavigateToPose",
    write_goal=_write_goal,
    read_feedback=_read_feedback,
    hint="Check that Nav2 is active (`ros2 lifecycle get /bt_navigator`), that the robot knows "
    "where it is, and that the goal lies on the map.",
)
