"""The nodes, topics and services of a robot, as its ROS would show them."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from mapspeak.robot import RobotDescription
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server.hub import ROSBRIDGE_NODE, Topic

BASE_FRAME = "base_footprint"
BASE_NODE = "/robot_base"
CAMERA_NODE, LASER_NODE = "/camera", "/laser"
ROSAPI_NODE = "/rosapi"
STATE_NODE = "/robot_state_publisher"
SLAM_NODES = {Dialect.ROS1: "/slam_gmapping", Dialect.ROS2: "/slam_toolbox"}
NAVIGATORS = {Dialect.ROS1: "/move_base", Dialect.ROS2: "/bt_navigator"}


def navigator_of(dialect: Dialect) -> str:
    """Return the node that drives to goals."""
    return NAVIGATORS[dialect]


def topics_of(dialect: Dialect, offered: RobotDescription) -> list[Topic]:
    """Return the topics of the robot's own nodes."""
    slam = SLAM_NODES[dialect]
    topics = [
        Topic(name="/clock", type="rosgraph_msgs/Clock", publishers=(BASE_NODE,)),
        _latched("/map", "nav_msgs/OccupancyGrid", slam),
        _latched("/map_metadata", "nav_msgs/MapMetaData", slam),
        Topic(name="/tf", type="tf2_msgs/TFMessage", publishers=(slam, BASE_NODE)),
        _latched("/tf_static", "tf2_msgs/TFMessage", STATE_NODE),
        Topic(name="/odom", type="nav_msgs/Odometry", publishers=(BASE_NODE,)),
        Topic(name="/cmd_vel", type="geometry_msgs/Twist", subscribers=(BASE_NODE,)),
    ]
    if offered.has_camera:
        image, info = "sensor_msgs/CompressedImage", "sensor_msgs/CameraInfo"
        topics += [
            Topic(name="/camera/image_raw/compressed", type=image, depth=1,
                  publishers=(CAMERA_NODE,)),
            Topic(name="/camera/camera_info", type=info, depth=1, publishers=(CAMERA_NODE,)),
        ]  # fmt: skip
    if offered.has_laser:
        scan = "sensor_msgs/LaserScan"
        topics.append(Topic(name="/scan", type=scan, depth=1, publishers=(LASER_NODE,)))
    return topics + (_ros1_topics() if dialect is Dialect.ROS1 else _ros2_topics())


def _ros1_topics() -> list[Topic]:
    navigator = NAVIGATORS[Dialect.ROS1]
    actions, types = ("feedback", "result"), "move_base_msgs/MoveBaseAction"
    pose, estimate = "geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped"
    heard = {
        "/move_base/goal": f"{types}Goal",
        "/move_base/cancel": "actionlib_msgs/GoalID",
        "/move_base_simple/goal": pose,
    }
    return [
        Topic(name="/amcl_pose", type=estimate, is_latched=True, publishers=("/amcl",)),
        Topic(name="/rosout", type="rosgraph_msgs/Log", publishers=(ROSBRIDGE_NODE,)),
        *(Topic(name=name, type=kind, subscribers=(navigator,)) for name, kind in heard.items()),
        *(
            Topic(name=f"/move_base/{each}", type=f"{types}{each.title()}", publishers=(navigator,))
            for each in actions
        ),
        Topic(
            name="/move_base/status", type="actionlib_msgs/GoalStatusArray", publishers=(navigator,)
        ),
    ]


def _ros2_topics() -> list[Topic]:
    navigator, action = NAVIGATORS[Dialect.ROS2], "/navigate_to_pose/_action"
    estimate = "geometry_msgs/PoseWithCovarianceStamped"
    feedback = "nav2_msgs/NavigateToPose_FeedbackMessage"
    return [
        Topic(name="/pose", type=estimate, publishers=(SLAM_NODES[Dialect.ROS2],)),
        Topic(name="/goal_pose", type="geometry_msgs/PoseStamped", subscribers=(navigator,)),
        Topic(name=f"{action}/feedback", type=feedback, publishers=(navigator,)),
        _latched(f"{action}/status", "action_msgs/GoalStatusArray", navigator),
    ]


def _latched(name: str, message_type: str, node: str) -> Topic:
    return Topic(name=name, type=message_type, is_latched=True, depth=1, publishers=(node,))


Values = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Service:
    """One service.

    Attributes:
        name: With its leading slash.
        type: As "package/Type".
        node: Which offers it.
        answer: Gives the response for a request; None for a service that never answers.
    """

    name: str
    type: str
    node: str
    answer: Callable[[Values], Awaitable[Values]] | None


class Services:
    """All services there are."""

    def __init__(self) -> None:
        self._services: dict[str, Service] = {}

    @property
    def all(self) -> list[Service]:
        """The services by name."""
        return sorted(self._services.values(), key=lambda service: service.name)

    def add(self, service: Service) -> None:
        """Offer one more."""
        self._services[service.name] = service

    def find(self, name: str) -> Service | None:
        """Find a service; a leading slash may be missing."""
        return self._services.get(f"/{name.strip('/')}")
