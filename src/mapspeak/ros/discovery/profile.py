"""The robot as we will use it: which topic is its map, which its pose, how it takes goals.

Its parts are found one by one: how good each is, and which of two finds is the better.
"""

from dataclasses import dataclass, replace
from enum import IntEnum, StrEnum

from mapspeak.ros.messages.fields import Dialect

USUAL_RADIUS_M = 0.2
"""Radius of an unknown robot: between a TurtleBot 3 (0.11 m) and a delivery robot (0.35 m)."""
COMPRESSED_IMAGE = "sensor_msgs/CompressedImage"
RAW_IMAGE = "sensor_msgs/Image"
TWIST, TWIST_STAMPED = "geometry_msgs/Twist", "geometry_msgs/TwistStamped"
ODOMETRY = "nav_msgs/Odometry"
POSE_STAMPED = "geometry_msgs/PoseStamped"
POSE_WITH_COVARIANCE = "geometry_msgs/PoseWithCovarianceStamped"


class PoseSource(StrEnum):
    """The sources of the pose, the best first."""

    TF = "tf"
    POSE_TOPIC = "pose_topic"
    ODOMETRY = "odometry"
    NONE = "none"


class NavigationKind(StrEnum):
    """The ways to send goals."""

    NAV2 = "nav2"
    MOVE_BASE = "move_base"
    GOAL_TOPIC = "goal_topic"
    NONE = "none"


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraTopics:
    """A camera.

    Attributes:
        topic: Of its pictures.
        type_name: Image or CompressedImage, as "package/Type".
        info_topic: Of its measures; None where it does not tell them.
    """

    name: str
    topic: str
    type_name: str = RAW_IMAGE
    info_topic: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotProfile:
    """The interfaces of a robot; None where it has none.

    Attributes:
        radius_source: Its source: a parameter, or robot.yaml; empty where it is assumed.
        pose_topic: The topic, where it is not TF.
        pose_type: Its type, as "package/Type".
        tf_topics: /tf and /tf_static, or those of a namespace.
        cameras: The one that looks ahead first.
        navigation_name: The action, or the topic for goals.
        planner_name: The action or service that plans a path without driving it.
        velocity_type: Twist or TwistStamped, as "package/Type".
        clock_topic: Where a simulation tells its time.
        namespace: Where the robot's topics are, such as /robot1; empty where they are in none.
        other_namespaces: Of further robots, where none was chosen.
        dead_topics: Those of the above, and actions, that exist by name only: without a publisher
            or, if we would publish them, without a subscriber.
    """

    name: str
    dialect: Dialect
    distro: str = ""
    radius_m: float = USUAL_RADIUS_M
    radius_source: str = ""
    map_name: str = ""
    map_topic: str | None = None
    map_updates_topic: str | None = None
    map_frame: str = "map"
    base_frame: str = "base_link"
    pose_source: PoseSource = PoseSource.NONE
    pose_topic: str | None = None
    pose_type: str | None = None
    tf_topics: tuple[str, str] = ("/tf", "/tf_static")
    cameras: tuple[CameraTopics, ...] = ()
    scan_topic: str | None = None
    navigation: NavigationKind = NavigationKind.NONE
    navigation_name: str | None = None
    planner_name: str | None = None
    velocity_topic: str | None = None
    velocity_type: str | None = None
    clock_topic: str | None = None
    namespace: str = ""
    other_namespaces: tuple[str, ...] = ()
    dead_topics: frozenset[str] = frozenset()

    @property
    def camera_topic(self) -> str | None:
        """The topic of the camera that looks ahead."""
        return self.cameras[0].topic if self.cameras else None


def end_of_goals(kind: NavigationKind, name: str | None) -> str | None:
    """Return the topic that shows whether navigation runs: move_base always tells its status."""
    return f"{name}/status" if kind is NavigationKind.MOVE_BASE and name is not None else name


class Worth(IntEnum):
    """How good a found part is, the worst first."""

    MISSING = 0
    NAMED = 1
    SECOND_BEST = 2
    FULL = 3


