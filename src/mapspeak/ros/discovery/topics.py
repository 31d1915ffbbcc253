"""Choose the topics, actions and frames through which a robot is used.

Among several topics of the right type, the name decides.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.discovery.profile import (
    COMPRESSED_IMAGE,
    ODOMETRY,
    POSE_STAMPED,
    POSE_WITH_COVARIANCE,
    RAW_IMAGE,
    TWIST,
    TWIST_STAMPED,
    USUAL_RADIUS_M,
    CameraTopics,
    NavigationKind,
    PoseSource,
    RobotProfile,
    end_of_goals,
)
from mapspeak.ros.messages.fields import Dialect, bare_type
from mapspeak.ros.port import RosGraph

MAP = "nav_msgs/OccupancyGrid"
MAP_UPDATE = "map_msgs/OccupancyGridUpdate"
MOVE_BASE_GOAL = "move_base_msgs/MoveBaseActionGoal"
FRAMES = ("tf2_msgs/TFMessage", "tf/tfMessage")
BASE_FRAMES = ("base_footprint", "base_link")
NAVIGATE = "/navigate_to_pose"


Fields = dict[str, Any]
"""Of a `RobotProfile`, by their names."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """The types that a topic may have, and its usual names.

    Attributes:
        types: As "package/Type"; an earlier one is preferred where names are equally good.
        endings: Patterns of the ends of such topics' names, the usual one first.
        never: Parts of names that mean something else.
        takes_others: Takes a topic of the type under any name.
    """

    types: tuple[str, ...]
    endings: tuple[str, ...]
    never: tuple[str, ...] = ()
    takes_others: bool = False


MAPS = Wanted(
    types=(MAP,),
    endings=("/map", "map[^/]*"),
    never=("costmap", "cost_map"),
    takes_others=True,
)
SCANS = Wanted(
    types=("sensor_msgs/LaserScan",),
    endings=("/scan", "/base_scan", "scan"),
    takes_others=True,
)
POSES = Wanted(
    types=(POSE_WITH_COVARIANCE, POSE_STAMPED),
    endings=("/amcl_pose", "/pose", "/tracked_pose", "/robot_pose", "/localization_pose"),
    never=("initial", "goal", "target", "truth"),
)
ODOMETRIES = Wanted(
    types=(ODOMETRY,),
    endings=("/odometry/filtered", "/odom", "odom", "odometry"),
    never=("truth",),
    takes_others=True,
)
CAMERAS = Wanted(
    types=(COMPRESSED_IMAGE, RAW_IMAGE),
    endings=(
        "/color/image_raw/compressed", "/rgb/image_raw/compressed", "/image_raw/compressed",
        "/image_rect_color/compressed", "/image_color/compressed", "/image/compressed",
        "/compressed", "/color/image_raw", "/rgb/image_raw", "/image_raw", "/image_rect_color",
        "/image_color", "/rgb", "/image", "image_raw", "image",
    ),
    never=("depth", "disparity", "mask", "debug", "infra", "/ir/", "label", "segment", "costmap"),
    takes_others=True,
)  # fmt: skip
PICTURE_PARTS = frozenset(part for end in CAMERAS.endings for part in end.split("/")) | {
    "image_rect", "preview",
}  # fmt: skip
"""Parts of a topic's name that say of what kind a picture is, and not whose."""
MOST_CAMERAS = 12
GOALS = Wanted(
    types=(POSE_STAMPED,),
    endings=("/goal_pose", "/move_base_simple/goal", "/goal"),
    never=("current_goal", "/move_base/goal"),
)
VELOCITIES = Wanted(
    types=(TWIST, TWIST_STAMPED),
    endings=("/cmd_vel", "/mobile_base/commands/velocity", "/velocity", "/cmd_vel_unstamped"),
)


