"""The robot as we will use it: which topic is its map, which its pose, how it takes goals.

Its parts are found one by one: how good each is, and which of two finds is the better.
"""

from dataclasses import dataclass, replace
from enum import IntEnum, StrEnum

from mapspeak.ros.discovery import ranking
from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.messages.fields import Dialect, bare_type
from mapspeak.ros.port import RosGraph

USUAL_RADIUS_M = 0.2
"""Where nobody says: between a TurtleBot 3 (0.11 m) and a delivery robot (0.35 m)."""
BASE_FRAMES = ("base_footprint", "base_link")
COMPRESSED_IMAGE = "sensor_msgs/CompressedImage"
RAW_IMAGE = "sensor_msgs/Image"
TWIST, TWIST_STAMPED = "geometry_msgs/Twist", "geometry_msgs/TwistStamped"
ODOMETRY = "nav_msgs/Odometry"
POSE_STAMPED = "geometry_msgs/PoseStamped"
POSE_WITH_COVARIANCE = "geometry_msgs/PoseWithCovarianceStamped"


class PoseSource(StrEnum):
    """Where the pose comes from, the best first."""

    TF = "tf"
    POSE_TOPIC = "pose_topic"
    ODOMETRY = "odometry"
    NONE = "none"


class NavigationKind(StrEnum):
    """How goals are sent."""

    NAV2 = "nav2"
    MOVE_BASE = "move_base"
    GOAL_TOPIC = "goal_topic"
    NONE = "none"


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotProfile:
    """What a robot offers; None where it does not.

    Attributes:
        radius_source: Who said so: a parameter, or robot.yaml; empty where it is assumed.
        pose_topic: The topic, where it is not TF.
        pose_type: Its type, as "package/Type".
        tf_topics: /tf and /tf_static, or those of a namespace.
        camera_type: Image or CompressedImage, as "package/Type".
        navigation_name: The action, or the topic for goals.
        planner_name: The action or service that plans a path without driving it.
        velocity_type: Twist or TwistStamped, as "package/Type".
        clock_topic: Where a simulation tells its time.
        namespace: Where the robot's topics are, such as /robot1; empty where they are in none.
        other_namespaces: Of further robots, among which nobody has chosen.
        dead_topics: Those of the above, and actions, that exist by name only: nobody publishes
            them, or, of those that we would publish, nobody listens.
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
    camera_topic: str | None = None
    camera_type: str | None = None
    camera_info_topic: str | None = None
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


def choose_profile(
    graph: RosGraph,
    overrides: RobotOverrides,
    *,
    frames: frozenset[str] = frozenset(),
    dead: frozenset[str] = frozenset(),
    services: frozenset[str] | None = None,
) -> RobotProfile:
    """Return the best use of what there is; what a person said is taken as it stands.

    Topics known to exist by name only are `dead`; `services` are None where they are not known.
    """
    namespace, others = _choose_namespace(overrides, ranking.find_namespaces(graph, dead))
    near = ranking.Nearness(namespace, dead)
    map_topic, updates_topic = _choose_map(graph, overrides, near)
    source, pose_topic, pose_type = _choose_pose(graph, overrides, near, frames)
    camera_topic, camera_type, info_topic = _choose_camera(graph, overrides, near)
    navigation, navigation_name = _choose_navigation(graph, overrides, near)
    velocity_topic, velocity_type = _choose_velocity(graph, overrides, near)
    return RobotProfile(
        name=overrides.name or namespace.strip("/") or "robot",
        dialect=graph.dialect,
        distro=graph.distro,
        radius_m=overrides.radius_m or USUAL_RADIUS_M,
        radius_source="robot.yaml" if overrides.radius_m else "",
        map_name=overrides.map_name or "",
        map_topic=map_topic,
        map_updates_topic=updates_topic,
        map_frame=(overrides.map_frame or _choose_frame(("map",), frames, near)).lstrip("/"),
        base_frame=(overrides.base_frame or _choose_frame(BASE_FRAMES, frames, near)).lstrip("/"),
        pose_source=source,
        pose_topic=pose_topic,
        pose_type=pose_type,
        tf_topics=_choose_tf_topics(graph, near),
        camera_topic=camera_topic,
        camera_type=camera_type,
        camera_info_topic=info_topic,
        scan_topic=overrides.scan_topic or ranking.best(graph, ranking.SCANS, near),
        navigation=navigation,
        navigation_name=navigation_name,
        planner_name=_choose_planner(graph, near, navigation, navigation_name, services),
        velocity_topic=velocity_topic,
        velocity_type=velocity_type,
        clock_topic="/clock" if "/clock" in graph.types else None,
        namespace=namespace,
        other_namespaces=others,
        dead_topics=dead | _find_dead_action(graph, navigation, navigation_name),
    )


def _choose_namespace(
    overrides: RobotOverrides, found: tuple[str, ...]
) -> tuple[str, tuple[str, ...]]:
    """Return the one that was said or of the only robot, and those among which nobody chose."""
    if overrides.namespace is not None:
        return f"/{overrides.namespace.strip('/')}", ()
    if len(found) == 1:
        return found[0], ()
    return "", () if "" in found else found


def _find_dead_action(graph: RosGraph, kind: NavigationKind, name: str | None) -> frozenset[str]:
    """Return an action that robot.yaml names and nobody serves."""
    is_listed = kind is not NavigationKind.NAV2 or not graph.types or name in graph.actions
    return frozenset() if is_listed or name is None else frozenset({name})


def _choose_map(
    graph: RosGraph, overrides: RobotOverrides, near: ranking.Nearness
) -> tuple[str | None, str | None]:
    topic = overrides.map_topic or ranking.best(graph, ranking.MAPS, near)
    listed = f"{topic}_updates" if f"{topic}_updates" in graph.types else None
    return topic, overrides.map_updates_topic or listed


def _choose_pose(
    graph: RosGraph, overrides: RobotOverrides, near: ranking.Nearness, frames: frozenset[str]
) -> tuple[PoseSource, str | None, str | None]:
    said = overrides.pose_topic
    if said is not None and said != PoseSource.TF:
        type_name = bare_type(overrides.pose_type or graph.types.get(said, POSE_WITH_COVARIANCE))
        source = PoseSource.ODOMETRY if type_name == ODOMETRY else PoseSource.POSE_TOPIC
        return source, said, type_name
    map_frame = overrides.map_frame or _choose_frame(("map",), frames, near)
    if said == PoseSource.TF or map_frame.lstrip("/") in frames:
        return PoseSource.TF, None, None
    for source, wanted in (
        (PoseSource.POSE_TOPIC, ranking.POSES),
        (PoseSource.ODOMETRY, ranking.ODOMETRY),
    ):
        topic = ranking.best(graph, wanted, near)
        if topic is not None:
            return source, topic, graph.types[topic]
    return PoseSource.NONE, None, None


def _choose_camera(
    graph: RosGraph, overrides: RobotOverrides, near: ranking.Nearness
) -> tuple[str | None, str | None, str | None]:
    topic = overrides.camera_topic or ranking.best(graph, ranking.CAMERAS, near)
    if topic is None:
        return None, None, None
    is_compressed = topic.endswith("/compressed")
    guess = COMPRESSED_IMAGE if is_compressed else RAW_IMAGE
    type_name = bare_type(overrides.camera_type or graph.types.get(topic, guess))
    picture = topic.removesuffix("/compressed")
    beside = f"{picture.rpartition('/')[0]}/camera_info"
    info_topic = overrides.camera_info_topic or (beside if beside in graph.types else None)
    return topic, type_name, info_topic


def _choose_navigation(
    graph: RosGraph, overrides: RobotOverrides, near: ranking.Nearness
) -> tuple[NavigationKind, str | None]:
    found: dict[NavigationKind, str | None] = {
        NavigationKind.NAV2: near.first(
            action for action in graph.actions if action.endswith("/navigate_to_pose")
        ),
        NavigationKind.MOVE_BASE: ranking.best_move_base(graph, near),
        NavigationKind.GOAL_TOPIC: ranking.best(graph, ranking.GOALS, near),
    }
    if overrides.navigation is None:
        named = [kind for kind, name in found.items() if name is not None]
        alive = [kind for kind in named if end_of_goals(kind, found[kind]) not in near.dead]
        kind = next(iter([*alive, *named]), NavigationKind.NONE)
        return kind, overrides.navigation_name or found.get(kind)
    kind = NavigationKind(overrides.navigation)
    return kind, overrides.navigation_name or found.get(kind) or _usual_name(kind, graph.dialect)


def end_of_goals(kind: NavigationKind, name: str | None) -> str | None:
    """Return the topic that shows whether navigation runs: move_base always tells its status."""
    return f"{name}/status" if kind is NavigationKind.MOVE_BASE and name is not None else name


def _choose_planner(
    graph: RosGraph,
    near: ranking.Nearness,
    navigation: NavigationKind,
    name: str | None,
    services: frozenset[str] | None,
) -> str | None:
    """Return Nav2's ComputePathToPose, or move_base's service."""
    if navigation is NavigationKind.MOVE_BASE and name is not None:
        service = f"{name}/make_plan"
        return service if services is None or service in services else None
    return near.first(
        action for action in graph.actions if action.endswith("/compute_path_to_pose")
    )


def _usual_name(kind: NavigationKind, dialect: Dialect) -> str | None:
    goal_topic = "/move_base_simple/goal" if dialect is Dialect.ROS1 else "/goal_pose"
    names = {
        NavigationKind.NAV2: "/navigate_to_pose",
        NavigationKind.MOVE_BASE: "/move_base",
        NavigationKind.GOAL_TOPIC: goal_topic,
    }
    return names.get(kind)


def _choose_velocity(
    graph: RosGraph, overrides: RobotOverrides, near: ranking.Nearness
) -> tuple[str | None, str | None]:
    topic = overrides.velocity_topic or ranking.best(graph, ranking.VELOCITIES, near)
    if topic is None:
        return None, None
    return topic, bare_type(overrides.velocity_type or graph.types.get(topic, TWIST))


def _choose_frame(names: tuple[str, ...], frames: frozenset[str], near: ranking.Nearness) -> str:
    """Return the first of some names that is a frame, also one with a prefix such as robot1/."""
    for name in names:
        if name in frames:
            return name
        with_prefix = near.first(frame for frame in sorted(frames) if frame.endswith(f"/{name}"))
        if with_prefix is not None:
            return with_prefix
    return names[-1]


def _choose_tf_topics(graph: RosGraph, near: ranking.Nearness) -> tuple[str, str]:
    own = f"{near.namespace}/tf"
    return (own, f"{own}_static") if own in graph.types else ("/tf", "/tf_static")


class Worth(IntEnum):
    """How good a part is that was found, the worst first."""

    MISSING = 0
    NAMED = 1
    SECOND_BEST = 2
    FULL = 3


class RobotPart(StrEnum):
    """What belongs together in a profile, by the key with which robot.yaml names it."""

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
    RobotPart.CAMERA: ("camera_topic", "camera_type", "camera_info_topic"),
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
    """Return the better of two looks, part by part: what was found is not lost by a later look.

    Args:
        before: As the robot is used.
        now: As it looks now.
        is_settled: What is as good as before is used no more for another one.
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
