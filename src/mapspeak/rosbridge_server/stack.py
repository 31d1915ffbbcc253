"""One robot as a ROS of its own: its topics, services and actions, kept going by its clock."""

from collections.abc import Callable, Coroutine
from typing import Any

import anyio
import anyio.lowlevel
from anyio.abc import TaskGroup

from mapspeak.errors import MapspeakError
from mapspeak.robot import NavigationPart, Robot, RobotDescription
from mapspeak.ros.discovery.watch import COSTMAPS
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.grids import write_grid
from mapspeak.ros.messages.poses import FramedPose, read_twist
from mapspeak.rosbridge_server.hub import ROSBRIDGE_NODE, Hub, Publication, Topic
from mapspeak.rosbridge_server.interfaces import (
    BATTERY_TOPIC,
    BATTERY_TYPE,
    NODE,
    Interfaces,
    RosSystem,
    Values,
    offer_skills,
    types_of,
)
from mapspeak.rosbridge_server.navigation import ACTION, BASE_FRAME, Drives, MoveBase, Nav2
from mapspeak.rosbridge_server.rosapi import Parameters, add_parameter_services, add_rosapi
from mapspeak.rosbridge_server.sources import (
    NAVIGATION_TOPICS,
    SCAN_TOPIC,
    TICK_S,
    Pace,
    Sources,
    face_cameras,
)
from mapspeak.skill import SkilledRobot

STATUS_PERIOD_S = 0.2
FEEDBACK_PERIOD_S = 0.1
BASE_NODE = "/robot_base"
LASER_NODE = "/laser"
STATE_NODE = "/robot_state_publisher"
SLAM_NODES = {Dialect.ROS1: "/slam_gmapping", Dialect.ROS2: "/slam_toolbox"}
NAVIGATORS = {Dialect.ROS1: "/move_base", Dialect.ROS2: "/bt_navigator"}


def topics_of(dialect: Dialect, offered: RobotDescription) -> list[Topic]:
    """Return the topics of the robot's own nodes."""
    slam, navigator = SLAM_NODES[dialect], NAVIGATORS[dialect]
    estimate, pose = "geometry_msgs/PoseWithCovarianceStamped", "geometry_msgs/PoseStamped"
    topics = [
        _published("/clock", "rosgraph_msgs/Clock", BASE_NODE),
        _latched("/map", "nav_msgs/OccupancyGrid", slam),
        _latched("/map_metadata", "nav_msgs/MapMetaData", slam),
        _published("/tf", "tf2_msgs/TFMessage", slam, BASE_NODE),
        _latched("/tf_static", "tf2_msgs/TFMessage", STATE_NODE),
        _published("/odom", "nav_msgs/Odometry", BASE_NODE),
        _heard("/cmd_vel", "geometry_msgs/Twist", BASE_NODE),
    ]
    for camera in face_cameras(offered):
        node = f"/{camera.node}"
        topics += [
            _published(camera.image_topic, "sensor_msgs/CompressedImage", node, depth=1),
            _published(camera.info_topic, "sensor_msgs/CameraInfo", node, depth=1),
        ]
    if offered.has_laser:
        topics.append(_published(SCAN_TOPIC, "sensor_msgs/LaserScan", LASER_NODE, depth=1))
    shown = NAVIGATION_TOPICS[dialect]
    topics += [
        _published(shown[NavigationPart.PLAN], "nav_msgs/Path", navigator, depth=1),
        _published(
            shown[NavigationPart.FOOTPRINT], "geometry_msgs/PolygonStamped", navigator, depth=1
        ),
    ]
    if dialect is Dialect.ROS2:
        action = f"{ACTION}/_action"
        return [
            *topics,
            _published("/pose", estimate, slam),
            _heard("/goal_pose", pose, navigator),
            _published(f"{action}/feedback", "nav2_msgs/NavigateToPose_FeedbackMessage", navigator),
            _latched(f"{action}/status", "action_msgs/GoalStatusArray", navigator),
        ]
    action_type = "move_base_msgs/MoveBaseAction"
    return [
        *topics,
        Topic(name="/amcl_pose", type=estimate, is_latched=True, publishers=("/amcl",)),
        _published("/rosout", "rosgraph_msgs/Log", ROSBRIDGE_NODE),
        _heard("/move_base/goal", f"{action_type}Goal", navigator),
        _heard("/move_base/cancel", "actionlib_msgs/GoalID", navigator),
        _heard("/move_base_simple/goal", pose, navigator),
        _published("/move_base/feedback", f"{action_type}Feedback", navigator),
        _published("/move_base/result", f"{action_type}Result", navigator),
        _published("/move_base/status", "actionlib_msgs/GoalStatusArray", navigator),
    ]


def _published(name: str, message_type: str, *nodes: str, depth: int = 50) -> Topic:
    return Topic(name=name, type=message_type, depth=depth, publishers=nodes)


def _latched(name: str, message_type: str, node: str) -> Topic:
    return Topic(name=name, type=message_type, is_latched=True, depth=1, publishers=(node,))


def _heard(name: str, message_type: str, node: str) -> Topic:
    return Topic(name=name, type=message_type, subscribers=(node,))


