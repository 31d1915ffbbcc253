"""Poses, transforms and velocities of ROS messages; poses are taken as lying in the plane."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.ros.messages.fields import (
    Dialect,
    Message,
    number_of,
    part_of,
    parts_of,
    read_header,
    text_of,
    write_header,
)

NORM_TOLERANCE = 0.01
"""How far a quaternion's squared length may be from 1; tf2 draws the line there too."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FramedPose:
    """A pose in the frame of that id."""

    pose: Pose
    frame_id: str
    stamp_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameTransform:
    """The pose of one frame in another.

    Attributes:
        parent_from_child: The pose of the child frame in the parent frame, seen from above.
        height_m: How far above the parent's origin the child's is.
        rotation: The whole rotation as a unit quaternion x, y, z, w; None for a rotation about z
            only, which the pose has.
    """

    parent_from_child: Pose
    parent: str
    child: str
    stamp_s: float
    height_m: float = 0.0
    rotation: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Twist:
    """A velocity in the robot's own frame; it turns counter-clockwise."""

    forward_mps: float
    left_mps: float
    turn_radps: float

    @property
    def is_standing(self) -> bool:
        """True when it commands a stand."""
        return self == Twist(forward_mps=0.0, left_mps=0.0, turn_radps=0.0)


def _read_rotation(quaternion: Message) -> tuple[float, float, float, float]:
    x, y, z, w = (number_of(quaternion, name) for name in "xyzw")
    norm = math.hypot(x, y, z, w)
    if abs(norm * norm - 1.0) > NORM_TOLERANCE:
        raise LinkError(
            f"A ROS message's quaternion ({x:g}, {y:g}, {z:g}, {w:g}) has the length {norm:g}, "
            "not 1.",
            hint="The node that sends it left it unset or unnormalised; "
            "no rotation is x=0, y=0, z=0, w=1.",
        )
    return x / norm, y / norm, z / norm, w / norm


def _yaw_of(rotation: tuple[float, float, float, float]) -> float:
    x, y, z, w = rotation
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def read_pose(message: Message) -> Pose:
    """Read geometry_msgs/Pose; height and tilt are left away."""
    place = part_of(message, "position")
    yaw_rad = _yaw_of(_read_rotation(part_of(message, "orientation")))
    return Pose(number_of(place, "x"), number_of(place, "y"), yaw_rad)


def write_pose(pose: Pose) -> dict[str, Any]:
    """Write geometry_msgs/Pose, on the floor."""
    position = {"x": float(pose.x), "y": float(pose.y), "z": 0.0}
    half_rad = pose.yaw_rad / 2
    orientation = {"x": 0.0, "y": 0.0, "z": math.sin(half_rad), "w": math.cos(half_rad)}
    return {"position": position, "orientation": orientation}


def read_pose_stamped(message: Message) -> FramedPose:
    """Read geometry_msgs/PoseStamped, PoseWithCovarianceStamped, or a nav_msgs/Odometry's pose."""
    frame_id, stamp_s = read_header(message)
    pose = part_of(message, "pose")
    if "pose" in pose:
        pose = part_of(pose, "pose")
    return FramedPose(pose=read_pose(pose), frame_id=frame_id, stamp_s=stamp_s)


def write_pose_stamped(framed: FramedPose, *, dialect: Dialect) -> dict[str, Any]:
    """Write geometry_msgs/PoseStamped."""
    header = write_header(framed.frame_id, framed.stamp_s, dialect=dialect)
    return {"header": header, "pose": write_pose(framed.pose)}


def write_pose_with_covariance(framed: FramedPose, *, dialect: Dialect) -> dict[str, Any]:
    """Write geometry_msgs/PoseWithCovarianceStamped; the covariance is left at zero, unknown."""
    header = write_header(framed.frame_id, framed.stamp_s, dialect=dialect)
    return {"header": header, "pose": {"pose": write_pose(framed.pose), "covariance": [0.0] * 36}}


def write_odometry(
    framed: FramedPose, twist: Twist, *, child: str, dialect: Dialect
) -> dict[str, Any]:
    """Write nav_msgs/Odometry: a pose, and the velocity in the frame `child`."""
    velocity = {"twist": write_twist(twist), "covariance": [0.0] * 36}
    posed = write_pose_with_covariance(framed, dialect=dialect)
    return {**posed, "child_frame_id": child, "twist": velocity}


def read_transforms(message: Message) -> tuple[FrameTransform, ...]:
    """Read tf2_msgs/TFMessage; one that is none is left out beside others, as tf2 does."""
    found: list[FrameTransform] = []
    fault: LinkError | None = None
    for each in parts_of(message, "transforms"):
        try:
            found.append(_read_transform(each))
        except LinkError as error:
            fault = error
    if fault is not None and not found:
        raise fault
    return tuple(found)


def write_transforms(transforms: Iterable[FrameTransform], *, dialect: Dialect) -> dict[str, Any]:
    """Write tf2_msgs/TFMessage."""
    return {"transforms": [_write_transform(each, dialect=dialect) for each in transforms]}


def read_twist(message: object) -> Twist:
    """Read geometry_msgs/Twist, or the one within geometry_msgs/TwistStamped."""
    is_stamped = isinstance(message, Mapping) and "twist" in message
    twist = part_of(message, "twist") if is_stamped else message
    linear, angular = part_of(twist, "linear"), part_of(twist, "angular")
    return Twist(
        forward_mps=number_of(linear, "x"),
        left_mps=number_of(linear, "y"),
        turn_radps=number_of(angular, "z"),
    )


def write_twist(twist: Twist) -> dict[str, Any]:
    """Write geometry_msgs/Twist."""
    return {
        "linear": {"x": twist.forward_mps, "y": twist.left_mps, "z": 0.0},
        "angular": {"x": 0.0, "y": 0.0, "z": twist.turn_radps},
    }


def _read_transform(message: Any) -> FrameTransform:  # noqa: ANN401 - ROS JSON enters here
    parent, stamp_s = read_header(message)
    transform = part_of(message, "transform")
    place = part_of(transform, "translation")
    rotation = _read_rotation(part_of(transform, "rotation"))
    return FrameTransform(
        parent_from_child=Pose(number_of(place, "x"), number_of(place, "y"), _yaw_of(rotation)),
        parent=parent,
        child=text_of(message, "child_frame_id").lstrip("/"),
        stamp_s=stamp_s,
        height_m=number_of(place, "z") if "z" in place else 0.0,
        rotation=rotation if rotation[0] or rotation[1] else None,
    )


def _write_transform(transform: FrameTransform, *, dialect: Dialect) -> dict[str, Any]:
    pose = write_pose(transform.parent_from_child)
    pose["position"]["z"] = transform.height_m
    if transform.rotation is not None:
        pose["orientation"] = dict(zip("xyzw", transform.rotation, strict=True))
    return {
        "header": write_header(transform.parent, transform.stamp_s, dialect=dialect),
        "child_frame_id": transform.child,
        "transform": {"translation": pose["position"], "rotation": pose["orientation"]},
    }