USUAL_NAMES = {
    NavigationKind.NAV2: NAVIGATE,
    NavigationKind.MOVE_BASE: "/move_base",
    NavigationKind.GOAL_TOPIC: "/goal_pose",
}
"""Of what robot.yaml says is there, though it is not listed; ROS 1 has another topic for goals."""


def choose_profile(
    graph: RosGraph,
    overrides: RobotOverrides,
    *,
    frames: frozenset[str] = frozenset(),
    dead: frozenset[str] = frozenset(),
    services: frozenset[str] | None = None,
) -> RobotProfile:
    """Return the best profile of the graph; overrides are taken as they stand.

    Topics known to exist by name only are `dead`; `services` are None where they are not known.
    """
    namespace, others = _choose_namespace(overrides, find_namespaces(graph, dead))
    # Where none was chosen, at least none is mixed with another.
    own = next(iter(others), namespace)
    choice = _Choice(graph, overrides, frames, namespace=own, dead=dead)
    navigation = choice.navigation(services)
    return RobotProfile(
        name=overrides.name or namespace.strip("/") or "robot",
        dialect=graph.dialect,
        distro=graph.distro,
        radius_m=overrides.radius_m or USUAL_RADIUS_M,
        radius_source="robot.yaml" if overrides.radius_m else "",
        map_name=overrides.map_name or "",
        scan_topic=overrides.scan_topic or choice.best(SCANS),
        clock_topic=choice.listed("/clock"),
        namespace=namespace,
        other_namespaces=others,
        dead_topics=dead | _find_dead_action(graph, navigation),
        **choice.map(),
        **choice.pose(),
        # Of several robots, the cameras of the others are not this one's.
        cameras=choice.cameras()[: 1 if others else MOST_CAMERAS],
        **choice.velocity(),
        **navigation,
    )


def find_namespaces(graph: RosGraph, dead: frozenset[str]) -> tuple[str, ...]:
    """Return where robots are: each publishes its frames; "" stands for no namespace."""
    return tuple(
        topic.removesuffix("/tf")
        for topic in graph.topics_of(*FRAMES)
        if topic.endswith("/tf") and topic not in dead
    )


def _choose_namespace(
    overrides: RobotOverrides, found: tuple[str, ...]
) -> tuple[str, tuple[str, ...]]:
    """Return the given namespace or that of the only robot, and those left to choose from."""
    if overrides.namespace is not None:
        return f"/{overrides.namespace.strip('/')}", ()
    if len(found) == 1:
        return found[0], ()
    return "", () if "" in found else found


def _find_other_robots(graph: RosGraph, frames: frozenset[str], namespace: str) -> tuple[str, ...]:
    """Return the beginnings of other robots' names, where one robot was chosen by its namespace.

    A robot is known by its tree of frames, its base or its navigation.
    """
    named = [
        *(topic for topic in graph.topics_of(*FRAMES) if topic.endswith("/tf")),
        *(f"/{frame}" for frame in frames if frame.rpartition("/")[2] in BASE_FRAMES),
        *(name for name in graph.actions if name.endswith(NAVIGATE)),
    ]
    found = {name.rpartition("/")[0] for name in named} - {"", namespace}
    return tuple(f"{each}/" for each in found) if namespace else ()


def _find_dead_action(graph: RosGraph, navigation: Fields) -> frozenset[str]:
    """Return an action that robot.yaml names and that has no server."""
    name = navigation["navigation_name"]
    is_action = navigation["navigation"] is NavigationKind.NAV2 and name is not None
    is_dead = is_action and graph.types and name not in graph.actions
    return frozenset({name}) if is_dead else frozenset()


