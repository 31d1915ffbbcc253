"""Which of several topics of the right type is the one meant, judged by its name."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from mapspeak.ros.port import RosGraph

MAP = "nav_msgs/OccupancyGrid"
MAP_UPDATE = "map_msgs/OccupancyGridUpdate"
MOVE_BASE_GOAL = "move_base_msgs/MoveBaseActionGoal"
FRAMES = ("tf2_msgs/TFMessage", "tf/tfMessage")


@dataclass(frozen=True, slots=True)
class Nearness:
    """Prefers topics of one robot among several, and those that somebody serves.

    Attributes:
        namespace: Such as /robot1; empty for none.
        dead: Topics known to exist by name only.
    """

    namespace: str
    dead: frozenset[str] = frozenset()

    def first(self, names: Iterable[str]) -> str | None:
        """Return the first of the names that lies in the namespace, else the first."""
        listed = list(names)
        return next((name for name in listed if self._is_near(name)), next(iter(listed), None))

    def _is_near(self, name: str) -> bool:
        prefix = self.namespace.strip("/")
        return bool(prefix) and name.strip("/").startswith(f"{prefix}/")


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """What a topic must be, and how it is usually called.

    Attributes:
        types: As "package/Type"; an earlier one is preferred where names are equally good.
        endings: How such topics' names end, as patterns, the usual one first.
        never: Parts of names that mean something else.
        takes_others: Takes a topic of the type, however it is called.
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
    types=("geometry_msgs/PoseWithCovarianceStamped", "geometry_msgs/PoseStamped"),
    endings=("/amcl_pose", "/pose", "/tracked_pose", "/robot_pose", "/localization_pose"),
    never=("initial", "goal", "target", "truth"),
)
ODOMETRY = Wanted(
    types=("nav_msgs/Odometry",),
    endings=("/odometry/filtered", "/odom", "odom", "odometry"),
    never=("truth",),
    takes_others=True,
)
CAMERAS = Wanted(
    types=("sensor_msgs/CompressedImage", "sensor_msgs/Image"),
    endings=(
        "/color/image_raw/compressed", "/rgb/image_raw/compressed", "/image_raw/compressed",
        "/image_rect_color/compressed", "/image_color/compressed", "/image/compressed",
        "/compressed", "/color/image_raw", "/rgb/image_raw", "/image_raw", "/image_rect_color",
        "/image_color", "/rgb", "/image", "image_raw", "image",
    ),
    never=("depth", "disparity", "mask", "debug", "infra", "/ir/", "label", "segment", "costmap"),
    takes_others=True,
)  # fmt: skip
GOALS = Wanted(
    types=("geometry_msgs/PoseStamped",),
    endings=("/goal_pose", "/move_base_simple/goal", "/goal"),
    never=("current_goal", "/move_base/goal"),
)
VELOCITIES = Wanted(
    types=("geometry_msgs/Twist", "geometry_msgs/TwistStamped"),
    endings=("/cmd_vel", "/mobile_base/commands/velocity", "/velocity", "/cmd_vel_unstamped"),
)


def best(graph: RosGraph, wanted: Wanted, near: Nearness) -> str | None:
    """Return the topic that fits best; None where none fits."""
    ranked = sorted(
        (topic for topic in graph.topics_of(*wanted.types) if _may_be(topic, wanted)),
        key=lambda topic: (
            topic in near.dead,
            _place_of(topic, wanted),
            wanted.types.index(graph.types[topic]),
            topic.count("/"),
            topic,
        ),
    )
    return near.first(ranked)


def best_move_base(graph: RosGraph, near: Nearness) -> str | None:
    """Return the name of the ROS 1 action that drives to a pose, such as /move_base."""
    goals = graph.topics_of(MOVE_BASE_GOAL)
    names = [topic.removesuffix("/goal") for topic in goals if topic.endswith("/goal")]
    return near.first(
        sorted(names, key=lambda name: (f"{name}/status" in near.dead, name.count("/"), name))
    )


def find_namespaces(graph: RosGraph, dead: frozenset[str]) -> tuple[str, ...]:
    """Return where robots are: each publishes its frames; "" stands for no namespace."""
    return tuple(
        topic.removesuffix("/tf")
        for topic in graph.topics_of(*FRAMES)
        if topic.endswith("/tf") and topic not in dead
    )


def _may_be(topic: str, wanted: Wanted) -> bool:
    if any(part in topic.lower() for part in wanted.never):
        return False
    return wanted.takes_others or _place_of(topic, wanted) < len(wanted.endings)


def _place_of(topic: str, wanted: Wanted) -> int:
    endings = enumerate(wanted.endings)
    places = (place for place, ending in endings if re.search(f"{ending}$", topic.lower()))
    return next(places, len(wanted.endings))