def parameters_of(dialect: Dialect, *, radius_m: float) -> Parameters:
    """Return the parameters of a robot with SLAM and navigation."""
    by_node: dict[str, Values] = {
        SLAM_NODES[dialect]: {"map_frame": "map", "odom_frame": "odom", "base_frame": BASE_FRAME},
        NAVIGATORS[dialect]: {"global_frame": "map", "robot_base_frame": BASE_FRAME},
        BASE_NODE: {"robot_radius": radius_m},
    }
    costmap, prefix = COSTMAPS[dialect][0]
    by_node.setdefault(costmap, {})[f"{prefix}robot_radius"] = radius_m
    return Parameters(dialect, by_node)


class RosStack(RosSystem):
    """The stand-in for a robot and its ROS.

    Args:
        robot: Any robot; its `sleep` must give way to other tasks.
        hub: Carries the robot's topics; one is made of `topics_of` where none is given.
        drives: Takes the goals; likewise.
        skilled: The robot where it has skills of its own.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        dialect: Dialect,
        hub: Hub | None = None,
        drives: Drives | None = None,
        skilled: SkilledRobot | None = None,
    ) -> None:
        topics = topics_of(dialect, robot.description)
        skills = () if skilled is None else skilled.build_skills(robot)
        if skilled is not None:
            topics.append(_published(BATTERY_TOPIC, BATTERY_TYPE, NODE, depth=1))
        interfaces = Interfaces(dialect, more=types_of(skills))
        super().__init__(hub or Hub(topics), interfaces, dialect=dialect)
        offer_skills(self, skills)
        self._drives = drives or Drives(robot)
        self._robot = robot
        self._sources = Sources(robot, self.hub, dialect=dialect, skilled=skilled)
        self._navigation: Nav2 | MoveBase
        self._tasks: TaskGroup
        self._feedback, self._status = Pace(FEEDBACK_PERIOD_S), Pace(STATUS_PERIOD_S)
        self._take("/cmd_vel", self._take_velocity)
        parameters = parameters_of(dialect, radius_m=robot.description.radius_m)
        add_rosapi(self, parameters, lambda: robot.now_s)
        map_service = "/dynamic_map"
        if dialect is Dialect.ROS2:
            map_service = "/slam_toolbox/dynamic_map"
            self._navigation = self._add_nav2()
            add_parameter_services(self, parameters)
        else:
            self._navigation = self._add_move_base()
        self.offer_typed(
            map_service, "nav_msgs/GetMap", node=SLAM_NODES[dialect], answer=self._give_map
        )

    async def keep_going(self, *, task_status: anyio.abc.TaskStatus[None]) -> None:
        """Publish and watch the drives as robot time passes, until cancelled."""
        async with anyio.create_task_group() as self._tasks:
            await self._sources.start()
            task_status.started()
            while True:
                await self._robot.sleep(TICK_S)
                # A robot whose time does not pass by itself must not keep others from their turn.
                await anyio.lowlevel.checkpoint()
                await self._sources.publish_due(self._tasks)
                await self._watch_drives()

    async def _watch_drives(self) -> None:
        now_s = self._robot.now_s
        if isinstance(self._navigation, MoveBase) and self._status.is_due(now_s):
            self._navigation.publish_status()
        if not self._drives.under_way or not self._feedback.is_due(now_s):
            return
        try:
            await self._drives.look()
            here = await self._robot.fetch_pose()
        except MapspeakError:
            return
        in_map = FramedPose(pose=here.pose, frame_id="map", stamp_s=self._robot.now_s)
        for drive in self._drives.under_way:
            self._navigation.publish_feedback(drive, in_map)

    def _take(self, topic: str, handle: Callable[[Publication], Coroutine[Any, Any, None]]) -> None:
        """Let the robot act on a topic, without making the publisher wait."""

        def act(publication: Publication) -> None:
            self._tasks.start_soon(handle, publication)

        self.hub.take(topic, act)

    async def _take_velocity(self, publication: Publication) -> None:
        """Stop on zero velocity; ignore others, which the port cannot command."""
        try:
            if read_twist(publication.message).is_standing:
                await self._robot.stop()
                await self._drives.look()
        except MapspeakError:
            return

    def _add_nav2(self) -> Nav2:
        self.nav2 = Nav2(self._robot, self.hub, self._drives)
        self._take("/goal_pose", self.nav2.take_goal_pose)
        self.offer_typed(
            f"{ACTION}/_action/cancel_goal",
            "action_msgs/CancelGoal",
            node=NAVIGATORS[Dialect.ROS2],
            answer=self.nav2.cancel_goals,
        )
        return self.nav2

    def _add_move_base(self) -> MoveBase:
        move_base = MoveBase(self._robot, self.hub, self._drives)
        self._take("/move_base/goal", move_base.take_goal)
        self._take("/move_base/cancel", move_base.take_cancel)
        self._take("/move_base_simple/goal", move_base.take_simple_goal)
        return move_base

    async def _give_map(self, _request: Values) -> Values:
        return {"map": write_grid(await self._robot.fetch_map(), dialect=self.dialect)}