class RobotPart(StrEnum):
    """Fields of a profile that belong together, by their key in robot.yaml."""

    MAP = "map_topic"
    POSE = "pose_topic"
    CAMERA = "camera_topic"
    LASER = "scan_topic"
    NAVIGATION = "navigation"
    VELOCITY = "velocity_topic"
    RADIUS = "radius_m"

    def topic(self, profile: RobotProfile) -> str | None:
        """Return the topic, or the action, that shows whether it is alive."""
        match self:
            case RobotPart.POSE if profile.pose_source is PoseSource.TF:
                return profile.tf_topics[0]
            case RobotPart.NAVIGATION:
                return end_of_goals(profile.navigation, profile.navigation_name)
            case RobotPart.RADIUS:
                return profile.radius_source or None
        topic: str | None = getattr(profile, self)
        return topic

    def is_heard(self, profile: RobotProfile) -> bool:
        """Return whether we publish that topic, and the robot listens."""
        is_goal_topic = profile.navigation is NavigationKind.GOAL_TOPIC
        return self is RobotPart.VELOCITY or (self is RobotPart.NAVIGATION and is_goal_topic)

    def worth(self, profile: RobotProfile) -> Worth:
        """Return how good it is."""
        topic = self.topic(profile)
        if topic is None:
            return Worth.MISSING
        if topic in profile.dead_topics:
            return Worth.NAMED
        is_other_pose = self is RobotPart.POSE and profile.pose_source is not PoseSource.TF
        is_goal_topic = self is RobotPart.NAVIGATION and self.is_heard(profile)
        return Worth.SECOND_BEST if is_other_pose or is_goal_topic else Worth.FULL

    def is_alive(self, profile: RobotProfile) -> bool:
        """Tell whether it is there, and not by name only."""
        return self.worth(profile) > Worth.NAMED

    def values(self, profile: RobotProfile) -> dict[str, object]:
        """Return its fields."""
        return {name: getattr(profile, name) for name in FIELDS[self]}


FIELDS = {
    RobotPart.MAP: ("map_topic", "map_updates_topic"),
    RobotPart.POSE: (
        *("pose_source", "pose_topic", "pose_type", "map_frame", "base_frame", "tf_topics"),
        *("namespace", "other_namespaces", "name"),
    ),
    RobotPart.CAMERA: ("cameras",),
    RobotPart.LASER: ("scan_topic",),
    RobotPart.NAVIGATION: ("navigation", "navigation_name", "planner_name"),
    RobotPart.VELOCITY: ("velocity_topic", "velocity_type"),
    RobotPart.RADIUS: ("radius_m", "radius_source"),
}


def find_missing(profile: RobotProfile) -> tuple[RobotPart, ...]:
    """Return the parts of which better may be found."""
    return tuple(part for part in RobotPart if part.worth(profile) is not Worth.FULL)


def improve(
    before: RobotProfile, now: RobotProfile, *, is_settled: bool, keeps_navigation: bool
) -> RobotProfile:
    """Return the better of two looks, part by part: a later look does not lose found parts.

    Args:
        before: As the robot is used.
        now: As it looks now.
        is_settled: A part that is only as good as before does not replace the earlier one.
        keeps_navigation: A drive of ours runs over the navigation of before.
    """
    values: dict[str, object] = {}
    dead: set[str] = set()
    for part in RobotPart:
        is_kept = keeps_navigation and part is RobotPart.NAVIGATION
        source = before if is_kept or not _is_better(part, before, now, is_settled) else now
        values |= part.values(source)
        topic = part.topic(source)
        if topic in source.dead_topics:
            dead.add(topic)
    # An unknown distribution or clock may be known by now.
    values["distro"] = now.distro or before.distro
    values["clock_topic"] = before.clock_topic or now.clock_topic
    return replace(before, dead_topics=frozenset(dead), **values)  # type: ignore[arg-type]


def _is_better(part: RobotPart, before: RobotProfile, now: RobotProfile, is_settled: bool) -> bool:  # noqa: FBT001
    if part.worth(now) != part.worth(before):
        return part.worth(now) > part.worth(before)
    return not is_settled or part.topic(now) == part.topic(before)