class _Choice:
    """The fields of a profile, part by part: what robot.yaml says, else the best of what is there.

    Args:
        said: By robot.yaml.
        namespace: Of the robot to prefer among several, such as /robot1; empty for none.
        dead: Topics known to exist by name only.
    """

    def __init__(
        self,
        graph: RosGraph,
        said: RobotOverrides,
        frames: frozenset[str],
        *,
        namespace: str,
        dead: frozenset[str],
    ) -> None:
        self._graph = graph
        self._said = said
        self._frames = frames
        self._namespace = namespace
        self._others = _find_other_robots(graph, frames, namespace)
        self._dead = dead

    def best(self, wanted: Wanted) -> str | None:
        return self._first(self._rank(wanted))

    def _rank(self, wanted: Wanted) -> list[str]:
        return sorted(
            (topic for topic in self._graph.topics_of(*wanted.types) if _may_be(topic, wanted)),
            key=lambda topic: (
                topic in self._dead,
                _place_of(topic, wanted),
                wanted.types.index(self._graph.types[topic]),
                topic.count("/"),
                topic,
            ),
        )

    def _first(self, names: Iterable[str]) -> str | None:
        """Return the first of the names that lies in the namespace, else of no other robot's."""
        listed = list(names)
        shared = (name for name in listed if not f"/{name.strip('/')}".startswith(self._others))
        return next((name for name in listed if self._is_near(name)), next(shared, None))

    def _is_near(self, name: str) -> bool:
        prefix = self._namespace.strip("/")
        return bool(prefix) and name.strip("/").startswith(f"{prefix}/")

    def listed(self, topic: str) -> str | None:
        return topic if topic in self._graph.types else None

    def map(self) -> Fields:
        topic = self._said.map_topic or self.best(MAPS)
        updates = self._said.map_updates_topic or self.listed(f"{topic}_updates")
        return {"map_topic": topic, "map_updates_topic": updates}

    def pose(self) -> Fields:
        map_frame = self._frame(("map",), self._said.map_frame)
        source, topic, type_name = self._pose_source(map_frame)
        own = f"{self._namespace}/tf"
        return {
            "map_frame": map_frame,
            "base_frame": self._frame(BASE_FRAMES, self._said.base_frame),
            "pose_source": source,
            "pose_topic": topic,
            "pose_type": type_name,
            "tf_topics": (own, f"{own}_static") if self.listed(own) else ("/tf", "/tf_static"),
        }

    def _pose_source(self, map_frame: str) -> tuple[PoseSource, str | None, str | None]:
        said = self._said.pose_topic
        if said is not None and said != PoseSource.TF:
            type_name = self._type(said, self._said.pose_type, POSE_WITH_COVARIANCE)
            is_odometry = type_name == ODOMETRY
            source = PoseSource.ODOMETRY if is_odometry else PoseSource.POSE_TOPIC
            return source, said, type_name
        if said == PoseSource.TF or map_frame in self._frames:
            return PoseSource.TF, None, None
        for source, wanted in ((PoseSource.POSE_TOPIC, POSES), (PoseSource.ODOMETRY, ODOMETRIES)):
            topic = self.best(wanted)
            if topic is not None:
                return source, topic, self._graph.types[topic]
        return PoseSource.NONE, None, None

    def cameras(self) -> tuple[CameraTopics, ...]:
        """Return the camera that looks ahead, and others: those that robot.yaml names, if any."""
        said = self._said
        others = list(said.cameras.values()) or [
            topic
            for topic in self._rank(CAMERAS)
            if topic not in self._dead
            and (not self._namespace or self._is_near(topic))
            and _place_of(topic, CAMERAS) < len(CAMERAS.endings)
        ]
        ahead = said.camera_topic or next(iter(said.cameras.values()), self.best(CAMERAS))
        names = {topic: name for name, topic in said.cameras.items()}
        by_name: dict[str, str] = {}
        for topic in filter(None, (ahead, *others)):
            name = names.get(topic) or name_camera(topic, namespace=self._namespace)
            by_name.setdefault(name, topic)
        return tuple(self._camera(name, topic) for name, topic in by_name.items())

    def _camera(self, name: str, topic: str) -> CameraTopics:
        said, is_said = self._said, topic == self._said.camera_topic
        guess = COMPRESSED_IMAGE if topic.endswith("/compressed") else RAW_IMAGE
        beside = f"{topic.removesuffix('/compressed').rpartition('/')[0]}/camera_info"
        return CameraTopics(
            name=name,
            topic=topic,
            type_name=self._type(topic, said.camera_type if is_said else None, guess),
            info_topic=(said.camera_info_topic if is_said else None) or self.listed(beside),
        )

    def velocity(self) -> Fields:
        topic = self._said.velocity_topic or self.best(VELOCITIES)
        if topic is None:
            return {}
        type_name = self._type(topic, self._said.velocity_type, TWIST)
        return {"velocity_topic": topic, "velocity_type": type_name}

    def navigation(self, services: frozenset[str] | None) -> Fields:
        found = {
            NavigationKind.NAV2: self._action(NAVIGATE),
            NavigationKind.MOVE_BASE: self._move_base(),
            NavigationKind.GOAL_TOPIC: self.best(GOALS),
        }
        name = self._said.navigation_name
        if self._said.navigation is None:
            named = [kind for kind, known in found.items() if known is not None]
            alive = [kind for kind in named if end_of_goals(kind, found[kind]) not in self._dead]
            kind = next(iter([*alive, *named]), NavigationKind.NONE)
            name = name or found.get(kind)
        else:
            kind = NavigationKind(self._said.navigation)
            name = name or found.get(kind) or self._usual_name(kind)
        planner = self._action("/compute_path_to_pose")
        if kind is NavigationKind.MOVE_BASE and name is not None:
            planner = f"{name}/make_plan"
            planner = planner if services is None or planner in services else None
        return {"navigation": kind, "navigation_name": name, "planner_name": planner}

    def _usual_name(self, kind: NavigationKind) -> str | None:
        is_ros1 = self._graph.dialect is Dialect.ROS1
        if is_ros1 and kind is NavigationKind.GOAL_TOPIC:
            return "/move_base_simple/goal"
        return USUAL_NAMES.get(kind)

    def _action(self, ending: str) -> str | None:
        return self._first(name for name in self._graph.actions if name.endswith(ending))

    def _move_base(self) -> str | None:
        goals = self._graph.topics_of(MOVE_BASE_GOAL)
        names = [topic.removesuffix("/goal") for topic in goals if topic.endswith("/goal")]
        return self._first(
            sorted(names, key=lambda name: (f"{name}/status" in self._dead, name.count("/"), name))
        )

    def _type(self, topic: str, said: str | None, guess: str) -> str:
        return bare_type(said or self._graph.types.get(topic, guess))

    def _frame(self, names: tuple[str, ...], said: str | None) -> str:
        """Return the first of some names that is a frame, also with a prefix such as robot1/."""
        if said is not None:
            return said.lstrip("/")
        for name in names:
            if name in self._frames:
                return name
            prefixed = self._first(f for f in sorted(self._frames) if f.endswith(f"/{name}"))
            if prefixed is not None:
                return prefixed.lstrip("/")
        return names[-1]


def name_camera(topic: str, *, namespace: str) -> str:
    """Return a camera's name: its topic's without what says of which kind the picture is."""
    own = topic.removeprefix(f"{namespace}/") if namespace else topic
    parts: list[str] = []
    for part in filter(None, own.split("/")):
        if part.lower() not in PICTURE_PARTS and part not in parts[-1:]:
            parts.append(part)
    return "/".join(parts) or "camera"


def _may_be(topic: str, wanted: Wanted) -> bool:
    if any(part in topic.lower() for part in wanted.never):
        return False
    return wanted.takes_others or _place_of(topic, wanted) < len(wanted.endings)


def _place_of(topic: str, wanted: Wanted) -> int:
    endings = enumerate(wanted.endings)
    places = (place for place, ending in endings if re.search(f"{ending}$", topic.lower()))
    return next(places, len(wanted.endings))
